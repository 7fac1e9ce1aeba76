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
Abramowitz, Stegun 1964 Handbook of Mathematical Functions, 9.1.18 and 9.1.20 (Bessel functions as integrals).
"""

from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.own_derivatives import point_by_point

# Frequencies times the radius of the field. The sum is exact without displacement. Elsewhere it is accurate
# to some thousandths if displacements are spread by a third or more, as those of scattered light are.
_N_FREQUENCIES, _HIGHEST, _SPREAD, _RIDGE = 20, 14.0, 0.3, 1e-4
# Displacements, over the radius of the field, at which the share is evaluated.
_WAYS = np.append(0.0, np.geomspace(0.02, 100.0, 120))
# Above this the first two terms of the asymptotic series are used.
_LARGE_PHASE = 25.0
_ANGLE_RAD = (np.arange(32) + 0.5) * np.pi / 64
_TURN_RAD = (np.arange(12) + 0.5) * np.pi / 6
_CHORD_RAD = (np.arange(24) + 0.5) * np.pi / 24


def bessel_j0(x: Float[ArrayLike, "*shape"], xp=jnp) -> Float[ArrayLike, "*shape"]:
    """Bessel function J0 to 1e-5, by JAX or NumPy."""
    is_small = x < _LARGE_PHASE
    small, large = xp.where(is_small, x, 0.0), xp.where(is_small, _LARGE_PHASE, x)
    integral = xp.mean(xp.cos(small[..., None] * np.cos(_ANGLE_RAD)), axis=-1)
    phase = large - np.pi / 4
    series = (xp.cos(phase) + xp.sin(phase) / (8 * large)) * xp.sqrt(2 / (np.pi * large))
    return xp.where(is_small, integral, series)


@cache
def _sum_of_bessel_functions() -> tuple[np.ndarray, np.ndarray]:
    """Frequencies k_j, and the matrix from shares at `_WAYS` to the coefficients of J0(k_j s)."""
    k = _HIGHEST * ((np.arange(_N_FREQUENCIES) + 0.5) / _N_FREQUENCIES) ** 2
    level, fine = np.log(_WAYS[1:]), np.linspace(np.log(_WAYS[1]), np.log(_WAYS[-1]), 4000)

    def spread(at):
        """Log-normal weights around each of `_WAYS`, at given logarithms; 0 comes first, with most weight."""
        matrix = np.exp(-(((level[:, None] - at) / _SPREAD) ** 2) / 2)
        matrix = np.pad(matrix / np.sum(matrix, axis=1, keepdims=True), ((1, 0), (1, 0)))
        matrix[0, 0] = 1e3
        return matrix

    rows = spread(fine) @ bessel_j0(np.outer(np.append(0.0, np.exp(fine)), k), np)
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

    beam_radius_mm: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    detector_radius_mm: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    thickness_mm: Float[Array, " layers"] = eqx.field(converter=jnp.asarray)

    def displacements(self, cosines: Float[Array, "layers channels"]) -> Float[Array, "layers channels"]:
        """Lateral displacement of one passage through each layer, in mm; 0 in evanescent channels."""
        inside = cosines > 0
        safe = jnp.where(inside, cosines, 1.0)
        sine = jnp.sqrt(jnp.maximum(1 - safe**2, 1e-300))
        return jnp.where(inside, self.thickness_mm[:, None] * sine / safe, 0.0)

    @property
    def frequencies(self) -> Float[Array, " frequencies"]:
        """Frequencies k_j in 1/mm."""
        return _sum_of_bessel_functions()[0] / self.detector_radius_mm

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
        return _overlap(along, across, cosine_incidence, self.beam_radius_mm, self.detector_radius_mm)

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


def _coefficients(along, across, beam_radius, cosine_incidence):
    """`LateralField.coefficients` for lengths in units of the radius of the field."""

    def share(way):
        ways = along[:, None] + way * np.cos(_TURN_RAD), across[:, None] + way * np.sin(_TURN_RAD)
        return jnp.mean(_overlap(*ways, cosine_incidence[:, None], beam_radius[:, None], 1.0), axis=1)

    # Nothing of the beam is seen beyond this; about half of the displacements are.
    reach = 1 + jnp.max(jnp.hypot(along, across) + beam_radius / cosine_incidence)

    def share_within_reach(way):
        return jax.lax.cond(way < reach, share, lambda _: jnp.zeros_like(along), way)

    return jax.lax.map(share_within_reach, jnp.asarray(_WAYS)).T @ _sum_of_bessel_functions()[1].T


def _overlap(along, across, cosine_incidence, beam, field):
    """Share of a beam inside a field of view; see `LateralField.seen_directly`."""
    # Chords of both at common heights.
    top, bottom = jnp.minimum(across + beam, field), jnp.maximum(across - beam, -field)
    half_height = jnp.maximum(top - bottom, 0.0)[..., None] / 2
    y = (top + bottom)[..., None] / 2 + half_height * np.cos(_CHORD_RAD)
    half = _half_chord(beam[..., None], y - across[..., None]) / cosine_incidence[..., None]
    reach = _half_chord(field, y)
    both = jnp.minimum(along[..., None] + half, reach) - jnp.maximum(along[..., None] - half, -reach)
    area = jnp.mean(jnp.maximum(both, 0.0) * half_height * np.sin(_CHORD_RAD), axis=-1)
    return area * cosine_incidence / beam**2


def _half_chord(radius, height):
    squared = radius**2 - height**2
    return jnp.where(squared > 0, jnp.sqrt(jnp.where(squared > 0, squared, 1.0)), 0.0)
