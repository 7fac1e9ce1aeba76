"""The sphere of `jaxink render --scene sphere` in uniform light, where the answer is known.

In light of radiance 1 from everywhere, the radiance that is seen of a flat sample is its
directional-hemispherical reflectance, by reciprocity; the solver knows it.
"""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np

from jaxink.export import ExportOptions, write
from jaxink.numerics.precision import computing
from jaxink.optics.layers import ClearLayer
from jaxink.render import Booth, PrintedPlate
from jaxink.render.bodies import PER_MM
from jaxink.render.booth import (
    SHEET,
    SOLID,
    VOLUME,
    camera,
    integrator,
    sheet_body,
    solid_body,
    uniform,
    volume_body,
)
from jaxink.render.mitsuba_session import mitsuba, with_table_plugin
from jaxink.solver.bsdf import hemispherical_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack

N_BATCHES = 10
_PIXELS, _CONFIG = 4, SolverConfig(32, 24, 96, 4)
# The same sphere about the origin, so that the face that is looked at is a radius away from it.
AWAY = "volume, 20 mm from the origin"
PATHS = {SHEET: 60_000, SOLID: 60_000, VOLUME: 200_000, AWAY: 100_000}


def known(plate: PrintedPlate) -> float:
    """Reflectance along the normal of the whole plate at its first wavelength."""
    medium = plate.ink.medium
    with computing():
        inside, outside = medium.indices[:, 0]
        stack = Stack((ClearLayer(inside, 0.0), medium.stack(0).layers[0]), outside, outside)
        return float(hemispherical_power(stack, np.zeros(1), _CONFIG)[0][0])


def seen(
    plate: PrintedPlate, way: str, n_paths: int, booth: Booth | None = None, core: bool = True
) -> tuple[float, float]:
    """Radiance at the centre of the sphere at the first wavelength, and its standard error from batches.

    Without its black ``core`` the sphere is hollow.
    """
    booth, around = booth or Booth(), float(plate.surroundings[0])
    wavelength = float(plate.wavelength_nm[0])
    with mitsuba() as mi, tempfile.TemporaryDirectory() as folder:
        table = plate.sheet if way == SHEET else plate.ink.table
        options = ExportOptions(name="table", interpolation_error=1e-3)
        file = with_table_plugin(mi, {way: write(table, "mitsuba", folder, options)})[way]
        meshes = Path(folder)
        if way == SHEET:
            body = sheet_body(booth, file, wavelength, meshes)
        elif way == SOLID:
            body = solid_body(booth, file, wavelength, float(table.index_inside[0]), around, meshes)
        else:
            body = volume_body(booth, plate.ink.medium, 0, around, meshes)
        if not core:
            del body["core"]
        view = camera(booth, _PIXELS, centre=True)
        if way == AWAY:
            body = {
                name: one | {"center": [0, 0, 0]} if one["type"] == "sphere" else one
                for name, one in body.items()
            }
            forward = mi.ScalarTransform4f().translate([0, 0, PER_MM * booth.body.middle_mm])
            view["to_world"] = forward @ view["to_world"]
        scene = mi.load_dict(
            {"type": "scene", "integrator": integrator(VOLUME if way == AWAY else way), "camera": view}
            | uniform()
            | body
        )
        spp = max(1, n_paths // N_BATCHES // _PIXELS**2)
        each = [float(np.array(mi.render(scene, spp=spp, seed=k)).mean()) for k in range(N_BATCHES)]
    return float(np.mean(each)), float(np.std(each, ddof=1) / N_BATCHES**0.5)


def checks(plate: PrintedPlate, ways=tuple(PATHS)) -> dict:
    """What is known, and what is seen by each way."""
    return {"known": known(plate)} | {way: seen(plate, way, PATHS[way]) for way in ways}


def thick(plate: PrintedPlate, plate_mm: float) -> tuple[float, float]:
    """The volume with another thickness of the plate."""
    return seen(plate, VOLUME, PATHS[VOLUME], dataclasses.replace(Booth(), plate_mm=plate_mm))
