"""Light that comes out beside the field of the detector.

Beam and field are discs on the sample. In the Fourier transform over lateral places displacements multiply:
light that walks sideways by s in a direction of unknown azimuth has the factor J0(k s). A stack whose
passages through clear layers carry that factor therefore sums all round trips, however many. The share of
light seen after a way s is written as a sum of J0(k_j s), and the light seen is then the same sum of stacks.

Approximations: the azimuth is forgotten between two passages, as multiple scattering makes it; the first
way in and the last way out are known and kept. Light spreads in clear layers only, not within the ink.
Regular light that is reflected to and fro in a plate before or after its one scattering keeps its place.

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

# Frequencies times the radius of the field; the sum is exact where nothing walks, and elsewhere meets the
# share within some thousandths once ways are spread by a third or more, as those of scattered light are.
_N_FREQUENCIES, _HIGHEST, _SPREAD, _RIDGE = 20, 14.0, 0.3, 1e-4
# Ways over the radius of the field at which the share is asked.
_WAYS = np.append(0.0, np.geomspace(0.02, 100.0, 120))
# From here on the first two terms of the asymptotic series are used.
_LARGE_PHASE = 25.0
_ANGLE_RAD = (np.arange(32) + 0.5) * np.pi / 64
_TURN_RAD = (np.arange(12) + 0.5) * np.pi / 6
_CHORD_RAD = (np.arange(24) + 0.5) * np.pi / 24


def bessel_j0(x: Float[ArrayLike, "*shape"], xp=jnp) -> Float[ArrayLike, "*shape"]:
    """J0 to 1e-5, by JAX or NumPy."""
    is_small = x < _LARGE_PHASE
    small, large = xp.where(is_small, x, 0.0), xp.where(is_small, _LARGE_PHASE, x)
    integral = xp.mean(xp.cos(small[..., None] * np.cos(_ANGLE_RAD)), axis=-1)
    phase = large - np.pi / 4
    series = (xp.cos(phase) + xp.sin(phase) / (8 * large)) * xp.sqrt(2 / (np.pi * large))
    return xp.where(is_small, integral, series)


@cache
def _sum_of_bessel_functions() -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, and the matrix from shares at `_WAYS` to the coefficients of their J0."""
    k = _HIGHEST * ((np.arange(_N_FREQUENCIES) + 0.5) / _N_FREQUENCIES) ** 2
    level, fine = np.log(_WAYS[1:]), np.linspace(np.log(_WAYS[1]), np.log(_WAYS[-1]), 4000)

    def spread(at):
        """Ways spread around each of `_WAYS`, of given logarithms; no way first, which weighs most."""
        matrix = np.exp(-(((level[:, None] - at) / _SPREAD) ** 2) / 2)
        matrix = np.pad(matrix / np.sum(matrix, axis=1, keepdims=True), ((1, 0), (1, 0)))
        matrix[0, 0] = 1e3
        return matrix

    rows = spread(fine) @ bessel_j0(np.outer(np.append(0.0, np.exp(fine)), k), np)
    return k, np.linalg.solve(rows.T @ rows + _RIDGE * np.eye(k.size), rows.T @ spread(level))


class LateralField(eqx.Module):
    """Where light enters and where it is seen.

    Parameters
    ----------
    beam_radius_mm
        Of the uniform beam, across it.
    detector_radius_mm
        Of the disc on the sample that the detector sees, around the axis of the beam.
    thickness_mm
        Of each layer, 0 where it scatters: the ink's own spreading is not taken into account.
    """

    beam_radius_mm: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    detector_radius_mm: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    thickness_mm: Float[Array, " layers"] = eqx.field(converter=jnp.asarray)

    def displacements(self, cosines: Float[Array, "layers channels"]) -> Float[Array, "layers channels"]:
        """Way sideways of one passage through each layer, in mm; 0 in evanescent channels."""
        inside = cosines > 0
        safe = jnp.where(inside, cosines, 1.0)
        sine = jnp.sqrt(jnp.maximum(1 - safe**2, 1e-300))
        return jnp.where(inside, self.thickness_mm[:, None] * sine / safe, 0.0)

    @property
    def frequencies(self) -> Float[Array, " frequencies"]:
        """Frequencies k_j in 1/mm."""
        return _sum_of_bessel_functions()[0] / self.detector_radius_mm

    def seen_directly(self, along, across, cosine_incidence):
        """Share of the beam that is in the field after a known way.

        Parameters
        ----------
        along, across
            The way in mm, along the plane of incidence and across it, shape ``(*points)``.
        cosine_incidence
            Makes the beam an ellipse on the sample, same shape.

        Returns
        -------
        Float[Array, "*points"]
        """
        # Chords of both at the heights that they share.
        beam, field = self.beam_radius_mm, self.detector_radius_mm
        top, bottom = jnp.minimum(across + beam, field), jnp.maximum(across - beam, -field)
        half_height = jnp.maximum(top - bottom, 0.0)[..., None] / 2
        y = (top + bottom)[..., None] / 2 + half_height * np.cos(_CHORD_RAD)
        half = _half_chord(beam, y - across[..., None]) / cosine_incidence[..., None]
        reach = _half_chord(field, y)
        both = jnp.minimum(along[..., None] + half, reach) - jnp.maximum(along[..., None] - half, -reach)
        area = jnp.mean(jnp.maximum(both, 0.0) * half_height * np.sin(_CHORD_RAD), axis=-1)
        return area * cosine_incidence / beam**2

    def coefficients(self, along, across, cosine_incidence):
        """Coefficients of J0(k_j s): share seen after a known way and one of length s in any direction.

        Parameters
        ----------
        along, across, cosine_incidence
            As of `seen_directly`, shape ``(points,)``.

        Returns
        -------
        Float[Array, "points frequencies"]
        """

        def share(way):
            x, y = (way * self.detector_radius_mm * turn(_TURN_RAD) for turn in (np.cos, np.sin))
            ways = along[:, None] + x, across[:, None] + y
            return jnp.mean(self.seen_directly(*ways, cosine_incidence[:, None]), axis=1)

        return jax.lax.map(share, jnp.asarray(_WAYS)).T @ _sum_of_bessel_functions()[1].T


def _half_chord(radius, height):
    squared = radius**2 - height**2
    return jnp.where(squared > 0, jnp.sqrt(jnp.where(squared > 0, squared, 1.0)), 0.0)
