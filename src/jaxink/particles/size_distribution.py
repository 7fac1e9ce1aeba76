"""Distributions of the radius of spheres, as sums over sizes with shares of the volume.

Coefficients are linear in the volume of each size, so shares of the volume are the natural weights: in a
population with volume fraction f, spheres of size i scatter like equal spheres with f share_i. The mean
volume of a particle is not needed.
"""

from math import ceil, exp, sqrt

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.validity import require

# Range of sizes in standard deviations of ln(radius) on either side of the median by volume.
REACH = 5.0
# Step of the size parameter at the median by volume, and limits of the number of sizes. Determined for an
# index of 1.8 relative to the binder, the worst case of resonances: docs/manual/particles.md.
SIZE_PARAMETER_STEP = 0.1
FEWEST_SIZES, MOST_SIZES = 31, 401
# Below this variance averages are interpolated linearly from 0: exact at 0, with a finite slope, which a
# square root would not have there.
_LEAST_VARIANCE = 1e-7


class SizeDistribution(eqx.Module):
    """Spheres of several radii; created by `monodisperse`, `log_normal` or `discrete`.

    Parameters
    ----------
    radius_nm
        Radius of each size, shape ``(sizes,)``.
    volume_share
        Share of each size in the particles' volume, sum 1, shape ``(sizes,)``.
    volume_mean_radius_nm
        Radius of the sphere of mean volume.
    is_tail
        Sizes above the median of an unbounded distribution: those too large for the Mie series may be
        replaced by the largest one, see `mixture_coefficients`.
    """

    radius_nm: Float[Array, " sizes"]
    volume_share: Float[Array, " sizes"]
    volume_mean_radius_nm: Float[Array, ""]
    is_tail: Bool[ArrayLike, " sizes"]


def monodisperse(radius_nm: Float[ArrayLike, ""]) -> SizeDistribution:
    """Spheres of one radius, above 0."""
    require("radius_nm", radius_nm, lambda v: v > 0, "be above 0")
    radius = jnp.asarray(radius_nm, float)
    return SizeDistribution(radius[None], jnp.ones(1), radius, np.zeros(1, bool))


def log_normal(
    median_radius_nm: Float[ArrayLike, ""],
    variance_ln: Float[ArrayLike, ""],
    n_sizes: int = FEWEST_SIZES,
) -> SizeDistribution:
    """Log-normal distribution, n(r) ~ exp(-ln^2(r / r0) / (2 sigma^2)) / r by number.

    Parameters
    ----------
    median_radius_nm
        r0, median by number.
    variance_ln
        sigma^2, variance of ln(radius): the squared logarithm of the geometric standard deviation. 0 gives
        exactly one radius; the derivative with respect to the variance is finite and nonzero there.
    n_sizes
        Number of sizes, odd; see `sizes_needed`.

    Returns
    -------
    SizeDistribution
        By volume, the distribution is log-normal as well, with the median r0 exp(3 sigma^2). Sizes are
        equally spaced in ln(radius), which converges faster than the same number of Gauss-Hermite nodes.

    References
    ----------
    Hatch, Choate 1929 J. Franklin Inst. 207, 369 (medians by number and by volume).
    """
    require("median_radius_nm", median_radius_nm, lambda v: v > 0, "be above 0")
    require("variance_ln", variance_ln, lambda v: v >= 0, "be 0 or more")
    if n_sizes < 3 or n_sizes % 2 == 0:
        raise InputRefusedError(f"n_sizes is {n_sizes}; it must be odd and at least 3.")
    deviations = np.linspace(-REACH, REACH, n_sizes)
    spread = np.exp(-(deviations**2) / 2)
    spread /= spread.sum()
    one = (np.arange(n_sizes) == n_sizes // 2).astype(float)
    variance, median = jnp.asarray(variance_ln, float), jnp.asarray(median_radius_nm, float)
    blend = jnp.minimum(variance / _LEAST_VARIANCE, 1.0)
    sigma = jnp.sqrt(jnp.maximum(variance, _LEAST_VARIANCE))
    return SizeDistribution(
        radius_nm=median * jnp.exp(3 * variance + sigma * deviations),
        volume_share=one + blend * (spread - one),
        volume_mean_radius_nm=median * jnp.exp(1.5 * variance),
        is_tail=deviations > 0,
    )


def sizes_needed(median_size_parameter: float, variance_ln: float) -> int:
    """Number of sizes, odd, of a log-normal distribution that averages the resonances of its spheres.

    Parameters
    ----------
    median_size_parameter
        Largest 2 pi r0 / wavelength in the medium that will be used.
    variance_ln
        Largest variance of ln(radius) that will be used.
    """
    at_median = median_size_parameter * exp(3 * variance_ln)
    wanted = 2 * REACH * sqrt(variance_ln) * at_median / SIZE_PARAMETER_STEP
    return 2 * (min(max(ceil(wanted), FEWEST_SIZES), MOST_SIZES) // 2) + 1


def discrete(radii_nm, number_weights) -> SizeDistribution:
    """Spheres with tabulated radii and relative numbers of any sum, each of shape ``(sizes,)``."""
    radii, weights = jnp.asarray(radii_nm, float), jnp.asarray(number_weights, float)
    if radii.ndim != 1 or radii.shape != weights.shape or radii.size == 0:
        raise InputRefusedError(
            f"the size distribution has radii of shape {radii.shape} and weights of shape {weights.shape}; "
            "give one weight for each radius."
        )
    require("a radius of the size distribution", radii, lambda v: v > 0, "be above 0")
    require("a weight of the size distribution", weights, lambda v: v >= 0, "be 0 or more")
    number = jnp.sum(weights)
    require("the sum of the weights of the size distribution", number, lambda v: v > 0, "be above 0")
    volume = weights * radii**3
    total = jnp.sum(volume)
    return SizeDistribution(radii, volume / total, (total / number) ** (1 / 3), np.zeros(radii.shape, bool))
