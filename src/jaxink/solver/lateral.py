"""Lateral light transport: light that leaves the sample outside the field of view of the detector.

Beam and field of view are discs on the sample. In the lateral Fourier transform successive displacements
multiply: a displacement s of random azimuth contributes the factor J0(k s). A stack whose passages through
clear layers carry that factor therefore sums all round trips. The share of light seen after a displacement s
is written as a sum of J0(k_j s), and the light seen is the same sum over solutions of the stack.

Approximations: the azimuth is random from one passage to the next, owing to multiple scattering; the first
path in and the last path out are exact. Light spreads laterally in clear layers only, not within the ink.
Singly scattered light is not displaced by reflections within a plate before or after the scattering.

References
----------
Abramowitz, Stegun 1964 Handbook of Mathematical Functions, 9.1.18 and 9.1.20 (Bessel functions as integrals),
9.2.5 (for large arguments).
"""

from functools import cache, partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.own_derivatives import point_by_point
from jaxink.numerics.validity import as_float
from jaxink.optics import propagating_cosine

# Frequencies times the radius of the field. The sum is exact without displacement. Elsewhere it is accurate
# to some thousandths if displacements are spread by a third or more, as those of scattered light are.
N_FREQUENCIES, _HIGHEST, _SPREAD, _RIDGE = 20, 14.0, 0.3, 1e-4
# Displacements, over the radius of the field, at which the share is evaluated.
_WAYS = np.append(0.0, np.geomspace(0.02, 100.0, 48))
# Radius of a disc over a displacement, by which the beam is blurred; the coefficients allow for it. A narrow
# beam would otherwise cross the edge of the field at one displacement and azimuth after the other, in steps.
_BLUR = 0.3
_TURN_RAD = (np.arange(12) + 0.5) * np.pi / 6
# Sides of the polygons in place of beams, as they are and blurred.
_SIDES, _SIDES_IF_BLURRED = 64, 16
# Above this Hankel's asymptotic expansion is used: its terms in cos and in sin, by powers of 1 / x^2.
_LARGE_PHASE = 25.0
_IN_COS = 1.0, -9 / 128, 3675 / 32768
_IN_SIN = 1 / 8, -75 / 1024, 59535 / 262144
_ANGLE_RAD = (np.arange(32) + 0.5) * np.pi / 64


def bessel_j0(x: Float[Array | np.ndarray, "*shape"]) -> Float[Array, "*shape"]:
    """Bessel function J0 to 1e-9."""
    is_small = x < _LARGE_PHASE
    small, large = jnp.where(is_small, x, 0.0), jnp.where(is_small, _LARGE_PHASE, x)
    integral = jnp.mean(jnp.cos(small[..., None] * np.cos(_ANGLE_RAD)), axis=-1)
    phase, square = large - np.pi / 4, 1 / large**2
    in_cos, in_sin = (a[0] + square * (a[1] + square * a[2]) for a in (_IN_COS, _IN_SIN))
    series = (jnp.cos(phase) * in_cos + jnp.sin(phase) * in_sin / large) * jnp.sqrt(2 / (np.pi * large))
    return jnp.where(is_small, integral, series)


@cache
def _sum_of_bessel_functions() -> tuple[np.ndarray, np.ndarray]:
    """Frequencies k_j, and the matrix from shares at `_WAYS` to the coefficients of J0(k_j s)."""
    from scipy.special import j0, j1

    k = _HIGHEST * ((np.arange(N_FREQUENCIES) + 0.5) / N_FREQUENCIES) ** 2
    level, fine = np.log(_WAYS[1:]), np.linspace(np.log(_WAYS[1]), np.log(_WAYS[-1]), 4000)

    def spread(at):
        """Log-normal weights around each of `_WAYS`, at given logarithms; 0 comes first, with most weight."""
        matrix = np.exp(-(((level[:, None] - at) / _SPREAD) ** 2) / 2)
        matrix = np.pad(matrix / np.sum(matrix, axis=1, keepdims=True), ((1, 0), (1, 0)))
        matrix[0, 0] = 1e3
        return matrix

    phase = np.outer(np.append(0.0, np.exp(fine)), k)
    # 2 J1(x) / x is the Fourier transform of a disc; it is 1 at 0.
    blur = np.maximum(_BLUR * phase, 1e-9)
    rows = spread(fine) @ (j0(phase) * 2 * j1(blur) / blur)
    return k, np.linalg.solve(rows.T @ rows + _RIDGE * np.eye(k.size), rows.T @ spread(level))


class LateralField(eqx.Module):
    """Beam and field of view of the detector on the sample.

    Parameters
    ----------
    beam_radius_mm
        Radius of the uniform beam, perpendicular to it.
    detector_radius_mm
        Radius of the disc on the sample that the detector sees, centred on the beam.
    thickness_mm
        Thickness of each layer; 0 if it scatters, as lateral transport within the ink is neglected.
    """

    beam_radius_mm: Float[Array, ""] = eqx.field(converter=as_float)
    detector_radius_mm: Float[Array, ""] = eqx.field(converter=as_float)
    thickness_mm: Float[Array, " layers"] = eqx.field(converter=as_float)

    def displacements(self, cosines: Float[Array, "layers channels"]) -> Float[Array, "layers channels"]:
        """Lateral displacement of one passage through each layer, in mm; 0 in evanescent channels."""
        inside = cosines > 0
        safe = jnp.where(inside, cosines, 1.0)
        sine = jnp.sqrt(jnp.maximum(1 - safe**2, 1e-300))
        return jnp.where(inside, self.thickness_mm[:, None] * sine / safe, 0.0)

    @property
    def frequencies(self) -> Float[Array, " frequencies"]:
        """Frequencies k_j in 1/mm."""
        return jnp.asarray(_sum_of_bessel_functions()[0]) / self.detector_radius_mm

    def at(self, frequency: Float[Array, ""]) -> "LateralWave":
        """Light of one of the frequencies."""
        return LateralWave(self, frequency)

    def seen_directly(self, along, across, cosine_incidence):
        """Share of the beam inside the field of view after a known displacement.

        Parameters
        ----------
        along, across
            Displacement in mm, along and across the plane of incidence, shape ``(*points)``.
        cosine_incidence
            Same shape; it makes the beam an ellipse on the sample.

        Returns
        -------
        Float[Array, "*points"]
        """
        beam = jnp.broadcast_to(self.beam_radius_mm, jnp.shape(along))
        lengths = along, across, beam / cosine_incidence, beam
        return _overlap(*(x / self.detector_radius_mm for x in lengths), _SIDES)

    def coefficients(self, along, across, cosine_incidence):
        """Coefficients of J0(k_j s) in the share seen after a known displacement and one of length s.

        Parameters
        ----------
        along, across, cosine_incidence
            See `seen_directly`, shape ``(points,)``.

        Returns
        -------
        Float[Array, "points frequencies"]
        """
        columns = (x / self.detector_radius_mm for x in (along, across, self.beam_radius_mm))
        scaled = (jnp.broadcast_to(x, along.shape) for x in (*columns, cosine_incidence))
        return point_by_point(_coefficients, *scaled)


class LateralWave(NamedTuple):
    """Multiply scattered light of one lateral frequency in 1/mm.

    The first path in and the last path out, which are known, do not belong to it.
    """

    field: LateralField
    frequency: Float[Array, ""]

    def displacements(self, cosines: Float[Array, "layers channels"]) -> Float[Array, "layers channels"]:
        """See `LateralField.displacements`."""
        return self.field.displacements(cosines)

    def damping(self, way: Array | float) -> Array:
        """Factor of a displacement in mm, averaged over its azimuth."""
        return bessel_j0(self.frequency * way)


def _coefficients(along, across, beam_radius, cosine_incidence):
    """`LateralField.coefficients` for lengths in units of the radius of the field."""
    long = beam_radius / cosine_incidence

    def share(way):
        blur = _BLUR * way
        ways = along[:, None] + way * np.cos(_TURN_RAD), across[:, None] + way * np.sin(_TURN_RAD)
        axes = (jnp.hypot(axis, blur)[:, None] for axis in (long, beam_radius))
        return jnp.mean(_overlap(*ways, *axes, _SIDES_IF_BLURRED), axis=1)

    # Nothing of the beam is seen beyond this; about half of the displacements are.
    reach = (1 + jnp.max(jnp.hypot(along, across) + long)) / (1 - _BLUR)

    def share_within_reach(way):
        return jax.lax.cond(way < reach, share, lambda _: jnp.zeros_like(along), way)

    undisplaced = _overlap(along, across, long, beam_radius, _SIDES)
    displaced = jax.lax.map(share_within_reach, jnp.asarray(_WAYS[1:]))
    return jnp.concatenate([undisplaced[None], displaced]).T @ _sum_of_bessel_functions()[1].T


@partial(jax.custom_jvp, nondiff_argnums=(4,))
def _overlap(along, across, half_length, half_width, n_sides):
    """Share of an ellipse inside the unit disc, with continuous derivatives.

    By Green's theorem, the area of a polygon inside the disc is half the integral of the smaller of 1 and the
    squared distance from the centre of the disc, over the angle at which its sides are seen from there.
    """
    ellipse = along, across, half_length, half_width
    return _share_inside(*ellipse, n_sides, _crossings(*_sides(*ellipse, n_sides)))


@_overlap.defjvp
def _overlap_jvp(n_sides, primals, tangents):
    # The integrand is continuous where a side crosses the disc, so that the derivative does not depend on
    # where that is. The next derivative does.
    crossings = _crossings(*_sides(*primals, n_sides))
    return jax.jvp(lambda *ellipse: _share_inside(*ellipse, n_sides, crossings), primals, tangents)


def _sides(along, across, half_length, half_width, n_sides):
    """Corners of the polygon in place of an ellipse, of the same area, and the sides from there."""
    corner_rad = np.arange(n_sides) * 2 * np.pi / n_sides
    scale = np.sqrt(corner_rad[1] / np.sin(corner_rad[1]))
    corner = (
        along[..., None] + half_length[..., None] * scale * np.cos(corner_rad),
        across[..., None] + half_width[..., None] * scale * np.sin(corner_rad),
    )
    return corner, tuple(jnp.roll(x, -1, axis=-1) - x for x in corner)


def _crossings(corner, side):
    """Shares of each side at which its line enters and leaves the disc, from 0 to 1."""
    length, half = _dot(side, side), _dot(corner, side)
    root = propagating_cosine(half**2 - length * (_dot(corner, corner) - 1))
    return tuple(jnp.clip((sign * root - half) / length, 0.0, 1.0) for sign in (-1, 1))


def _share_inside(along, across, half_length, half_width, n_sides, crossings):
    """`_overlap` by where the sides cross the disc."""
    corner, side = _sides(along, across, half_length, half_width, n_sides)
    enters, leaves, ends = (
        tuple(x + part * d for x, d in zip(corner, side, strict=True)) for part in (*crossings, 1.0)
    )
    # The angles of the parts outside the disc, by a product of complex numbers.
    first, last = ((_dot(p, q), _cross(p, q)) for p, q in ((corner, enters), (leaves, ends)))
    real, imaginary = first[0] * last[0] - first[1] * last[1], first[0] * last[1] + first[1] * last[0]
    is_centre = (real == 0) & (imaginary == 0)
    angle = jnp.arctan2(imaginary, jnp.where(is_centre, 1.0, real))
    return jnp.sum(angle + _cross(enters, leaves), axis=-1) / (2 * np.pi * half_length * half_width)


def _dot(p, q):
    return p[0] * q[0] + p[1] * q[1]


def _cross(p, q):
    return p[0] * q[1] - p[1] * q[0]
