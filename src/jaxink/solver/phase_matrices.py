"""Phase function of a layer between channels, for all azimuthal orders."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.numerics.legendre import associated_legendre
from jaxink.optics import TruncatedOptics


class PhaseMatrices(NamedTuple):
    """Phase function between channels, without the albedo.

    Parameters
    ----------
    forward, backward
        Scattering into the same and into the opposite hemisphere.
    """

    forward: Float[Array, "orders channels channels"]
    backward: Float[Array, "orders channels channels"]


def phase_matrices(
    truncated: TruncatedOptics,
    cosine: Float[Array, " channels"],
    weight: Float[Array, " channels"],
    n_orders: int,
) -> tuple[Array, Array, PhaseMatrices]:
    """Matrices A and B of `layer_response` for all azimuthal orders, and the phase function.

    Parameters
    ----------
    truncated
        Truncated optics of the layer.
    cosine, weight
        Cosine of each channel in the layer, 0 if evanescent, and its quadrature weight w there.
    n_orders
        Number of azimuthal orders.
    """
    n_moments = truncated.phase_moments.shape[0]
    table = associated_legendre(n_moments, n_orders, cosine)
    inside = cosine > 0
    safe_cosine = jnp.where(inside, cosine, 1.0)
    # A channel of no width has weight 0, where the square root has no finite derivative.
    carries = inside & (weight > 0)
    scale = jnp.where(carries, jnp.sqrt(jnp.where(carries, weight, 1.0) / safe_cosine), 0.0)
    factors = (2 * jnp.arange(n_moments) + 1) * truncated.phase_moments
    parity = (jnp.arange(n_orders)[:, None] + jnp.arange(n_moments)[None, :]) % 2
    even_table = jnp.where(parity[..., None] == 0, table, 0.0)
    odd_table = jnp.where(parity[..., None] == 1, table, 0.0)
    even = jnp.einsum("mli,l,mlj->mij", even_table, factors, even_table)
    odd = jnp.einsum("mli,l,mlj->mij", odd_table, factors, odd_table)
    # The quadrature does not integrate the phase function exactly. A smooth symmetric term makes up the
    # difference: a layer without absorption conserves energy to rounding.
    solid = jnp.where(inside, weight, 0.0)
    missing = 1 - even[0] @ solid
    whole = jnp.sum(solid)
    made_up = (missing[:, None] + missing - solid @ missing / whole) / whole
    scaled_even = scale[:, None] * even.at[0].add(made_up) * scale[None, :]
    scaled_odd = scale[:, None] * odd * scale[None, :]
    albedo = truncated.single_scattering_albedo
    diagonal = jnp.diag(1 / safe_cosine)
    phase = PhaseMatrices(even + odd, even - odd)
    return diagonal - albedo * scaled_odd, diagonal - albedo * scaled_even, phase
