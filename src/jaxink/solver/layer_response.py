"""Reflection and transmission matrices of a homogeneous scattering layer of any optical thickness.

With u = I_down + I_up and v = I_down - I_up in the basis scaled by sqrt(w mu), radiative transfer reads
u' = -A v, v' = -B u with A and B symmetric. The even and odd solutions about the mid-plane are functions
of the symmetric matrix S = C^T B C, where A = C C^T: one symmetric eigenproblem per azimuthal order
serves every optical thickness, without growing exponentials.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.linear_algebra import positive_definite_inverse, transpose
from jaxink.numerics.linear_map import linear_map

LAYER_METHODS = ("discrete_ordinates", "adding_doubling")

# Added to the half thickness: keeps the odd solution, ~ 1/thickness, finite at zero thickness while all
# derivatives remain correct.
_THINNEST = 1e-14
# Eigenvalues run from 0 to 1/mu^2 of the most grazing stream, and `eigh` is accurate to the rounding of the
# largest. It is given (S + shift)^-1, where the slow modes, which govern thick layers, are the largest.
_SHIFT = 1.0
# sqrt(s) h of the slowest mode above which less than 1e-5 of the light is transmitted.
_DIM = 6.0


def _even(root, half):
    """sqrt(s) tanh(sqrt(s) h) for root = sqrt(s)."""
    return root * jnp.tanh(root * half)


def _odd(root, half):
    """sqrt(s) coth(sqrt(s) h) for root = sqrt(s); 1/h at s = 0."""
    x = root * half
    small = x < 1e-4
    safe = jnp.where(small, 1.0, x)
    return jnp.where(small, 1.0 + x**2 / 3, safe / jnp.tanh(safe)) / half


def _odd_minus_even(root, half):
    """`_odd` - `_even` = 2 sqrt(s) / sinh(2 sqrt(s) h), without cancellation."""
    x = 2 * root * half
    small = x < 1e-4
    safe = jnp.where(small, 1.0, x)
    return jnp.where(small, 1 - x**2 / 6, 2 * safe * jnp.exp(-safe) / -jnp.expm1(-2 * safe)) / half


def _divided_differences(root, half):
    """(f(s_i) - f(s_j)) / (s_i - s_j) of `_even` and `_odd`, stable for equal and for vanishing s.

    Uses tanh a - tanh b = sinh(a - b) / (cosh a cosh b), coth a - coth b = -sinh(a - b) / (sinh a sinh b),
    and the Taylor series where both arguments are small.
    """
    x = root * half
    p = jnp.maximum(x[..., :, None], x[..., None, :])
    q = jnp.minimum(x[..., :, None], x[..., None, :])
    small = p < 0.05
    p_safe = jnp.where(small, 1.0, p)
    d = 2 * (p_safe - q)
    ratio = jnp.where(d < 1e-8, 1.0 - d / 2, -jnp.expm1(-d) / jnp.where(d < 1e-8, 1.0, d))
    decay = jnp.exp(-2 * p_safe)
    # sinhc(p - q) / (cosh p cosh q), and q sinhc(p - q) / (sinh p sinh q)
    cosh_term = 4 * ratio * jnp.exp(-2 * q) / ((1 + decay) * (1 + jnp.exp(-2 * q)))
    q_over_expm1 = jnp.where(q < 1e-8, 0.5, q / jnp.expm1(2 * jnp.where(q < 1e-8, 1.0, q)))
    sinh_term = 4 * ratio * q_over_expm1 / (1 - decay)
    even = (jnp.tanh(p_safe) + q * cosh_term) / (p_safe + q)
    odd = (1 / jnp.tanh(p_safe) - sinh_term) / (p_safe + q)
    a, b = p**2, q**2
    first, second = a + b, a**2 + a * b + b**2
    third = (a + b) * (a**2 + b**2)
    even_series = 1 - first / 3 + 2 * second / 15 - 17 * third / 315
    odd_series = 1 / 3 - first / 45 + 2 * second / 945 - third / 4725
    return (
        half * jnp.where(small, even_series, even),
        half * jnp.where(small, odd_series, odd),
    )


def _layer_primal(a_matrix, b_matrix, half):
    """X_e = (1 + Z_even)^-1, X_o = (1 + Z_odd)^-1, the transmission X_e - X_o, and their basis."""
    half = half + _THINNEST
    factor = jax.lax.linalg.cholesky(a_matrix, symmetrize_input=False)
    s_matrix = transpose(factor) @ b_matrix @ factor
    identity = jnp.eye(a_matrix.shape[-1])
    reciprocal, vectors = jnp.linalg.eigh(
        positive_definite_inverse(s_matrix + _SHIFT * identity), symmetrize_input=False
    )
    # B is positive semi-definite: a negative eigenvalue is a rounded zero, that of a conservative layer.
    s = 1 / reciprocal - _SHIFT
    root = jnp.sqrt(jnp.maximum(s, 0.0))
    w_basis = jax.lax.linalg.triangular_solve(factor, vectors, left_side=True, lower=True, transpose_a=True)
    z_even = (w_basis * _even(root, half)[..., None, :]) @ transpose(w_basis)
    z_odd = (w_basis * _odd(root, half)[..., None, :]) @ transpose(w_basis)
    x_even, x_odd = _inverted(z_even, z_odd)
    passed = jax.lax.cond(
        jnp.min(root) * half > _DIM, _dim_transmission, _transmission, x_even, x_odd, w_basis, root, half
    )
    return x_even, x_odd, passed, root, w_basis, factor @ vectors


def _transmission(x_even, x_odd, *_):
    """T = X_e - X_o."""
    return x_even - x_odd


def _dim_transmission(x_even, x_odd, w_basis, root, half):
    """The same as X_e (Z_odd - Z_even) X_o, without cancellation."""
    return (x_even @ w_basis * _odd_minus_even(root, half)[..., None, :]) @ (transpose(w_basis) @ x_odd)


def _inverted(z_even, z_odd):
    """X_e and X_o, see `_layer_primal`."""
    identity = jnp.eye(z_even.shape[-1])
    return positive_definite_inverse(jnp.stack([identity + z_even, identity + z_odd]))


def _reflection(x_even, x_odd):
    """R = X_e + X_o - 1."""
    return x_even + x_odd - jnp.eye(x_even.shape[-1])


def layer_response(
    a_matrix: Float[Array, "orders nodes nodes"],
    b_matrix: Float[Array, "orders nodes nodes"],
    half_thickness: Float[Array, ""],
) -> tuple[Float[Array, "orders nodes nodes"], Float[Array, "orders nodes nodes"]]:
    """Reflection and transmission matrices of a homogeneous layer.

    Parameters
    ----------
    a_matrix
        ``1/mu - (P+ - P-)`` for each azimuthal order, symmetric, positive definite.
    b_matrix
        ``1/mu - (P+ + P-)``, symmetric, positive semi-definite.
    half_thickness
        Half of the optical thickness, 0 or more.

    Returns
    -------
    reflection, transmission
        Symmetric matrices in the basis scaled by sqrt(w mu); the transmission includes unscattered
        light.

    Notes
    -----
    The derivatives are exact and do not differentiate eigenvectors: in the basis U = C V of the generalised
    problem, dZ = G o (U-basis dB) + (G (s_i + s_j)/2 - (f_i + f_j)/2) o (U-basis dA), where G, the divided
    differences of Daleckii and Krein, is finite for equal eigenvalues. The rule costs matrix products only.
    Second and higher derivatives are those of `doubled_response`, without eigenvectors.

    References
    ----------
    Nakajima, Tanaka 1986 JQSRT 35, 13 (symmetric discrete-ordinates eigenproblem);
    Higham 2008 Functions of Matrices, theorem 3.11 (Daleckii-Krein).
    """
    response, _ = _response_and_basis(a_matrix, b_matrix, half_thickness)
    return response


@jax.custom_jvp
def _response_and_basis(a_matrix, b_matrix, half):
    """Reflection and transmission, and what their derivatives are computed from, as constants."""
    x_even, x_odd, passed, *basis = _layer_primal(a_matrix, b_matrix, half)
    return (_reflection(x_even, x_odd), passed), (x_even, x_odd, *basis)


@_response_and_basis.defjvp
def _response_and_basis_jvp(primals, tangents):
    response, basis = _response_and_basis(*primals)
    change = linear_map(_change_in_basis, _change_by_doubling, (*primals, *basis), tuple(tangents))
    return (response, basis), (change, jax.tree.map(jnp.zeros_like, basis))


def _change_in_basis(_a_matrix, _b_matrix, half, x_even, x_odd, root, w_basis, u_basis, d_a, d_b, d_half):
    """First derivative of `layer_response`, see there."""
    half = half + _THINNEST
    identity = jnp.eye(root.shape[-1])
    a_tilde = transpose(w_basis) @ d_a @ w_basis
    b_tilde = transpose(u_basis) @ d_b @ u_basis
    s = root**2
    s_mean = (s[..., :, None] + s[..., None, :]) / 2
    change = []
    for x, f, g, slope in zip(
        (x_even, x_odd),
        (_even(root, half), _odd(root, half)),
        _divided_differences(root, half),
        (s / jnp.cosh(jnp.minimum(root * half, 300.0)) ** 2, -_csch_square(root, half)),
        strict=True,
    ):
        f_mean = (f[..., :, None] + f[..., None, :]) / 2
        inner = g * b_tilde + (g * s_mean - f_mean) * a_tilde
        inner = inner + d_half * slope[..., :, None] * identity
        y = x @ w_basis
        change.append(-(y @ inner @ transpose(y)))
    d_even, d_odd = change
    return d_even + d_odd, d_even - d_odd


def _change_by_doubling(a_matrix, b_matrix, half, *basis_and_change):
    """The same to the accuracy of `doubled_response`, with derivatives of any order."""
    _, change = jax.jvp(doubled_response, (a_matrix, b_matrix, half), basis_and_change[-3:])
    return change


def _csch_square(root, half):
    """Minus the derivative of `_odd`: s / sinh(sqrt(s) h)^2; 1/h^2 at s = 0."""
    x = jnp.minimum(root * half, 300.0)
    small = x < 1e-4
    safe = jnp.where(small, 1.0, x)
    return jnp.where(small, 1.0 - x**2 / 3, (safe / jnp.sinh(safe)) ** 2) / half**2


@jax.custom_jvp
def _parallel_sum(even, odd):
    """(even^-1 + odd^-1)^-1 of positive definite matrices; even may be singular."""
    factor = jax.lax.linalg.cholesky(even + odd, symmetrize_input=False)
    root = jax.lax.linalg.triangular_solve(factor, even, left_side=True, lower=True)
    return even - transpose(root) @ root


@_parallel_sum.defjvp
def _parallel_sum_jvp(primals, tangents):
    (even, odd), (d_even, d_odd) = primals, tangents
    share = positive_definite_inverse(even + odd) @ even
    rest = jnp.eye(even.shape[-1]) - share
    change = transpose(rest) @ d_even @ rest + transpose(share) @ d_odd @ share
    return _parallel_sum(even, odd), change


# Optical thickness over the most grazing cosine at which doubling starts from a series to sixth order.
_DOUBLING_START = 0.02
# Largest transmission that is taken from the difference of the operators, which of thin layers is infinite.
_DIM_SHARE = 1e-4
# Enough to reach optical thickness 1e9 at a cosine of 1e-4.
_MOST_DOUBLINGS = 48


def doubled_response(
    a_matrix: Float[Array, "orders nodes nodes"],
    b_matrix: Float[Array, "orders nodes nodes"],
    half_thickness: Float[Array, ""],
) -> tuple[Float[Array, "orders nodes nodes"], Float[Array, "orders nodes nodes"]]:
    """`layer_response` by adding-doubling, with the same arguments and results.

    Notes
    -----
    Layers are doubled in the even and odd operators Z of `layer_response`, where doubling reads
    tanh(2x) = 2 / (coth x + tanh x) and coth(2x) = (coth x + tanh x) / 2. In these sums of positive
    matrices rounding errors do not grow with the number of doublings, as they do in R and T. Their
    difference, which thick layers transmit, is doubled beside them, for it to keep its digits.

    References
    ----------
    Hansen, Travis 1974 Space Sci. Rev. 16, 527, section 3.2 (doubling).
    """
    half = half_thickness + _THINNEST
    # A is about 1/mu: its largest diagonal entry gives the most grazing cosine.
    steepest = jnp.max(jnp.diagonal(a_matrix, axis1=-2, axis2=-1))
    ratio = jax.lax.stop_gradient(half * steepest / _DOUBLING_START)
    n_doublings = jnp.clip(jnp.ceil(jnp.log2(ratio)), 0, _MOST_DOUBLINGS)
    start = half * 2.0**-n_doublings
    bab = b_matrix @ a_matrix @ b_matrix
    babab = b_matrix @ a_matrix @ bab
    even = start * (b_matrix - start**2 / 3 * (bab - 0.4 * start**2 * babab))
    odd = positive_definite_inverse(a_matrix) / start
    odd = odd + start / 3 * (b_matrix - start**2 / 15 * (bab - 2 / 21 * start**2 * babab))

    def double(state):
        even, odd, apart = state
        both = positive_definite_inverse(even + odd)
        return 2 * _parallel_sum(even, odd), (even + odd) / 2, apart @ both @ apart / 2

    def step(state, k):
        return jax.lax.cond(k < n_doublings, double, lambda state: state, state), None

    (even, odd, apart), _ = jax.lax.scan(step, (even, odd, odd - even), jnp.arange(_MOST_DOUBLINGS))
    x_even, x_odd = _inverted(even, odd)
    passed = _transmission(x_even, x_odd)
    is_dim = jnp.max(jnp.abs(passed)) < _DIM_SHARE
    passed = jax.lax.cond(is_dim, lambda: x_even @ apart @ x_odd, lambda: passed)
    return _reflection(x_even, x_odd), passed


def layer_method(name: str) -> str:
    """Resolve a layer method; ``"fastest"`` becomes the one that is faster on processors and accelerators.

    Parameters
    ----------
    name
        One of `LAYER_METHODS`, or ``"fastest"``.

    Raises
    ------
    InputRefusedError
        If the name is unknown.
    """
    if name == "fastest":
        # Measured on an H100, too, for single solutions and for batches (docs/validation/performance.md).
        return LAYER_METHODS[0]
    if name not in LAYER_METHODS:
        raise InputRefusedError(
            f"layer_method is '{name}'; it must be one of: fastest, {', '.join(LAYER_METHODS)}."
        )
    return name


def respond(method: str, a_matrix, b_matrix, half_thickness) -> tuple[Array, Array]:
    """`layer_response` by the named method, see `layer_method`."""
    functions = dict(zip(LAYER_METHODS, (layer_response, doubled_response), strict=True))
    return functions[layer_method(method)](a_matrix, b_matrix, half_thickness)
