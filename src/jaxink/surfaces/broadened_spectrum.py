"""The power spectrum of exp(i A z) of a surface height z, broadened by several orders of scattering."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.hankel import N_NODES, STEP, cubic_weights, interpolate_log, log_nodes, radial_fourier
from jaxink.surfaces.spectrum import PowerSpectrum

# Pairs of polar angles that are transformed at once; limits the memory.
_BATCH = 512
# Number of phases that are transformed, between the largest and this fraction of it; light whose phase hardly
# depends on the height is hardly scattered.
_N_PHASES, _LEAST_PHASE = 64, 0.005
# Rounding error relative to the largest value of a transform.
_FLOOR = 1e-10


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
