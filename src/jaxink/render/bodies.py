"""Bodies made of a printed plate for a light booth: a sphere, a flat plate, a torus.

Each is a series of nested surfaces, which are told apart by their depth below the outer face. The origin is a
point of the outer face that is seen, where Mitsuba's single precision is best.
"""

import abc
import dataclasses
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.errors import InputRefusedError, require_positive

# Units of the scene in a mm.
PER_MM = 20
# Facets of a torus around its ring and around its tube: flat to within 0.4 um.
_AROUND_RING, _AROUND_TUBE = 720, 360


@dataclasses.dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles.

    Parameters
    ----------
    points, normals
        Corners in units of the scene, and the surface's normals there.
    faces
        Numbers of the corners of each triangle, counter-clockwise seen from outside.
    """

    points: Float[np.ndarray, "points 3"]
    normals: Float[np.ndarray, "points 3"]
    faces: Int[np.ndarray, "faces 3"]

    def write(self, file: Path) -> dict[str, Any]:
        """Write a binary PLY file, and return it as a shape of Mitsuba."""
        columns = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
        head = (
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(self.points)}\n{columns}"
            f"element face {len(self.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        )
        rows = np.zeros(len(self.faces), dtype=[("n", "u1"), ("corners", "<i4", 3)])
        rows["n"], rows["corners"] = 3, self.faces
        vertices = np.concatenate([self.points, self.normals], axis=1).astype("<f4")
        file.write_bytes(head.encode("ascii") + vertices.tobytes() + rows.tobytes())
        return {"type": "ply", "filename": str(file)}


@dataclasses.dataclass(frozen=True)
class Body(abc.ABC):
    """A body whose outer face is seen; all lengths in mm."""

    name: ClassVar[str]

    def __post_init__(self):
        for field in dataclasses.fields(self):
            require_positive(field.name, getattr(self, field.name))

    @property
    @abc.abstractmethod
    def words(self) -> str:
        """The body in words."""

    @property
    @abc.abstractmethod
    def half_width_mm(self) -> float:
        """Half its largest width, which fills the picture."""

    @property
    @abc.abstractmethod
    def middle_mm(self) -> float:
        """How far behind the origin its middle is."""

    @property
    def height_mm(self) -> float:
        """How far its middle is above the origin."""
        return 0.0

    @property
    def rim_radius_mm(self) -> float | None:
        """Radius of the rim at which its surfaces end; None if they are closed."""
        return None

    @abc.abstractmethod
    def surface(self, depth_mm: float) -> "dict[str, Any] | Mesh":
        """Surface at a depth, its normals outwards: a shape of Mitsuba, or a mesh."""

    @abc.abstractmethod
    def covers(
        self, x_mm: Float[np.ndarray, "..."], y_mm: Float[np.ndarray, "..."], margin_mm: float
    ) -> Bool[np.ndarray, "..."]:
        """Whether points of the picture, from its middle, are on the body by so much at least."""


@dataclasses.dataclass(frozen=True)
class _Round(Body):
    """A body that is seen as a disc."""

    radius_mm: float = 20.0

    @property
    def half_width_mm(self) -> float:
        """Its radius."""
        return self.radius_mm

    def covers(self, x_mm, y_mm, margin_mm):
        """See `Body`."""
        return np.hypot(x_mm, y_mm) < self.radius_mm - margin_mm


@dataclasses.dataclass(frozen=True)
class Sphere(_Round):
    """A sphere.

    Parameters
    ----------
    radius_mm
        Its outer radius.
    """

    name: ClassVar[str] = "sphere"

    @property
    def words(self) -> str:
        """The body in words."""
        return f"a sphere of {2 * self.radius_mm:g} mm"

    @property
    def middle_mm(self) -> float:
        """Its radius."""
        return self.radius_mm

    def surface(self, depth_mm: float) -> dict[str, Any]:
        """A smaller sphere around the same middle."""
        radius = PER_MM * (self.radius_mm - depth_mm)
        return {"type": "sphere", "center": [0, 0, -PER_MM * self.radius_mm], "radius": radius}


@dataclasses.dataclass(frozen=True)
class FlatPlate(_Round):
    """A round flat plate that faces the camera.

    Parameters
    ----------
    radius_mm
        Its radius.
    """

    name: ClassVar[str] = "plate"

    @property
    def words(self) -> str:
        """The body in words."""
        return f"a flat disc of {2 * self.radius_mm:g} mm that faces the camera"

    @property
    def middle_mm(self) -> float:
        """Its face is in the middle of the booth."""
        return 0.0

    @property
    def rim_radius_mm(self) -> float:
        """Its radius."""
        return self.radius_mm

    def surface(self, depth_mm: float) -> dict[str, Any]:
        """A disc behind the face."""
        import mitsuba as mi

        to, radius = mi.ScalarTransform4f(), PER_MM * self.radius_mm
        place = to.translate([0, 0, -PER_MM * depth_mm]) @ to.scale([radius, radius, 1])
        return {"type": "disk", "to_world": place}


@dataclasses.dataclass(frozen=True)
class Torus(Body):
    """A torus, tilted towards the camera so that its hole is seen.

    The origin is on its outer equator, which is seen under an angle of the tilt.

    Parameters
    ----------
    ring_radius_mm, tube_radius_mm
        Radius of the ring, from the middle of the torus to that of its tube, and outer radius of the tube.
    tilt_deg
        Angle between its axis and the vertical, more than 0; a small one shows it from the side.
    """

    name: ClassVar[str] = "torus"
    ring_radius_mm: float = 14.0
    tube_radius_mm: float = 6.0
    tilt_deg: float = 40.0

    def __post_init__(self):
        super().__post_init__()
        if not self.tube_radius_mm < self.ring_radius_mm:
            raise InputRefusedError(
                f"tube_radius_mm is {self.tube_radius_mm:g}; it must be less than ring_radius_mm, which is "
                f"{self.ring_radius_mm:g}."
            )
        if not self.tilt_deg < 90:
            raise InputRefusedError(f"tilt_deg is {self.tilt_deg:g}; it must be less than 90.")

    @property
    def words(self) -> str:
        """The body in words."""
        return (
            f"a torus with a ring of {2 * self.ring_radius_mm:g} mm and a tube of "
            f"{2 * self.tube_radius_mm:g} mm, tilted by {self.tilt_deg:g} degrees"
        )

    @property
    def half_width_mm(self) -> float:
        """Of ring and tube together."""
        return self.ring_radius_mm + self.tube_radius_mm

    @property
    def middle_mm(self) -> float:
        """How far its middle is behind the point of its outer equator that is the origin."""
        return self.half_width_mm * float(np.cos(np.deg2rad(self.tilt_deg)))

    @property
    def height_mm(self) -> float:
        """How far its middle is above that point."""
        return self.half_width_mm * float(np.sin(np.deg2rad(self.tilt_deg)))

    def surface(self, depth_mm: float) -> "Mesh":
        """A thinner torus around the same ring, with facets parallel to those of the outer one."""
        ring = np.linspace(-np.pi, np.pi, _AROUND_RING, endpoint=False)[:, None]
        tube = np.linspace(-np.pi, np.pi, _AROUND_TUBE, endpoint=False)[None]
        out, up = np.cos(tube), np.sin(tube) + 0 * ring
        normal = np.stack([out * np.sin(ring), up, out * np.cos(ring)], axis=-1)
        radius = self.tube_radius_mm - depth_mm
        middle = np.stack([np.sin(ring), 0 * ring, np.cos(ring)], axis=-1) * self.ring_radius_mm
        origin = np.array([0.0, 0.0, self.half_width_mm])
        turn = self._turn()
        points = (middle + radius * normal - origin) @ turn.T
        number = np.arange(_AROUND_RING * _AROUND_TUBE).reshape(_AROUND_RING, _AROUND_TUBE)
        right, above = np.roll(number, -1, axis=0), np.roll(number, -1, axis=1)
        opposite = np.roll(right, -1, axis=1)
        halves = (number, right, opposite), (number, opposite, above)
        faces = np.concatenate([np.stack(half, axis=-1).reshape(-1, 3) for half in halves])
        return Mesh(PER_MM * points.reshape(-1, 3), (normal @ turn.T).reshape(-1, 3), faces)

    def _turn(self) -> Float[np.ndarray, "3 3"]:
        """Rotation about the horizontal through the origin; the far side of the ring goes up."""
        cosine, sine = np.cos(np.deg2rad(self.tilt_deg)), np.sin(np.deg2rad(self.tilt_deg))
        return np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])

    def covers(self, x_mm, y_mm, margin_mm):
        """See `Body`; seen from far away, a torus is the discs around all points of its ring."""
        around = np.linspace(-np.pi, np.pi, _AROUND_RING)
        ring = np.stack([np.sin(around), 0 * around, np.cos(around)], axis=-1) * self.ring_radius_mm
        seen = (ring @ self._turn().T)[:, :2]
        distance = np.hypot(x_mm[..., None] - seen[:, 0], y_mm[..., None] - seen[:, 1]).min(axis=-1)
        return distance < self.tube_radius_mm - margin_mm


BODIES: dict[str, type[Body]] = {body.name: body for body in (Sphere, FlatPlate, Torus)}
