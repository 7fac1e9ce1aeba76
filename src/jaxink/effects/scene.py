"""Settings of the points of a measurement, and the BSDF around them for effects of the instrument."""

import enum
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.measurement import GonioData

# Grid of angles in the plane of a scan, for derivatives and convolutions.
GRID_DEG = np.arange(-89.0, 89.1, 2.0)
# Step for derivatives with respect to the incidence.
INCIDENCE_STEP_DEG = 1.0
_PLANE_DEG = 0.1
# Largest number of grid directions for each point.
_MOST_GRID = 4


class Surroundings(enum.Flag):
    """What a change of the readings needs in addition to the BSDF at the points."""

    NOTHING = 0
    # Grids in the planes of the scans, and the power of regular (specular or directly transmitted) peaks.
    PLANES = enum.auto()
    # The points at incidences one step lower and one step higher.
    INCIDENCES = enum.auto()


class Scene(eqx.Module):
    """Directions of the points, and of the grids in the planes of their scans.

    Parameters
    ----------
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission
        See `GonioData`; used points only.
    row
        Row of each point in its file, as the time at which it was measured.
    signed_deg
        Polar angle of view in its plane through the normal, positive on the side of the specular direction.
    plane
        Plane of each point; a scan has one or several.
    plane_columns
        Incidence, azimuth of the positive side, wavelength and side of each plane, shape ``(planes, 4)``.
    waves, wave_of_point
        The distinct wavelengths in nm, and the index of that of each point.
    slope, curvature
        Matrices from the grid of a plane to the first and second derivative with respect to the signed angle
        at the points, per radian.
    """

    __repr__ = brief_repr

    theta_i_deg: Float[np.ndarray, " points"]
    theta_o_deg: Float[np.ndarray, " points"]
    phi_deg: Float[np.ndarray, " points"]
    wavelength_nm: Float[np.ndarray, " points"]
    is_transmission: Bool[np.ndarray, " points"]
    row: Float[np.ndarray, " points"]
    signed_deg: Float[np.ndarray, " points"]
    plane: Int[np.ndarray, " points"]
    plane_columns: Float[np.ndarray, "planes 4"]
    waves: tuple[float, ...] = eqx.field(static=True)
    wave_of_point: Int[np.ndarray, " points"]
    slope: Float[np.ndarray, "points grid"]
    curvature: Float[np.ndarray, "points grid"]

    @classmethod
    def of(cls, theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission, row) -> "Scene":
        """Scene of the points of a measurement."""
        phi = np.mod(phi_deg, 360.0)
        forward = np.cos(np.deg2rad(phi)) < -1e-9
        # The half plane on the specular side is positive; perpendicular to it, that of 90 degrees.
        forward |= (np.abs(np.cos(np.deg2rad(phi))) <= 1e-9) & (phi < 180)
        positive_phi = np.round(np.where(forward, phi, np.mod(phi + 180, 360)) / _PLANE_DEG) * _PLANE_DEG
        keys = np.column_stack([theta_i_deg, positive_phi, wavelength_nm, is_transmission]).astype(float)
        planes, plane = np.unique(keys, axis=0, return_inverse=True)
        signed = np.where(forward, 1.0, -1.0) * theta_o_deg
        # Importing it takes a quarter of a second, and few samples need it.
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(np.deg2rad(GRID_DEG), np.eye(GRID_DEG.size))
        at = np.deg2rad(np.clip(signed, GRID_DEG[0], GRID_DEG[-1]))
        waves, wave_of_point = np.unique(np.asarray(wavelength_nm, float), return_inverse=True)
        return cls(
            theta_i_deg=np.asarray(theta_i_deg, float),
            theta_o_deg=np.asarray(theta_o_deg, float),
            phi_deg=np.asarray(phi_deg, float),
            wavelength_nm=np.asarray(wavelength_nm, float),
            is_transmission=np.asarray(is_transmission, bool),
            row=np.asarray(row, float),
            signed_deg=signed,
            plane=plane.reshape(-1),
            plane_columns=planes,
            waves=tuple(waves.tolist()),
            wave_of_point=wave_of_point.reshape(-1),
            slope=spline(at, 1),
            curvature=spline(at, 2),
        )

    @classmethod
    def of_used(cls, data: GonioData) -> "Scene":
        """Scene of the points that no mask excludes."""
        return cls.of(*data.used_directions, row=data.reading_order[data.used])

    def __len__(self) -> int:
        return self.theta_o_deg.size

    @property
    def in_few_planes(self) -> bool:
        """Whether grids in the planes of the scans add little to the number of directions."""
        return len(self.plane_columns) * GRID_DEG.size <= _MOST_GRID * max(len(self), 500)

    @property
    def from_forward_deg(self) -> Float[Array, " points"]:
        """Angle to the specular direction in reflection, to the undeviated beam in transmission."""
        return self._angle_to(180.0)

    @property
    def from_retro_deg(self) -> Float[Array, " points"]:
        """Angle to the source, as seen from the side of the point."""
        return self._angle_to(0.0)

    def _angle_to(self, phi_deg):
        return _angle_between(self.theta_i_deg, self.theta_o_deg, self.phi_deg - phi_deg)

    def all_directions(self, surroundings: Surroundings) -> tuple[np.ndarray, ...]:
        """Columns of the points, the grids, and the points at incidences one step lower and higher."""
        points = np.column_stack(
            [self.theta_i_deg, self.theta_o_deg, self.phi_deg, self.wavelength_nm, self.is_transmission]
        )
        incidence, positive, wavelength, side = (c[:, None] for c in self.plane_columns.T)
        shape = (len(self.plane_columns), GRID_DEG.size)
        azimuth = np.where(GRID_DEG >= 0, positive, np.mod(positive + 180, 360))
        columns = (incidence, np.abs(GRID_DEG)[None, :], azimuth, wavelength, side)
        grid = np.stack([np.broadcast_to(c, shape).ravel() for c in columns], axis=1)
        parts = [points, grid] if Surroundings.PLANES in surroundings else [points]
        if Surroundings.INCIDENCES in surroundings:
            for step in (-INCIDENCE_STEP_DEG, INCIDENCE_STEP_DEG):
                moved = points.copy()
                moved[:, 0] += step
                # Beyond the normal the source is on the other side.
                beyond = moved[:, 0] < 0
                moved[:, 0] = np.minimum(np.abs(moved[:, 0]), 89.9)
                moved[beyond, 2] = np.mod(moved[beyond, 2] + 180, 360)
                parts.append(moved)
        return tuple(np.concatenate(parts).T)


class Field(NamedTuple):
    """BSDF of a sample at the points of a scene and around them.

    Parameters
    ----------
    scene
        The points.
    points
        At the points, 1/sr.
    grid
        On the grids of the planes, 1/sr.
    regular
        Share of the incident power in the regular peak of each point's scan and side.
    lower, upper
        At incidences one step lower and higher, 1/sr; None if not computed.
    """

    scene: Scene
    points: Float[Array, " points"]
    grid: Float[Array, "planes grid"]
    regular: Float[Array, " points"]
    lower: Float[Array, " points"] | None
    upper: Float[Array, " points"] | None

    def along(self, matrix: Float[ArrayLike, "points grid"]) -> Float[Array, " points"]:
        """A matrix of the scene applied to the grid of each point's plane."""
        return jnp.sum(matrix * self.grid[self.scene.plane], axis=1)


@jax.jit
def _angle_between(theta_i_deg, theta_o_deg, phi_deg):
    """Angle between two directions whose azimuths differ by phi."""
    i, o, phi = (jnp.deg2rad(a) for a in (theta_i_deg, theta_o_deg, phi_deg))
    cosine = jnp.cos(i) * jnp.cos(o) + jnp.sin(i) * jnp.sin(o) * jnp.cos(phi)
    return jnp.rad2deg(jnp.arccos(jnp.clip(cosine, -1, 1)))
