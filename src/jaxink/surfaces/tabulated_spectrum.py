"""Tabulated power spectra."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.hankel import interpolate_log, log_nodes, radial_fourier
from jaxink.numerics.precision import require_float64
from jaxink.surfaces.spectrum import PowerSpectrum

# Beyond the last node, a table decreases at least with this power, to keep the height variance finite.
_LEAST_FALL = 4.0
# Logarithm of the smallest distance over the scale at which the transform gives the correlation.
_LEAST_LOG_DISTANCE = -5.0
# Logarithmic distance beyond the nodes that is practically infinite for integrals.
_FAR = 30.0


class TabulatedSpectrum(PowerSpectrum):
    """Spectrum with a power law between every two nodes; created by `tabulated_spectrum`.

    Below the first node it is constant. Beyond the last one it continues the last power law, but decreases at
    least as f^-4. This is an assumption, not a measurement; `height_variance_below` gives its contribution.

    Parameters
    ----------
    height_variance_um2
        Height variance of all frequencies, including those beyond the nodes.
    log_frequency, log_shape
        Logarithms of the nodes' frequencies in 1/um and of their PSD, the latter up to a constant.
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
        """Integral of f^(power - 1) times the unnormalised density from 0 to a frequency, piece by piece."""
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
        """Correlation, by transforming the density on a logarithmic grid."""
        scale = self.length_um
        shape = self.shape(jnp.exp(log_nodes()) / (2 * jnp.pi * scale))
        values = radial_fourier(shape) / (2 * jnp.pi * scale) ** 2
        position = jnp.log(jnp.maximum(distance_um, 1e-300) / scale).reshape(-1)
        # The error of the transform grows as the inverse distance, so the smallest ones use a parabola.
        at = interpolate_log(values, jnp.maximum(position, _LEAST_LOG_DISTANCE))
        at = 1 - (1 - at) * jnp.exp(2 * jnp.minimum(position - _LEAST_LOG_DISTANCE, 0.0))
        return jnp.minimum(at, 1.0).reshape(jnp.shape(distance_um))

    def covered_per_um(self) -> tuple[float, float]:
        """First and last node."""
        return float(np.exp(self.log_frequency[0])), float(np.exp(self.log_frequency[-1]))


def tabulated_spectrum(
    frequency_per_um: Float[ArrayLike, " nodes"], density_um4: Float[ArrayLike, " nodes"]
) -> TabulatedSpectrum:
    """Spectrum through at least three measured nodes of ascending frequency, all values above 0."""
    require_float64()
    frequency, density = np.asarray(frequency_per_um, float), np.asarray(density_um4, float)
    if frequency.ndim != 1 or frequency.shape != density.shape or len(frequency) < 3:
        raise InputRefusedError(
            f"frequency_per_um and density_um4 of a tabulated spectrum have shapes {frequency.shape} and "
            f"{density.shape}; they must be equally long lists of at least 3."
        )
    if not (np.all(np.diff(frequency) > 0) and frequency[0] > 0 and np.isfinite(frequency[-1])):
        raise InputRefusedError("frequency_per_um of a tabulated spectrum must be positive and ascending.")
    bad = np.flatnonzero(~((density > 0) & np.isfinite(density)))
    if len(bad):
        raise InputRefusedError(
            f"density_um4 of a tabulated spectrum is {density[bad[0]]:g} at {frequency[bad[0]]:g} per um; "
            "it must be above 0 and finite."
        )
    unit = TabulatedSpectrum(jnp.asarray(1.0), jnp.asarray(np.log(frequency)), jnp.asarray(np.log(density)))
    return eqx.tree_at(lambda s: s.height_variance_um2, unit, unit._norm)
