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

from jaxink.errors import InputRefusedError
from jaxink.numerics.hankel import N_NODES, STEP, cubic_weights, interpolate_log, log_nodes, radial_fourier
from jaxink.numerics.precision import require_float64
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.numerics.validity import as_float

# Trapezoidal nodes in log t for a K-correlation as a mixture of Gaussians; they converge exponentially.
_MIXTURE = np.linspace(-45.0, 4.5, 199)
# Pairs of polar angles that are transformed at once; limits the memory.
_BATCH = 512
# Number of phases that are transformed, between the largest and this fraction of it; light whose phase hardly
# depends on the height is hardly scattered.
_N_PHASES, _LEAST_PHASE = 64, 0.005
# Rounding error relative to the largest value of a transform.
_FLOOR = 1e-10
# Beyond the last node, a table decreases at least with this power, to keep the height variance finite.
_LEAST_FALL = 4.0
# Logarithm of the smallest distance over the scale at which the transform gives the correlation.
_LEAST_LOG_DISTANCE = -5.0
# Logarithmic distance beyond the nodes that is practically infinite for integrals.
_FAR = 30.0


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

    height_variance_um2: Float[Array, ""] = eqx.field(converter=as_float)
    correlation_length_um: Float[Array, ""] = eqx.field(converter=as_float)

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

    height_variance_um2: Float[Array, ""] = eqx.field(converter=as_float)
    length_b_um: Float[Array, ""] = eqx.field(converter=as_float)
    exponent: Float[Array, ""] = eqx.field(converter=as_float)

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


def isotropic_from_profile(
    frequency_per_um: Float[np.ndarray, " nodes"], profile_density_um3: Float[np.ndarray, " nodes"]
) -> tuple[Float[np.ndarray, " inner"], Float[np.ndarray, " inner"]]:
    """Power spectral density in the plane of frequencies from that of a profile of an isotropic surface.

    PSD(f) = -1/pi times the integral of PSD_1'(t) / sqrt(t^2 - f^2) over t > f, with PSD_1 a power law
    between its nodes and beyond the last.

    Parameters
    ----------
    frequency_per_um
        Ascending, above 0.
    profile_density_um3
        Two-sided density of the profile: its integral over positive and negative frequencies is the height
        variance.

    Returns
    -------
    frequency_per_um, density_um4
        Without the last node and nodes at which noise makes the density negative.

    References
    ----------
    Church, Takacs, Leonard 1989 Proc. SPIE 1165, 136 (the relation of both densities).
    """
    frequency, profile = np.asarray(frequency_per_um, float), np.asarray(profile_density_um3, float)
    if len(frequency) < 4 or np.any(np.diff(frequency) <= 0) or np.any(profile <= 0):
        raise InputRefusedError(
            "the spectrum of a profile must have at least 4 ascending frequencies with densities above 0."
        )
    x, y = np.log(frequency), np.log(profile)
    fall = np.diff(y) / np.diff(x)
    unit, weight = gauss_legendre_unit(12)
    # The power law of the whole last octave, because the last two nodes alone are noisy.
    last = np.arange(len(x)) >= len(x) - 2
    last |= x > x[-1] - np.log(2)
    tail = min(np.polyfit(x[last], y[last], 1)[0], -1.5)
    starts, stops = np.append(x[:-1], x[-1]), np.append(x[1:], x[-1] + 12.0)
    powers, levels = np.append(fall, tail), np.append(y[:-1], y[-1])
    found = []
    for k, here in enumerate(frequency[:-1]):
        # t = f cosh(w): dt / sqrt(t^2 - f^2) = dw.
        begin, end = (np.arccosh(np.exp(np.maximum(edge[k:] - x[k], 0.0))) for edge in (starts, stops))
        w = begin[:, None] + (end - begin)[:, None] * unit
        logarithm = np.log(here * np.cosh(w))
        slope = powers[k:, None] * np.exp(
            levels[k:, None] + powers[k:, None] * (logarithm - starts[k:, None]) - logarithm
        )
        found.append(-np.sum((end - begin)[:, None] * weight * slope) / np.pi)
    density = np.array(found)
    positive = density > 0
    return frequency[:-1][positive], density[positive]


def broadened(spectrum: PowerSpectrum, phase_variance, log_position):
    """Transform of sigma^2 (exp(-g (1 - rho)) - exp(-g)) / g at phase variances g; the PSD for g = 0.

    The last axis of ``log_position`` holds the frequencies of each phase variance.
    """
    length = spectrum.length_um
    rho = spectrum.correlation(jnp.exp(log_nodes()) * length)

    def of(pair):
        g, position = pair
        x = g * rho
        small = jnp.abs(x) < 1e-5
        safe = jnp.where(small, 1.0, x)
        # exp(g (rho - 1)) - exp(-g) without cancellation for small g and overflow for large g.
        large = (jnp.exp(g * (rho - 1)) - jnp.exp(-g)) / safe
        values = rho * jnp.where(x > 1, large, jnp.exp(-g) * jnp.where(small, 1 + x / 2, jnp.expm1(x) / safe))
        return jnp.maximum(interpolate_log(radial_fourier(values), position), 0.0)

    transform = jax.lax.map(of, (phase_variance, log_position), batch_size=_BATCH)
    return spectrum.height_variance_um2 * length**2 * transform


class BroadenedSpectrum(eqx.Module):
    """Spectra of exp(i A z) over A^2, tabulated over phases per height A and frequencies.

    Parameters
    ----------
    log_phase
        First node and step of the logarithm of A.
    log_density
        Logarithm of the density, at the frequencies exp(`log_nodes`) / (2 pi) in 1/um whatever the length of
        the spectrum: where it is read does not then depend on the spectrum, only what is read.
    """

    log_phase: tuple[Float[Array, ""], Float[Array, ""]]
    log_density: Float[Array, "phases frequencies"]

    @classmethod
    def of(cls, spectrum: PowerSpectrum, largest_phase_per_um: Float[ArrayLike, ""]) -> "BroadenedSpectrum":
        """Tabulate a spectrum up to a phase per height."""
        last = jnp.log(largest_phase_per_um)
        step = -np.log(_LEAST_PHASE) / (_N_PHASES - 1)
        first = last - step * (_N_PHASES - 1)
        phase = jnp.exp(first + step * np.arange(_N_PHASES))
        positions = jnp.broadcast_to(log_nodes(), (_N_PHASES, N_NODES))
        density = broadened(spectrum, phase**2 * spectrum.height_variance_um2, positions)
        # A maximum has no derivative if the compiler evaluates it twice with different rounding.
        floor = jax.lax.stop_gradient(_FLOOR * jnp.max(density, axis=1, keepdims=True) + 1e-300)
        # From frequencies in units of the spectrum's own length; the shift is the same at all nodes.
        column = jnp.arange(N_NODES) + jnp.log(spectrum.length_um) / STEP
        columns, weights = _cubic(column, N_NODES)
        log_density = jnp.log(jnp.maximum(density, floor))
        shifted = sum(weight * log_density[:, columns + k] for k, weight in enumerate(weights))
        return cls((first, jnp.asarray(step)), shifted)

    def density_um4(
        self, phase_per_um: Float[ArrayLike, "*#shape"], frequency_per_um: Float[ArrayLike, "*#shape"]
    ) -> Float[Array, "*shape"]:
        """Broadened PSD, by cubic interpolation in both logarithms."""
        first, step = self.log_phase
        row = (jnp.log(jnp.maximum(phase_per_um, 1e-300)) - first) / step
        column = jnp.log(2 * jnp.pi * jnp.maximum(frequency_per_um, 1e-300)) / STEP + N_NODES // 2
        rows, row_weights = _cubic(row, _N_PHASES)
        columns, column_weights = _cubic(column, N_NODES)
        flat = self.log_density.ravel()
        total = jnp.zeros(())
        for j in range(4):
            at = (rows + j) * N_NODES + columns
            inner = sum(column_weights[k] * flat[at + k] for k in range(4))
            total = total + row_weights[j] * inner
        return jnp.exp(total)

    def typical_frequency_per_um(self, phase_per_um, highest_per_um) -> Float[Array, ""]:
        """Power-weighted geometric mean of the frequencies up to a highest one."""
        log_frequency = log_nodes() - np.log(2 * np.pi)
        density = self.density_um4(phase_per_um, jnp.exp(log_frequency))
        weight = jnp.where(log_frequency < jnp.log(highest_per_um), density * jnp.exp(2 * log_frequency), 0.0)
        return jnp.exp(weight @ log_frequency / (jnp.sum(weight) + 1e-300))


def _cubic(position, n_nodes: int):
    """First of the four nodes around positions, and their Lagrange weights."""
    inside = jnp.clip(position, 0.0, n_nodes - 1.0)
    first = jnp.clip(jnp.floor(inside).astype(int) - 1, 0, n_nodes - 4)
    return first, cubic_weights(inside - first - 1)


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

    height_variance_um2: Float[Array, ""] = eqx.field(converter=as_float)
    log_frequency: Float[Array, " nodes"] = eqx.field(converter=as_float)
    log_shape: Float[Array, " nodes"] = eqx.field(converter=as_float)

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
