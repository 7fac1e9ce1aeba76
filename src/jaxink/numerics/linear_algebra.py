"""Batched linear algebra whose derivatives use matrix products only.

These are cheap because LAPACK calls loop over the batch, whereas products do not.
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
    """Inverse of symmetric positive definite matrices; compiles to much less code than a general inverse."""
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
    """(1 - r R)^-1, not symmetric, for a diagonal r between 0 and 1 and symmetric R of norm below 1.

    Notes
    -----
    With q = sqrt(r) it is 1 + q (1 - q R q)^-1 q R, where the matrix to invert is positive definite. The
    derivative -X d(1 - r R) X does not contain the root, so r = 0 is not a special case.
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

    Gauss-Jordan elimination without pivoting, which is unnecessary because the symmetric part of such
    matrices is positive definite. A single loop of products compiles quickly and does not call LAPACK.
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
