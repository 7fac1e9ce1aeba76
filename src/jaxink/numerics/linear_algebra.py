"""Batched linear algebra whose derivatives are matrix products only.

LAPACK calls loop over the batch; products do not. Derivatives that need products only therefore cost
little, and forward mode widens no triangular solve.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def at_least_tiny(value):
    """Keep light that is trapped without loss, which nothing excites, from dividing by zero."""
    return jnp.maximum(value, 1e-12)


def transpose(matrix: Float[Array, "... i j"]) -> Float[Array, "... j i"]:
    """Transpose of the last two axes."""
    return jnp.swapaxes(matrix, -1, -2)


@jax.custom_jvp
def positive_definite_inverse(matrix: Float[Array, "... n n"]) -> Float[Array, "... n n"]:
    """Inverse of symmetric positive definite matrices; compiles to far less than a general inverse."""
    factor = jax.lax.linalg.cholesky(matrix, symmetrize_input=False)
    identity = jnp.broadcast_to(jnp.eye(matrix.shape[-1]), matrix.shape)
    root = jax.lax.linalg.triangular_solve(factor, identity, left_side=True, lower=True)
    return transpose(root) @ root


@positive_definite_inverse.defjvp
def _positive_definite_inverse_jvp(primals, tangents):
    (matrix,), (d_matrix,) = primals, tangents
    result = positive_definite_inverse(matrix)
    return result, -result @ d_matrix @ result


@jax.custom_jvp
def resolvent(diagonal: Float[Array, " n"], symmetric: Float[Array, "... n n"]) -> Float[Array, "... n n"]:
    """(1 - r R)^-1 for a diagonal r, 0 ... 1, and symmetric R of norm below 1.

    Parameters
    ----------
    diagonal
        r, shape ``(n,)``.
    symmetric
        R, shape ``(..., n, n)``.

    Returns
    -------
    Float[Array, "... n n"]
        Not symmetric.

    Notes
    -----
    With q = sqrt(r) it is 1 + q (1 - q R q)^-1 q R, whose inverse is of a positive definite matrix. The
    derivative -X d(1 - r R) X knows nothing of the root, so that r = 0 is an ordinary point.
    """
    root = jnp.sqrt(jnp.maximum(diagonal, 0.0))
    identity = jnp.eye(diagonal.shape[-1])
    inner = positive_definite_inverse(identity - root[:, None] * symmetric * root)
    return identity + (root[:, None] * inner * root) @ symmetric


@resolvent.defjvp
def _resolvent_jvp(primals, tangents):
    (diagonal, symmetric), (d_diagonal, d_symmetric) = primals, tangents
    result = resolvent(diagonal, symmetric)
    change = d_diagonal[:, None] * symmetric + diagonal[:, None] * d_symmetric
    return result, result @ change @ result


@jax.custom_jvp
def inverse(matrix: Float[Array, "... n n"]) -> Float[Array, "... n n"]:
    """Inverse of matrices 1 - M with M of norm below 1, with d(X^-1) = -X^-1 dX X^-1.

    Gauss-Jordan without pivoting, which such matrices do not need: their symmetric part is positive
    definite. One loop of products compiles quickly and holds no call of LAPACK.
    """

    def eliminate(k, work):
        pivot_row = work[..., k, :] / work[..., k, k, None]
        column = work[..., :, k].at[..., k].add(-1.0)
        return work - column[..., :, None] * pivot_row[..., None, :]

    n = matrix.shape[-1]
    identity = jnp.broadcast_to(jnp.eye(n), matrix.shape)
    work = jax.lax.fori_loop(0, n, eliminate, jnp.concatenate([matrix, identity], axis=-1))
    return work[..., n:]


@inverse.defjvp
def _inverse_jvp(primals, tangents):
    (matrix,), (d_matrix,) = primals, tangents
    result = inverse(matrix)
    return result, -result @ d_matrix @ result
