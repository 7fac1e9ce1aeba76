"""Interference between neighbouring particles: the structure factor of hard spheres."""

from functools import lru_cache
from math import ceil, factorial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.legendre import legendre_series
from jaxink.numerics.validity import require
from jaxink.optics import PhaseFunction

# Below this squared phase the closed forms suffer from cancellation and series are summed instead.
_SMALL = 4.0
_N_TERMS = 16


def percus_yevick(
    squared_phase: Float[ArrayLike, "*points"], volume_fraction: Float[ArrayLike, ""]
) -> Float[Array, "*points"]:
    """Structure factor of equal hard spheres in the Percus-Yevick approximation.

    Parameters
    ----------
    squared_phase
        (q d)^2, with q = 2 k sin(scattering angle / 2), k the wavenumber in the medium and d the diameter
        of the spheres; 0 or more, any shape. Squared, because q is not differentiable in forward direction.
    volume_fraction
        Fraction of the volume occupied by the spheres, 0 to 1, excluding 1.

    Returns
    -------
    Float[Array, "*points"]
        S(q), positive; (1 - f)^4 / (1 + 2 f)^2 in forward direction, 1 for large q and for f = 0.

    References
    ----------
    Percus, Yevick 1958 Phys. Rev. 110, 1; Wertheim 1963 Phys. Rev. Lett. 10, 321 (solution).
    """
    # It may be negative by the rounding of a cosine of 1.
    require("squared_phase", squared_phase, lambda v: v >= -1e-9, "be 0 or more")
    require("volume_fraction", volume_fraction, lambda v: (v >= 0) & (v < 1), "be at least 0 and below 1")
    f = volume_fraction
    # The direct correlation inside a sphere is -(alpha + beta t + gamma t^3), t = distance / d.
    alpha = (1 + 2 * f) ** 2 / (1 - f) ** 4
    beta = -6 * f * (1 + f / 2) ** 2 / (1 - f) ** 4
    gamma = f * alpha / 2
    square, cubic, sextic = _transforms(jnp.asarray(squared_phase, float))
    return 1 / (1 + 24 * f * (alpha * square + beta * cubic + gamma * sextic))


def _transforms(y):
    """Integrals over 0 < t < 1 of t^n sin(x t) / (x t) for n = 2, 3, 5, with y = x^2."""
    small = y < _SMALL
    x = jnp.sqrt(jnp.where(small, _SMALL, y))
    sine, cosine = jnp.sin(x), jnp.cos(x)
    closed = (
        (sine - x * cosine) / x**3,
        (2 * x * sine + (2 - x**2) * cosine - 2) / x**4,
        (-(x**4) * cosine + 4 * ((3 * x**2 - 6) * cosine + (x**3 - 6 * x) * sine + 6)) / x**6,
    )
    y_small = jnp.where(small, y, 0.0)
    return tuple(
        jnp.where(small, jnp.polyval(_series(power), y_small), value)
        for power, value in zip((2, 3, 5), closed, strict=True)
    )


def _series(power: int) -> np.ndarray:
    """Coefficients in y of the integral, highest first."""
    k = np.arange(_N_TERMS - 1, -1, -1)
    factorials = np.array([factorial(2 * i + 1) for i in k], float)
    return (-1.0) ** k / (factorials * (power + 2 * k + 1))


# Nodes over the scattering angle per unit of the size parameter, and their largest number, which resolve the
# peaks of S(q), see docs/manual/particles.md.
_NODES_PER_SIZE_PARAMETER = 16
_MOST_NODES = 1536
_PANEL = 24


def nodes_needed(max_size_parameter: float) -> int:
    """Number of nodes over the scattering angle that resolve the structure factor up to a size parameter."""
    wanted = min(_NODES_PER_SIZE_PARAMETER * max_size_parameter, _MOST_NODES)
    return _PANEL * ceil(wanted / _PANEL)


@lru_cache(maxsize=16)
def _angles(n_nodes: int, n_moments: int):
    """Cosines and weights of a quadrature in panels of the angle, and Legendre polynomials at its nodes."""
    unit, weights = np.polynomial.legendre.leggauss(_PANEL)
    n_panels = n_nodes // _PANEL
    angle = (np.arange(n_panels)[:, None] + (unit + 1) / 2).ravel() * np.pi / n_panels
    weights = np.tile(weights, n_panels) * np.sin(angle) * np.pi / (2 * n_panels)
    cosine = np.cos(angle)
    return cosine, weights, np.polynomial.legendre.legvander(cosine, n_moments - 1)


class InterferingPhaseFunction(PhaseFunction):
    """Sum of phase functions, each multiplied by 1 + s (S - 1); created by `interfering`.

    Parameters
    ----------
    parts
        Legendre moments of each population's phase function, scaled such that the mean of the sum is 1.
    squared_phase_at_right_angle
        (q d)^2 of each population at a scattering angle of 90 degrees.
    volume_fraction
        Volume fraction of all spheres together.
    weight
        s.
    n_nodes
        Number of nodes over the angle.
    """

    parts: Float[Array, "populations moments"]
    squared_phase_at_right_angle: Float[Array, " populations"]
    volume_fraction: Float[Array, ""]
    weight: Float[Array, ""]
    n_nodes: int = eqx.field(static=True)

    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """See `PhaseFunction.value`."""
        cosine = jnp.asarray(scattering_cosine, float)

        def of(part, squared_phase):
            return legendre_series(part, cosine) * self._change(squared_phase, cosine)

        return jnp.sum(jax.vmap(of)(self.parts, self.squared_phase_at_right_angle), axis=0)

    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """See `PhaseFunction.moments`; by quadrature, because the structure factor is not a polynomial."""
        n_degrees = self.parts.shape[1]
        cosine, weights, polynomials = _angles(self.n_nodes, max(n_moments, n_degrees))
        factors = 2 * np.arange(n_degrees) + 1
        alone = (self.parts * factors) @ polynomials[:, :n_degrees].T
        change = jax.vmap(lambda squared: self._change(squared, cosine))(self.squared_phase_at_right_angle)
        return (jnp.sum(alone * change, axis=0) * weights / 2) @ polynomials[:, :n_moments]

    def _change(self, squared_phase, cosine):
        structure = percus_yevick(squared_phase * (1 - cosine), self.volume_fraction)
        return 1 + self.weight * (structure - 1)


def interfering(
    parts: Float[Array, "populations moments"],
    squared_phase_at_right_angle: Float[Array, " populations"],
    volume_fraction: Float[ArrayLike, ""],
    weight: Float[ArrayLike, ""],
    n_nodes: int,
) -> tuple[InterferingPhaseFunction, Float[Array, ""]]:
    """Normalised phase function of dependent scattering, and the scattering over that of independent spheres.

    Parameters
    ----------
    parts
        Legendre moments of each population times its share of the independent scattering.
    squared_phase_at_right_angle, volume_fraction, weight, n_nodes
        As in `InterferingPhaseFunction`.
    """
    raw = InterferingPhaseFunction(
        parts, squared_phase_at_right_angle, jnp.asarray(volume_fraction), jnp.asarray(weight), n_nodes
    )
    share = raw.moments(1)[0]
    return eqx.tree_at(lambda p: p.parts, raw, parts / share), share
