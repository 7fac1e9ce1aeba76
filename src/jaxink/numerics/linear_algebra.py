"""Batched linear algebra whose derivatives are matrix products only.

LAPACK calls loop over the batch; products do not. Derivatives that need products only therefore cost
little, and forward mode widens no triangular solve.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def transpose(matrix: Float[Array, "... i j"]) -> Float[Array, "... j i"]:
    """Transpose of the last two axes."""
    return jnp.swapaxes(matrix, -1, -2)


@jax.custom_jvp
def inverse(matrix: Float[Array, "... n n"]) -> Float[Array, "... n n"]:
    """Inverse of each matrix of a batch, with d(X^-1) = -X^-1 dX X^-1."""
    return jnp.linalg.inv(matrix)


@inverse.defjvp
def _inverse_jvp(primals, tangents):
    (matrix,), (d_matrix,) = primals, tangents
    result = inverse(matrix)
    return result, -result @ d_matrix @ result
