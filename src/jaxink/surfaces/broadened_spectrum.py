"""The power spectrum of exp(i A z) of a surface height z, which several orders of scattering broaden."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.hankel import (
    N_NODES,
    STEP,
    cubic_weights,
    interpolate_log,
    log_nodes,
    radial_fourier,
)
from jaxink.surfaces.spectrum import PowerSpectrum

# Pairs of polar angles whose transforms are made at once: bounds the memory.
_BATCH = 512
# Phases at which transforms are made, between the largest and this share of it; light whose phase hardly
# depends on the height is scattered hardly.
_N_PHASES, _LEAST_PHASE = 64, 0.005
# Below, relative to the largest value of a transform, there is rounding only.
_FLOOR = 1e-10


def broadened(spectrum: PowerSpectrum, phase_variance, log_position):
    """Transform of sigma^2 (exp(-g (1 - rho)) - exp(-g)) / g at phase variances g: the PSD at g = 0.

    ``log_position`` has the frequencies of each phase variance along its last axis.
    """
    length = spectrum.length_um
    rho = spectrum.correlation(jnp.exp(log_nodes()) * length)

    def of(pair):
        g, position = pair
        x = g * rho
        small = jnp.abs(x) < 1e-5
        safe = jnp.where(small, 1.0, x)
        # exp(g (rho - 1)) - exp(-g) without loss of digits for small g, and without overflow for large.
        large = (jnp.exp(g * (rho - 1)) - jnp.exp(-g)) / safe
        values = rho * jnp.where(x > 1, large, jnp.exp(-g) * jnp.where(small, 1 + x / 2, jnp.expm1(x) / safe))
        return jnp.maximum(interpolate_log(radial_fourier(values), position), 0.0)

    transform = jax.lax.map(of, (phase_variance, log_position), batch_size=_BATCH)
    return spectrum.height_variance_um2 * length**2 * transform


class BroadenedSpectrum(eqx.Module):
    """Spectra of exp(i A z) over A^2, tabulated over phases A per height and frequencies.

    Parameters
    ----------
    log_phase
        First node, and step, of the logarithm of A.
    log_length
        Logarithm of 2 pi times the length of the spectrum.
    log_density
        Logarithm of the density, shape ``(phases, frequencies)``.
    """

    log_phase: tuple[Float[Array, ""], Float[Array, ""]]
    log_length: Float[Array, ""]
    log_density: Float[Array, "phases frequencies"]

    @classmethod
    def of(cls, spectrum: PowerSpectrum, largest_phase_per_um: Float[ArrayLike, ""]) -> "BroadenedSpectrum":
        """Table of a spectrum up to a phase per height."""
        last = jnp.log(largest_phase_per_um)
        step = -np.log(_LEAST_PHASE) / (_N_PHASES - 1)
        first = last - step * (_N_PHASES - 1)
        phase = jnp.exp(first + step * np.arange(_N_PHASES))
        positions = jnp.broadcast_to(log_nodes(), (_N_PHASES, N_NODES))
        density = broadened(spectrum, phase**2 * spectrum.height_variance_um2, positions)
        # A largest value has no derivative where the compiler computes it twice, with other rounding.
        floor = jax.lax.stop_gradient(_FLOOR * jnp.max(density, axis=1, keepdims=True) + 1e-300)
        return cls(
            (first, jnp.asarray(step)),
            jnp.log(2 * jnp.pi * spectrum.length_um),
            jnp.log(jnp.maximum(density, floor)),
        )

    def density_um4(
        self, phase_per_um: Float[ArrayLike, "*#shape"], frequency_per_um: Float[ArrayLike, "*#shape"]
    ) -> Float[Array, "*shape"]:
        """Broadened PSD, cubic in the logarithms of both."""
        first, step = self.log_phase
        row = (jnp.log(jnp.maximum(phase_per_um, 1e-300)) - first) / step
        column = (jnp.log(jnp.maximum(frequency_per_um, 1e-300)) + self.log_length) / STEP + N_NODES // 2
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
        """Geometric mean, by power, of the frequencies up to a highest one."""
        log_frequency = log_nodes() - self.log_length
        density = self.density_um4(phase_per_um, jnp.exp(log_frequency))
        weight = jnp.where(log_frequency < jnp.log(highest_per_um), density * jnp.exp(2 * log_frequency), 0.0)
        return jnp.exp(weight @ log_frequency / (jnp.sum(weight) + 1e-300))


def _cubic(position, n_nodes: int):
    """First of four nodes about positions, and Lagrange weights."""
    inside = jnp.clip(position, 0.0, n_nodes - 1.0)
    first = jnp.clip(jnp.floor(inside).astype(int) - 1, 0, n_nodes - 4)
    return first, cubic_weights(inside - first - 1)
