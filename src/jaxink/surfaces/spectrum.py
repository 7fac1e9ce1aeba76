"""Power spectra of isotropic surface heights.

A power spectral density PSD(f) is per unit area of the plane of spatial frequencies (f_x, f_y), in um^4. Its
integral over the whole plane, 2 pi f PSD df, is the height variance. Slope variances are along one axis.
"""

import abc
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

# Trapezoidal nodes in log t for a K-correlation as a mixture of Gaussians; they converge exponentially.
_MIXTURE = np.linspace(-45.0, 4.5, 199)


class PowerSpectrum(eqx.Module):
    """Isotropic power spectral density of a height.

    Attributes
    ----------
    strength
        Field in which scattered light is linear near the smooth surface.
    """

    height_variance_um2: eqx.AbstractVar[Float[Array, ""]]
    strength: ClassVar[str] = "height_variance_um2"

    @property
    @abc.abstractmethod
    def length_um(self) -> Float[Array, ""]:
        """Correlation length, the scale of the logarithmic grids."""

    @abc.abstractmethod
    def correlation(self, distance_um: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """Correlation of two heights: autocovariance over the height variance, 1 at distance 0."""

    @abc.abstractmethod
    def shape(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """PSD over the height variance, um^2."""

    @abc.abstractmethod
    def slope_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Slope variance along one axis of the components below a spatial frequency."""

    @abc.abstractmethod
    def height_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Height variance of the components below a spatial frequency, um^2."""

    @abc.abstractmethod
    def covered_per_um(self) -> tuple[float, float]:
        """Lowest and highest spatial frequency at which the spectrum is known, 1/um."""

    def density_um4(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """PSD, um^4, at spatial frequencies of 0 or more."""
        return self.height_variance_um2 * self.shape(frequency_per_um)


class GaussianSpectrum(PowerSpectrum):
    """Gaussian correlation exp(-(r/L)^2): PSD = sigma^2 pi L^2 exp(-(pi L f)^2).

    Parameters
    ----------
    height_variance_um2
        sigma^2.
    correlation_length_um
        L; the slope variance is 2 sigma^2 / L^2.
    """

    height_variance_um2: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    correlation_length_um: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    @property
    def length_um(self) -> Float[Array, ""]:
        """L."""
        return self.correlation_length_um

    def correlation(self, distance_um: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """exp(-(r/L)^2)."""
        return jnp.exp(-((distance_um / self.correlation_length_um) ** 2))

    def shape(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """PSD over the height variance, um^2."""
        length = self.correlation_length_um
        return jnp.pi * length**2 * jnp.exp(-((jnp.pi * length * frequency_per_um) ** 2))

    def height_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Height variance below a frequency, um^2."""
        x = (jnp.pi * self.correlation_length_um * frequency_per_um) ** 2
        return -self.height_variance_um2 * jnp.expm1(-x)

    def slope_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Slope variance below a frequency."""
        x = (jnp.pi * self.correlation_length_um * frequency_per_um) ** 2
        return self.slope_variance * (-jnp.expm1(-x) - jnp.where(x < jnp.inf, x * jnp.exp(-x), 0.0))

    @property
    def slope_variance(self) -> Float[Array, ""]:
        """Slope variance of all frequencies."""
        return 2 * self.height_variance_um2 / self.correlation_length_um**2

    def covered_per_um(self) -> tuple[float, float]:
        """All frequencies."""
        return 0.0, float("inf")


class KCorrelation(PowerSpectrum):
    """K-correlation or ABC spectrum: A / (1 + (B f)^2)^(C/2), A = sigma^2 B^2 (C - 2) / (2 pi).

    Parameters
    ----------
    height_variance_um2
        sigma^2.
    length_b_um
        B: the spectrum bends at the frequency 1/B.
    exponent
        C, above 2, so that the height variance is finite. Up to C = 4, the slope variance is infinite unless
        frequencies are limited, see `slope_variance_below`.

    References
    ----------
    Church, Takacs, Leonard 1989 Proc. SPIE 1165, 136; Stover 2012 Optical Scattering, 3rd ed.
    """

    height_variance_um2: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    length_b_um: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    exponent: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    @property
    def length_um(self) -> Float[Array, ""]:
        """Distance B / (2 pi) over which the correlation decays."""
        return self.length_b_um / (2 * jnp.pi)

    @property
    def amplitude_um4(self) -> Float[Array, ""]:
        """A, the density at frequency 0."""
        return self.height_variance_um2 * self.length_b_um**2 * (self.exponent - 2) / (2 * jnp.pi)

    @classmethod
    def of_amplitude(cls, amplitude_um4, length_b_um, exponent) -> "KCorrelation":
        """Spectrum with given A, B and C, C above 2."""
        variance = 2 * jnp.pi * jnp.asarray(amplitude_um4) / (length_b_um**2 * (exponent - 2))
        return cls(variance, length_b_um, exponent)

    def correlation(self, distance_um: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """z^nu K_nu(z) 2^(1-nu) / Gamma(nu), z = 2 pi r / B, nu = C/2 - 1, as a mixture of Gaussians."""
        nu = self.exponent / 2 - 1
        quarter = (distance_um / self.length_um)[..., None] ** 2 / 4
        exponent = nu * _MIXTURE - np.exp(_MIXTURE) - quarter * np.exp(-_MIXTURE)
        mixed = jnp.sum(jnp.exp(exponent), axis=-1) * (_MIXTURE[1] - _MIXTURE[0])
        # The narrowest Gaussians of the mixture only matter at distance 0.
        return jnp.where(distance_um > 0, mixed * jnp.exp(-jax.scipy.special.gammaln(nu)), 1.0)

    def shape(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """PSD over the height variance, um^2."""
        whole = self.length_b_um**2 * (self.exponent - 2) / (2 * jnp.pi)
        return whole * (1 + (self.length_b_um * frequency_per_um) ** 2) ** (-self.exponent / 2)

    def height_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Height variance below a frequency, um^2."""
        logarithm = jnp.log1p((self.length_b_um * frequency_per_um) ** 2)
        return -self.height_variance_um2 * jnp.expm1((1 - self.exponent / 2) * logarithm)

    def slope_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Slope variance below a frequency, finite for any exponent."""
        logarithm = jnp.log1p((self.length_b_um * frequency_per_um) ** 2)

        def power_integral(power):
            # (u^power - 1) / power, with the logarithm as the limit for power 0.
            x = power * logarithm
            small = jnp.abs(x) < 1e-6
            return logarithm * jnp.where(small, 1 + x / 2, jnp.expm1(x) / jnp.where(small, 1.0, x))

        bracket = power_integral(2 - self.exponent / 2) - power_integral(1 - self.exponent / 2)
        return 2 * jnp.pi**3 * self.amplitude_um4 / self.length_b_um**4 * bracket

    @property
    def slope_variance(self) -> Float[Array, ""]:
        """Slope variance of all frequencies, 4 pi^2 sigma^2 / (B^2 (C - 4)); infinite for C up to 4."""
        excess = self.exponent - 4
        finite = 4 * jnp.pi**2 * self.height_variance_um2 / self.length_b_um**2
        return jnp.where(excess > 0, finite / jnp.where(excess > 0, excess, 1.0), jnp.inf)

    def covered_per_um(self) -> tuple[float, float]:
        """All frequencies."""
        return 0.0, float("inf")
