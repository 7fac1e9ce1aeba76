"""Distributions of the radius of spheres, as sums over sizes that a volume fraction is shared among.

Coefficients are linear in the volume of each size, so shares of the volume are the natural weights: of all
spheres of a population that takes the volume fraction f, those of size i scatter as f share_i of equal
spheres would. The mean volume of a particle is then never needed.
"""

from math import ceil, exp, sqrt

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.validity import require

# The sizes reach to this many standard deviations of ln(radius) on either side of the volume's median.
REACH = 5.0
# Wanted step of the size parameter at the volume's median, and the least and the largest number of sizes.
# Measured with an index of 1.8 relative to the binder, whose resonances are the worst: docs/particles.md.
SIZE_PARAMETER_STEP = 0.1
FEWEST_SIZES, MOST_SIZES = 31, 401
# Below this variance an average is the straight line between its values at 0 and here: exact at 0, with the
# slope that a square root would hide there.
_LEAST_VARIANCE = 1e-7


class SizeDistribution(eqx.Module):
    """Spheres of several radii; make it with `monodisperse`, `log_normal` or `discrete`.

    Parameters
    ----------
    radius_nm
        Radius of each size, shape ``(sizes,)``.
    volume_share
        Share of the particles' volume that each size has, sum 1, shape ``(sizes,)``.
    volume_mean_radius_nm
        Radius of the sphere of mean volume.
    is_tail
        Sizes above the median of a distribution without an end: a sphere too large for the Mie series
        may stand aside for the largest that is served, see `mixture_coefficients`.
    """

    radius_nm: Float[Array, " sizes"]
    volume_share: Float[Array, " sizes"]
    volume_mean_radius_nm: Float[Array, ""]
    is_tail: Bool[ArrayLike, " sizes"]


def monodisperse(radius_nm: Float[ArrayLike, ""]) -> SizeDistribution:
    """Spheres of one radius.

    Raises
    ------
    InputRefusedError
        If the radius is known and not above 0.
    """
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
        sigma^2, variance of ln(radius): the squared logarithm of the geometric standard deviation. 0 is
        one radius, exactly; the derivative there is that of the variance, finite and not zero.
    n_sizes
        Sizes that stand for the distribution, odd; see `sizes_needed`.

    Returns
    -------
    SizeDistribution
        The volume of a log-normal distribution is log-normal, too, with the median r0 exp(3 sigma^2).
        Sizes are spaced evenly in ln(radius), which converges faster than as many Gauss-Hermite nodes.

    Raises
    ------
    InputRefusedError
        If an argument is known and outside its range.

    References
    ----------
    Hatch, Choate 1929 J. Franklin Inst. 207, 369 (medians by number and by volume).
    """
    require("median_radius_nm", median_radius_nm, lambda v: v > 0, "be above 0")
    require("variance_ln", variance_ln, lambda v: v >= 0, "be 0 or more")
    if n_sizes < 3 or n_sizes % 2 == 0:
        raise InputRefusedError(f"n_sizes is {n_sizes}, but it must be odd and at least 3.")
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
    """Number of sizes of a log-normal distribution that average the resonances of its spheres.

    Parameters
    ----------
    median_size_parameter
        2 pi r0 / wavelength in the medium, the largest that will be asked for.
    variance_ln
        Largest variance of ln(radius) that will be asked for.

    Returns
    -------
    int
        Odd; a step of `SIZE_PARAMETER_STEP` at the median by volume, within limits.
    """
    at_median = median_size_parameter * exp(3 * variance_ln)
    wanted = 2 * REACH * sqrt(variance_ln) * at_median / SIZE_PARAMETER_STEP
    return 2 * (min(max(ceil(wanted), FEWEST_SIZES), MOST_SIZES) // 2) + 1


def discrete(radii_nm, number_weights) -> SizeDistribution:
    """Spheres of a table of radii.

    Parameters
    ----------
    radii_nm
        The radii, shape ``(sizes,)``.
    number_weights
        Relative number of spheres of each, shape ``(sizes,)``; their sum is of no account.

    Raises
    ------
    InputRefusedError
        If the lists differ in length, a radius is not above 0, a weight is negative, or all are 0.
    """
    radii, weights = jnp.asarray(radii_nm, float), jnp.asarray(number_weights, float)
    if radii.ndim != 1 or radii.shape != weights.shape or radii.size == 0:
        raise InputRefusedError(
            f"the size distribution has radii of shape {radii.shape} and weights of shape {weights.shape}; "
            "give one weight for each radius."
        )
    require("a radius of the size distribution", radii, lambda v: v > 0, "be above 0")
    require("a weight of the size distribution", weights, lambda v: v >= 0, "be 0 or more")
    require(
        "the sum of the weights of the size distribution", jnp.sum(weights), lambda v: v > 0, "be above 0"
    )
    volume = weights * radii**3
    total = jnp.sum(volume)
    return SizeDistribution(
        radii, volume / total, (total / jnp.sum(weights)) ** (1 / 3), np.zeros(radii.shape, bool)
    )
