"""Power spectra of isotropic surface heights.

A power spectral density PSD(f) is per unit area of the plane of spatial frequencies (f_x, f_y), in um^4: its
integral over the whole plane, 2 pi f PSD df, is the height variance. The slope variance is that of the slope
along one axis.
"""

import abc
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.hankel import interpolate_log, log_nodes, radial_fourier
from jaxink.numerics.precision import require_float64

# Trapezoidal nodes in log t of the mixture of Gaussians that a K-correlation is: converge exponentially.
_MIXTURE = np.linspace(-45.0, 4.5, 199)
# Beyond its last node a table falls off at least as fast as this power: the height variance stays finite.
_LEAST_FALL = 4.0
# Logarithm of the least distance, over the scale, at which a transform gives a correlation.
_LEAST_LOG_DISTANCE = -5.0
# Far enough beyond the nodes, as a logarithm, for an integral to the end.
_FAR = 30.0


class PowerSpectrum(eqx.Module):
    """Isotropic power spectral density of a height.

    Attributes
    ----------
    strength
        Field in which scattered light is linear where the surface becomes smooth.
    """

    height_variance_um2: eqx.AbstractVar[Float[Array, ""]]
    strength: ClassVar[str] = "height_variance_um2"

    @property
    @abc.abstractmethod
    def length_um(self) -> Float[Array, ""]:
        """Length over which heights are correlated, the scale of the logarithmic grids."""

    @abc.abstractmethod
    def correlation(self, distance_um: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """Correlation of two heights: autocovariance over the height variance, 1 at distance 0."""

    @abc.abstractmethod
    def shape(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """PSD over the height variance, um^2."""

    @abc.abstractmethod
    def slope_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Slope variance along one axis of what varies more slowly than a spatial frequency."""

    @abc.abstractmethod
    def height_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Height variance of what varies more slowly than a spatial frequency, um^2."""

    @abc.abstractmethod
    def covered_per_um(self) -> tuple[float, float]:
        """Lowest and highest spatial frequency at which the spectrum is known, 1/um."""

    def density_um4(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """PSD at spatial frequencies.

        Parameters
        ----------
        frequency_per_um
            0 or more.

        Returns
        -------
        Float[Array, "*shape"]
            um^4.
        """
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
        whole = 2 * self.height_variance_um2 / self.correlation_length_um**2
        return whole * (-jnp.expm1(-x) - jnp.where(x < jnp.inf, x * jnp.exp(-x), 0.0))

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
        C, above 2, for the height variance to be finite. The slope variance is finite above 4; between, it
        grows with the highest frequency that counts, see `slope_variance_below`.

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
        """Spectrum by its A, B and C.

        Parameters
        ----------
        amplitude_um4, length_b_um, exponent
            A, B and C, C above 2.
        """
        variance = 2 * jnp.pi * jnp.asarray(amplitude_um4) / (length_b_um**2 * (exponent - 2))
        return cls(variance, length_b_um, exponent)

    def correlation(self, distance_um: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """z^nu K_nu(z) 2^(1-nu) / Gamma(nu), z = 2 pi r / B, nu = C/2 - 1, as a mixture of Gaussians."""
        nu = self.exponent / 2 - 1
        quarter = (distance_um / self.length_um)[..., None] ** 2 / 4
        exponent = nu * _MIXTURE - np.exp(_MIXTURE) - quarter * np.exp(-_MIXTURE)
        mixed = jnp.sum(jnp.exp(exponent), axis=-1) * (_MIXTURE[1] - _MIXTURE[0])
        # The mixture ends at Gaussians too narrow for any distance but 0.
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
            # (u^power - 1) / power, of which the limit at power 0 is the logarithm.
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


class TabulatedSpectrum(PowerSpectrum):
    """Spectrum through nodes, a power law between any two; `tabulated_spectrum` makes it.

    Below the first node it is constant. Beyond the last one it goes on as the power law of the last two, but
    falls at least as f^-4: an assumption, not a measurement, whose share `height_variance_below` tells.

    Parameters
    ----------
    height_variance_um2
        Of all frequencies, those beyond the nodes included.
    log_frequency, log_shape
        Logarithms of the nodes' frequencies in 1/um and of the PSD there, up to a constant.
    """

    height_variance_um2: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    log_frequency: Float[Array, " nodes"] = eqx.field(converter=jnp.asarray)
    log_shape: Float[Array, " nodes"] = eqx.field(converter=jnp.asarray)

    @property
    def length_um(self) -> Float[Array, ""]:
        """Inverse of 2 pi times the geometric mean of the nodes' frequencies."""
        return jnp.exp(-jnp.mean(self.log_frequency)) / (2 * jnp.pi)

    @property
    def _last_power(self):
        last = (self.log_shape[-1] - self.log_shape[-2]) / (self.log_frequency[-1] - self.log_frequency[-2])
        return jnp.minimum(last, -_LEAST_FALL)

    def _unnormalised(self, log_frequency):
        between = jnp.interp(log_frequency, self.log_frequency, self.log_shape)
        beyond = jnp.maximum(log_frequency - self.log_frequency[-1], 0.0)
        return jnp.exp(between + self._last_power * beyond)

    def _integral(self, power, frequency_per_um):
        """Integral of f^(power - 1) times the unnormalised density from 0 to a frequency, law by law."""
        end = jnp.log(jnp.maximum(frequency_per_um, 1e-300))[..., None]
        x, y = self.log_frequency, self.log_shape
        starts = jnp.concatenate([x[:1] - _FAR, x])
        stops = jnp.concatenate([x, x[-1:] + _FAR])
        slope = jnp.concatenate([jnp.zeros(1), jnp.diff(y) / jnp.diff(x), self._last_power[None]]) + power
        level = jnp.concatenate([y[:1], y]) + power * starts
        width = jnp.clip(end, starts, stops) - starts
        grown = slope * width
        flat = jnp.abs(grown) < 1e-8
        mean = jnp.where(flat, 1.0, jnp.expm1(grown) / jnp.where(flat, 1.0, grown))
        return jnp.sum(jnp.exp(level) * width * mean, axis=-1)

    @property
    def _norm(self):
        return 2 * jnp.pi * self._integral(2.0, jnp.asarray(jnp.inf))

    def shape(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """PSD over the height variance, um^2."""
        return self._unnormalised(jnp.log(jnp.maximum(frequency_per_um, 1e-300))) / self._norm

    def height_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Height variance below a frequency, um^2."""
        share = 2 * jnp.pi * self._integral(2.0, jnp.asarray(frequency_per_um)) / self._norm
        return self.height_variance_um2 * share

    def slope_variance_below(self, frequency_per_um: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """Slope variance below a frequency."""
        moment = 4 * jnp.pi**3 * self._integral(4.0, jnp.asarray(frequency_per_um)) / self._norm
        return self.height_variance_um2 * moment

    def correlation(self, distance_um: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """Correlation, from the transform of the density on a logarithmic grid."""
        scale = self.length_um
        shape = self.shape(jnp.exp(log_nodes()) / (2 * jnp.pi * scale))
        values = radial_fourier(shape) / (2 * jnp.pi * scale) ** 2
        position = jnp.log(jnp.maximum(distance_um, 1e-300) / scale).reshape(-1)
        # The transform's error goes as the inverse distance: the smallest ones are met by a parabola.
        at = interpolate_log(values, jnp.maximum(position, _LEAST_LOG_DISTANCE))
        at = 1 - (1 - at) * jnp.exp(2 * jnp.minimum(position - _LEAST_LOG_DISTANCE, 0.0))
        return jnp.minimum(at, 1.0).reshape(jnp.shape(distance_um))

    def covered_per_um(self) -> tuple[float, float]:
        """First and last node."""
        return float(np.exp(self.log_frequency[0])), float(np.exp(self.log_frequency[-1]))


def tabulated_spectrum(
    frequency_per_um: Float[ArrayLike, " nodes"], density_um4: Float[ArrayLike, " nodes"]
) -> TabulatedSpectrum:
    """Spectrum through measured nodes.

    Parameters
    ----------
    frequency_per_um
        Ascending, above 0, shape ``(nodes,)``.
    density_um4
        PSD there, above 0.

    Returns
    -------
    TabulatedSpectrum
        Its density meets the nodes.

    Raises
    ------
    InputRefusedError
        If there are fewer than three nodes, or frequencies do not ascend, or a value is not above 0.
    """
    require_float64()
    frequency, density = np.asarray(frequency_per_um, float), np.asarray(density_um4, float)
    if frequency.ndim != 1 or frequency.shape != density.shape or len(frequency) < 3:
        raise InputRefusedError(
            f"a tabulated spectrum needs as many frequencies as densities, at least 3; it has shapes "
            f"{frequency.shape} and {density.shape}."
        )
    if not (np.all(np.diff(frequency) > 0) and frequency[0] > 0 and np.isfinite(frequency[-1])):
        raise InputRefusedError("frequency_per_um of a tabulated spectrum must ascend from above 0.")
    bad = np.flatnonzero(~((density > 0) & np.isfinite(density)))
    if len(bad):
        raise InputRefusedError(
            f"density_um4 of a tabulated spectrum is {density[bad[0]]:g} at {frequency[bad[0]]:g} per um; "
            "it must be above 0 and finite."
        )
    unit = TabulatedSpectrum(1.0, np.log(frequency), np.log(density))
    return eqx.tree_at(lambda s: s.height_variance_um2, unit, unit._norm)
