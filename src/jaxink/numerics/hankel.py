"""Fourier transform of radially symmetric functions in the plane, on logarithmic grids."""

from functools import lru_cache

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

N_NODES = 1536
# Radii span e^-28 to e^28 of the scale. The truncation error of a transform is below 1e-12 of it, divided by
# the frequency or distance in units of the scale.
_HALF_SPAN = 28.0
STEP = 2 * _HALF_SPAN / N_NODES
# Below this, a transform is constant to 1e-5, and its error, proportional to the inverse, becomes visible.
_LEAST_LOG = -6.0


@lru_cache(maxsize=1)
def log_nodes() -> Float[np.ndarray, " nodes"]:
    """Logarithms of the nodes over their scale, ascending, including 0."""
    return (np.arange(N_NODES) - N_NODES // 2) * STEP


@lru_cache(maxsize=1)
def _kernel() -> np.ndarray:
    """Mellin transform of J0 along Re s = 1, at the frequencies of a real Fourier transform."""
    from scipy.special import loggamma

    frequency = 2 * np.pi * np.arange(N_NODES // 2 + 1) / (N_NODES * STEP)
    return np.exp(1j * (frequency * np.log(2) + 2 * loggamma((1 + 1j * frequency) / 2).imag))


def radial_fourier(values: Float[Array, "*shape nodes"]) -> Float[Array, "*shape nodes"]:
    """Integral of 2 pi h(u) J0(k u) u du, h and the result at u, k = exp(`log_nodes`).

    Parameters
    ----------
    values
        h at the nodes, finite at small u and decaying faster than 1/u at large u.

    Returns
    -------
    Float[Array, "*shape nodes"]
        With radii r = s u and frequencies f = k / (2 pi s), the Fourier transform in the plane is s^2 times
        this, and the inverse transform is this over (2 pi s)^2.

    References
    ----------
    Hamilton 2000 MNRAS 312, 257, appendix B (FFTLog), without bias: h u is transformed.
    """
    radius = np.exp(log_nodes())
    spectrum = jnp.fft.rfft(values * radius) * _kernel()
    return 2 * jnp.pi * jnp.fft.irfft(jnp.conj(spectrum), N_NODES) / radius


def cubic_weights(t: Float[Array, "*shape"]) -> tuple[Float[Array, "*shape"], ...]:
    """Lagrange weights of the nodes -1, 0, 1 and 2 at a position t."""
    return (
        -t * (t - 1) * (t - 2) / 6,
        (t + 1) * (t - 1) * (t - 2) / 2,
        -(t + 1) * t * (t - 2) / 2,
        (t + 1) * t * (t - 1) / 6,
    )


def interpolate_log(
    values: Float[Array, "*shape nodes"], log_position: Float[Array, "*shape points"]
) -> Float[Array, "*shape points"]:
    """Cubic interpolation in the logarithm between nodes, constant below e^-6 of the scale.

    ``log_position`` is the logarithm of the radius or frequency over its scale.
    """
    position = jnp.clip(jnp.maximum(log_position, _LEAST_LOG) / STEP + N_NODES // 2, 1.0, N_NODES - 3.0)
    first = jnp.floor(position).astype(int) - 1
    weights = cubic_weights(position - first - 1)
    terms = [w * jnp.take_along_axis(values, first + k, axis=-1) for k, w in enumerate(weights)]
    return sum(terms[1:], start=terms[0])
