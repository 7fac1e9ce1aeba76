"""A plate with an ink on its lower face in Mitsuba, with the medium that is written for it."""

import dataclasses
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from benchmarks.validation.render.speos_file import read_speos_material
from jaxink.export.volume import even_table

# Half the width of the plate, and distance of the black screens, in mm.
_HALF_MM, _SCREEN_MM = 2000.0, 50.0
N_BATCHES = 20


@dataclasses.dataclass(frozen=True)
class Plate:
    """A clear plate in air with an ink below it.

    Parameters
    ----------
    medium_file
        Written by `jaxink.export.volume.write_volume` for Mitsuba or Speos.
    ink_mm, ink_index
        Thickness and refractive index of the ink.
    plate_mm, plate_index
        Of the plate, which does not absorb.
    enlargement
        By which the ink is thicker and its coefficients are smaller, which changes neither R nor T of a slab.
    """

    medium_file: Path
    ink_mm: float
    ink_index: float
    plate_mm: float = 1.0
    plate_index: float = 1.5
    enlargement: float = 1.0


def read_medium(path: Path, enlargement: float = 1.0) -> dict:
    """Numbers of a file of Mitsuba or Speos as a medium of Mitsuba; for the last, see `Plate`."""
    if path.suffix == ".material":
        return _speos_medium(path, enlargement)
    (medium,) = ElementTree.parse(path).getroot().findall("medium")
    found = {e.get("name"): float(e.get("value", "nan")) for e in medium.findall("spectrum")}
    values = medium.find("phase/string").get("value")
    return {
        "type": "homogeneous",
        "sigma_t": {"type": "constvolume", "value": found["sigma_t"] / enlargement},
        "albedo": {"type": "constvolume", "value": found["albedo"]},
        "phase": {"type": "tabphase", "values": values},
    }


def _speos_medium(path: Path, enlargement: float) -> dict:
    read = read_speos_material(path)
    scattering, absorption = read.scattering_per_mm[0, 1], read.absorption_per_mm[0, 1]
    cosines, values = even_table(read.phase)
    return {
        "type": "homogeneous",
        "sigma_t": {"type": "constvolume", "value": (scattering + absorption) / enlargement},
        "albedo": {"type": "constvolume", "value": scattering / (scattering + absorption)},
        "phase": {"type": "tabphase", "values": ", ".join(f"{v:.9g}" for v in values / (4 * np.pi))},
    }


def scene(plate: Plate, theta_deg: float, side: str) -> dict:
    """Plate seen from above at an angle, lit from above (R) or below (T) by uniform light of radiance 1.

    By reciprocity, the radiance that is seen is the directional-hemispherical reflectance or transmittance.
    """
    import mitsuba as mi

    to = mi.ScalarTransform4f
    depth = plate.plate_mm + plate.enlargement * plate.ink_mm
    theta = np.deg2rad(theta_deg)
    eye = np.array([np.sin(theta), 0.0, np.cos(theta)])

    def face(z, bsdf, **media):
        place = to().translate([0, 0, z]).scale([_HALF_MM, _HALF_MM, 1])
        return {"type": "rectangle", "to_world": place, "bsdf": bsdf, **media}

    def step(inside, outside):
        return {"type": "dielectric", "int_ior": inside, "ext_ior": outside}

    same = abs(plate.ink_index - plate.plate_index) < 1e-9
    ink = {"type": "ref", "id": "ink"}
    screen_z = -depth - _SCREEN_MM if side == "R" else _SCREEN_MM
    screen = to().translate([0, 0, screen_z]).scale([1e6, 1e6, 1])
    black = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}}
    # Russian roulette ends one in twenty paths at every step, however much light they carry: far too noisy
    # where light is scattered a thousand times.
    return {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 1_000_000},
        "ink": read_medium(plate.medium_file, plate.enlargement),
        "top": face(0.0, step(plate.plate_index, 1.0)),
        "middle": face(
            -plate.plate_mm,
            {"type": "null"} if same else step(plate.ink_index, plate.plate_index),
            interior=ink,
        ),
        "bottom": face(-depth, step(1.0, plate.ink_index), exterior=ink),
        "screen": {"type": "rectangle", "to_world": screen, "bsdf": black},
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
        "sensor": {
            "type": "radiancemeter",
            "to_world": to().look_at(origin=list(10 * eye), target=[0, 0, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent"},
        },
    }


def power(plate: Plate, theta_deg: float, side: str, n_paths: int, seed: int) -> tuple[float, float]:
    """Directional-hemispherical power by Mitsuba, and its standard error from batches."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    loaded = mi.load_dict(scene(plate, theta_deg, side))
    each = [
        float(np.array(mi.render(loaded, spp=n_paths // N_BATCHES, seed=seed * N_BATCHES + k)).mean())
        for k in range(N_BATCHES)
    ]
    return float(np.mean(each)), float(np.std(each, ddof=1) / N_BATCHES**0.5)
