"""A light booth with a sphere whose surface is a printed plate, as a scene of Mitsuba 3.

Mitsuba's scalar variants have single precision: light goes on at a distance from each face of 9e-5 (1 + the
largest coordinate) and skips the ink up to there. So the point of the sphere in the middle of the picture is
the origin, only a small spot around it is evaluated, the unit is small, and so are sphere and plate.
"""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError, require_number
from jaxink.export import Medium, even_table

SHEET, SOLID, VOLUME, WHITE = "sheet", "solid", "volume", "white"
# Units of the scene in a mm.
PER_MM = 20
# Half the width of the centre that is looked at, over the radius.
_CENTRE = 0.005
# Distance of the black core from the ink: more than the step of single precision.
_GAP_MM = 0.05
# Part of the picture's width that the sphere takes.
FILLS = 0.85


@dataclasses.dataclass(frozen=True)
class Booth:
    """Sizes in mm, and reflectances.

    Parameters
    ----------
    radius_mm
        Outer radius of the sphere.
    plate_mm
        Thickness of the clear plate, of which the sphere is a shell with the ink inside; it must be small
        against the radius if flat sheets are to agree with it.
    side_mm
        Width, height and depth of the booth, which is open in front.
    wall
        Reflectance of the walls, which are diffuse.
    tubes
        Number of lamps below the ceiling.
    tube_radius_mm
        Their radius.
    """

    radius_mm: float = 20.0
    plate_mm: float = 0.05
    side_mm: float = 400.0
    wall: float = 0.7
    tubes: int = 8
    tube_radius_mm: float = 19.0

    def __post_init__(self):
        for name in ("radius_mm", "plate_mm", "side_mm", "wall", "tubes", "tube_radius_mm"):
            require_number(name, getattr(self, name))
            if not getattr(self, name) > 0:
                raise InputRefusedError(f"{name} is {getattr(self, name):g}; it must be positive.")
        if not self.wall < 1:
            raise InputRefusedError(f"wall is {self.wall:g}; the walls must reflect less than 1.")
        if not 4 * self.radius_mm < self.side_mm:
            raise InputRefusedError(
                f"radius_mm is {self.radius_mm:g}; it must be less than a quarter of side_mm, which is "
                f"{self.side_mm:g}."
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
            f"a sphere of {2 * self.radius_mm:g} mm, a shell of plate {self.plate_mm:g} mm thick with the "
            f"ink on its inner face and black within, in a booth of {self.side_mm:g} mm with diffuse walls "
            f"of {100 * self.wall:g} % and {self.tubes:g} tubes of {2 * self.tube_radius_mm:g} mm below its "
            "ceiling"
        )


def lit(booth: Booth) -> dict[str, Any]:
    """Walls and tubes of radiance 1."""
    import mitsuba as mi

    to, half = mi.ScalarTransform4f(), PER_MM * booth.side_mm / 2
    middle = to.translate([0, 0, -PER_MM * booth.radius_mm])
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
        z = half * ((2 * k + 1) / booth.tubes - 1) - PER_MM * booth.radius_mm
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
    """Looks at the sphere from the front, or at its centre only."""
    import mitsuba as mi

    distance = 0.99 * booth.side_mm / 2 - booth.radius_mm
    half = booth.radius_mm * _CENTRE if centre else booth.radius_mm / FILLS
    away = distance if centre else distance + booth.radius_mm
    return {
        "type": "perspective",
        "fov": float(np.rad2deg(2 * np.arctan(half / away))),
        "to_world": mi.ScalarTransform4f().look_at(
            origin=[0, 0, PER_MM * distance], target=[0, 0, 0], up=[0, 1, 0]
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


def white_sphere(booth: Booth) -> dict[str, Any]:
    """A perfect diffuser, to which luminances refer."""
    return {"sphere": _sphere(booth, 0.0, _diffuse(1.0))}


def sheet_sphere(booth: Booth, table: Path, wavelength_nm: float) -> dict[str, Any]:
    """The whole plate with its ink as a surface without thickness."""
    return {
        "sphere": _sphere(booth, 0.0, _table(table, wavelength_nm), flip_normals=True),
        "core": _core(booth, 0.0),
    }


def solid_sphere(
    booth: Booth, table: Path, wavelength_nm: float, plate: float, around: float
) -> dict[str, Any]:
    """The clear plate as a shell, with the ink's BSDF on its inner face.

    ``plate`` and ``around`` are the refractive indices of the plate and in front of it.
    """
    return {
        "plate": _sphere(booth, 0.0, _step(plate, around)),
        "ink": _sphere(booth, booth.plate_mm, _table(table, wavelength_nm), flip_normals=True),
        "core": _core(booth, booth.plate_mm),
    }


def volume_sphere(booth: Booth, medium: Medium, wavelength: int, around: float) -> dict[str, Any]:
    """The clear plate as a shell, and the ink within as another, in which light is scattered and absorbed."""
    plate, beyond = (float(index) for index in medium.indices[:, wavelength])
    index, depth = float(medium.refractive_index[wavelength]), medium.thickness_um / 1000
    ink = {"type": "ref", "id": "medium"}
    return {
        "medium": _medium(medium, wavelength),
        "plate": _sphere(booth, 0.0, _step(plate, around)),
        "upper": _sphere(booth, booth.plate_mm, _step(index, plate), interior=ink),
        "lower": _sphere(booth, booth.plate_mm + depth, _step(beyond, index), exterior=ink),
        "core": _core(booth, booth.plate_mm + depth),
    }


def _sphere(booth: Booth, depth_mm: float, bsdf: dict, **more) -> dict[str, Any]:
    centre, radius = [0, 0, -PER_MM * booth.radius_mm], PER_MM * (booth.radius_mm - depth_mm)
    return {"type": "sphere", "center": centre, "radius": radius, "bsdf": bsdf, **more}


def _core(booth: Booth, depth_mm: float) -> dict[str, Any]:
    return _sphere(booth, depth_mm + _GAP_MM, _diffuse(0.0))


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
