"""A light booth with a body whose surface is a printed plate, as a scene of Mitsuba 3.

Mitsuba's scalar variants have single precision: light goes on at a distance from each face of 9e-5 (1 + the
largest coordinate) and skips the ink up to there. So the point of the body in the middle of the picture is
the origin, only a small spot around it is evaluated, the unit is small, and so are body and plate.
"""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError, require_positive
from jaxink.export import Medium, even_table
from jaxink.render.bodies import PER_MM, Body, Mesh, Sphere

SHEET, SOLID, VOLUME, WHITE = "sheet", "solid", "volume", "white"
# Half the width of the centre that is looked at, over that of the body.
_CENTRE = 0.005
# Distance of the black core from the ink: more than the step of single precision.
_GAP_MM = 0.05
# Part of the picture's width that the body takes.
FILLS = 0.85


@dataclasses.dataclass(frozen=True)
class Booth:
    """Sizes in mm, and reflectances.

    Parameters
    ----------
    body
        What stands in the booth.
    plate_mm
        Thickness of the clear plate, of which the body is a shell with the ink inside; it must be small
        against the radii of the body if flat sheets are to agree with it.
    side_mm
        Width, height and depth of the booth, which is open in front.
    wall
        Reflectance of the walls, which are diffuse.
    tubes
        Number of lamps below the ceiling.
    tube_radius_mm
        Their radius.
    """

    body: Body = Sphere()
    plate_mm: float = 0.05
    side_mm: float = 400.0
    wall: float = 0.7
    tubes: int = 8
    tube_radius_mm: float = 19.0

    def __post_init__(self):
        for name in ("plate_mm", "side_mm", "wall", "tubes", "tube_radius_mm"):
            require_positive(name, getattr(self, name))
        if not self.wall < 1:
            raise InputRefusedError(f"wall is {self.wall:g}; the walls must reflect less than 1.")
        if not 4 * self.body.half_width_mm < self.side_mm:
            raise InputRefusedError(
                f"the body is {2 * self.body.half_width_mm:g} mm wide; it must be less than half of side_mm, "
                f"which is {self.side_mm:g}."
            )
        if not self.tubes * 2 * self.tube_radius_mm < self.side_mm:
            raise InputRefusedError(
                f"{self.tubes:g} tubes of radius {self.tube_radius_mm:g} mm do not fit into a booth "
                f"{self.side_mm:g} mm wide (side_mm)."
            )

    @property
    def words(self) -> str:
        """The scene in words."""
        return (
            f"{self.body.words}, a shell of plate {self.plate_mm:g} mm thick with the ink on its inner face "
            f"and black within, in a booth of {self.side_mm:g} mm with diffuse walls of {100 * self.wall:g} "
            f"% and {self.tubes:g} tubes of {2 * self.tube_radius_mm:g} mm below its ceiling"
        )


def lit(booth: Booth) -> dict[str, Any]:
    """Walls and tubes of radiance 1."""
    import mitsuba as mi

    to, half = mi.ScalarTransform4f(), PER_MM * booth.side_mm / 2
    middle = to.translate([0, 0, -PER_MM * booth.body.middle_mm])
    wall = {"type": "twosided", "bsdf": _diffuse(booth.wall)}
    # Rectangles look along +z.
    turns = {
        "back": to,
        "front": to.rotate([0, 1, 0], 180),
        "left": to.rotate([0, 1, 0], 90),
        "right": to.rotate([0, 1, 0], -90),
        "floor": to.rotate([1, 0, 0], -90),
        "ceiling": to.rotate([1, 0, 0], 90),
    }
    scene: dict[str, Any] = {
        name: {
            "type": "rectangle",
            "to_world": middle @ turn @ to.translate([0, 0, -half]) @ to.scale([half, half, 1]),
            "bsdf": wall,
        }
        for name, turn in turns.items()
    }
    radius = PER_MM * booth.tube_radius_mm
    height = half - 2 * radius
    for k in range(int(booth.tubes)):
        z = half * ((2 * k + 1) / booth.tubes - 1) - PER_MM * booth.body.middle_mm
        scene[f"tube{k}"] = {
            "type": "cylinder",
            "p0": [-0.9 * half, height, z],
            "p1": [0.9 * half, height, z],
            "radius": radius,
            "bsdf": _diffuse(0.0),
            "emitter": {"type": "area", "radiance": _value(1.0)},
        }
    return scene


def uniform() -> dict[str, Any]:
    """Light of radiance 1 from everywhere, in which what is seen of a flat sample is its reflectance."""
    return {"sky": {"type": "constant", "radiance": _value(1.0)}}


def camera(booth: Booth, pixels: int, centre: bool) -> dict[str, Any]:
    """Looks at the body from the front, or at the middle of its face only."""
    import mitsuba as mi

    body = booth.body
    distance = 0.99 * booth.side_mm / 2 - body.middle_mm
    half = body.half_width_mm * (_CENTRE if centre else 1 / FILLS)
    away = distance if centre else distance + body.middle_mm
    height = 0.0 if centre else PER_MM * body.height_mm
    return {
        "type": "perspective",
        "fov": float(np.rad2deg(2 * np.arctan(half / away))),
        "to_world": mi.ScalarTransform4f().look_at(
            origin=[0, height, PER_MM * distance], target=[0, height, 0], up=[0, 1, 0]
        ),
        "film": {
            "type": "hdrfilm",
            "width": pixels,
            "height": pixels,
            "rfilter": {"type": "box"},
            "pixel_format": "luminance",
        },
        "sampler": {"type": "independent"},
    }


def integrator(way: str) -> dict[str, Any]:
    """Paths of any length.

    Russian roulette ends one in twenty paths at every step, however much light they carry: far too noisy
    where light is scattered a thousand times.
    """
    if way == VOLUME:
        return {"type": "volpath", "max_depth": -1, "rr_depth": 1_000_000}
    return {"type": "path", "max_depth": -1, "rr_depth": 50}


def white_body(booth: Booth, folder: Path) -> dict[str, Any]:
    """A perfect diffuser, to which luminances refer; meshes of all bodies are written to the folder."""
    return {"body": _surface(booth, 0.0, folder) | {"bsdf": _diffuse(1.0)}}


def sheet_body(booth: Booth, table: Path, wavelength_nm: float, folder: Path) -> dict[str, Any]:
    """The whole plate with its ink as a surface without thickness."""
    face = _surface(booth, 0.0, folder) | {"flip_normals": True}
    return {"face": face | {"bsdf": _table(table, wavelength_nm)}} | _core(booth, 0.0, folder)


def solid_body(
    booth: Booth, table: Path, wavelength_nm: float, plate: float, around: float, folder: Path
) -> dict[str, Any]:
    """The clear plate as a shell, with the ink's BSDF on its inner face.

    ``plate`` and ``around`` are the refractive indices of the plate and in front of it.
    """
    ink = _surface(booth, booth.plate_mm, folder) | {"flip_normals": True}
    return {
        "plate": _surface(booth, 0.0, folder) | {"bsdf": _step(plate, around)},
        "ink": ink | {"bsdf": _table(table, wavelength_nm)},
    } | _core(booth, booth.plate_mm, folder)


def volume_body(booth: Booth, medium: Medium, wavelength: int, around: float, folder: Path) -> dict[str, Any]:
    """The clear plate as a shell, and the ink within as another, in which light is scattered and absorbed."""
    plate, beyond = (float(index) for index in medium.indices[:, wavelength])
    index, end_mm = float(medium.refractive_index[wavelength]), booth.plate_mm + medium.thickness_um / 1000
    ink = {"type": "ref", "id": "medium"}
    upper, lower = (_surface(booth, depth_mm, folder) for depth_mm in (booth.plate_mm, end_mm))
    return {
        "medium": _medium(medium, wavelength),
        "plate": _surface(booth, 0.0, folder) | {"bsdf": _step(plate, around)},
        "upper": upper | {"bsdf": _step(index, plate), "interior": ink},
        "lower": lower | {"bsdf": _step(beyond, index), "exterior": ink},
    } | _core(booth, end_mm, folder)


def _core(booth: Booth, depth_mm: float, folder: Path) -> dict[str, Any]:
    """What is black within, and around the rim of a body that is not closed."""
    end_mm, radius_mm = depth_mm + _GAP_MM, booth.body.rim_radius_mm
    core = {"core": _surface(booth, end_mm, folder) | {"bsdf": _diffuse(0.0)}}
    if radius_mm is None:
        return core
    band = {"type": "cylinder", "p0": [0, 0, 0], "p1": [0, 0, -PER_MM * end_mm], "bsdf": _diffuse(0.0)}
    return core | {"rim": band | {"radius": PER_MM * radius_mm}}


def _surface(booth: Booth, depth_mm: float, folder: Path) -> dict[str, Any]:
    """The body's surface at a depth as a shape of Mitsuba."""
    found = booth.body.surface(depth_mm)
    return found.write(folder / f"{depth_mm:.9g}.ply") if isinstance(found, Mesh) else found


def _value(value: float) -> dict[str, Any]:
    return {"type": "rgb", "value": value}


def _diffuse(reflectance: float) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": _value(reflectance)}


def _table(file: Path, wavelength_nm: float) -> dict[str, Any]:
    return {"type": "jaxink_table", "filename": str(file), "wavelength_nm": wavelength_nm}


def _step(inside: float, outside: float) -> dict[str, Any]:
    if abs(inside / outside - 1) < 1e-9:
        return {"type": "null"}
    return {"type": "dielectric", "int_ior": inside, "ext_ior": outside}


def _medium(medium: Medium, w: int) -> dict[str, Any]:
    extinction = float(medium.extinction_per_mm[w])
    _, phase = even_table(medium.phase[w])
    return {
        "type": "homogeneous",
        "sigma_t": {"type": "constvolume", "value": extinction / PER_MM},
        "albedo": {"type": "constvolume", "value": float(medium.scattering_per_mm[w]) / extinction},
        # Lamps cannot be seen through the faces, which refract.
        "sample_emitters": False,
        "phase": {
            "type": "tabphase",
            "values": ", ".join(f"{v:.9g}" for v in phase / (4 * np.pi)),
        },
    }
