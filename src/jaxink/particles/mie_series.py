"""The Mie series of a sphere: coefficients by recurrence, and angular functions.

Symbols and equation numbers as in `jaxink.particles.mie`.
"""

from functools import lru_cache, partial
from math import ceil

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

# Orders with larger chi_n contribute less than its inverse square; the recurrence is stopped there.
_LARGEST_CHI = 1e15


def mie_orders(max_size_parameter: float) -> int:
    """Number of orders, from 1, of the Mie series up to a size parameter.

    References
    ----------
    Wiscombe 1980 Appl. Opt. 19, 1505, eq. 12 (for 8 to 4200, also sufficient below), and 2 more.
    """
    x = max_size_parameter
    return ceil(x + 4.05 * x ** (1 / 3) + 4)


@partial(jax.jit, static_argnums=(3, 4))
def mie_series(
    x: Float[Array, ""], n: Float[Array, ""], k: Float[Array, ""], n_orders: int, largest_inner: float
) -> tuple[Complex[Array, " orders"], Complex[Array, " orders"], Float[Array, ""]]:
    """Coefficients a_n and b_n of the series, and the absorption efficiency.

    Parameters
    ----------
    x
        Size parameter.
    n, k
        Refractive index n + ik of the sphere over that of the medium.
    n_orders
        Orders of the series.
    largest_inner
        Largest n x supported.
    """
    inner_re, inner_im, outer = _logarithmic_derivatives(x, n, k, n_orders, largest_inner)
    chi_before, chi, vanishes = _riccati_bessel_chi(x, n_orders)
    order = np.arange(1, n_orders + 1)
    chi_slope = chi_before - order * chi / x
    # 1/psi_n from the Wronskian psi chi' - psi' chi = -1.
    inverse_psi = outer * chi - chi_slope
    # Electric: D(mx) / m; magnetic: m D(mx). Real and imaginary parts are faster than complex numbers.
    size = n**2 + k**2
    interior_re = jnp.stack([(inner_re * n + inner_im * k) / size, inner_re * n - inner_im * k])
    interior_im = jnp.stack([(inner_im * n - inner_re * k) / size, inner_im * n + inner_re * k])
    # a = N / (N - iM), BH eq. 4.88, with N = interior - D(x) and M = (interior chi - chi') / psi.
    number_re, number_im = interior_re - outer, interior_im
    other_re = (interior_re * chi - chi_slope) * inverse_psi
    other_im = interior_im * chi * inverse_psi
    divisor_re, divisor_im = number_re + other_im, number_im - other_re
    squared = divisor_re**2 + divisor_im**2
    coefficient = jax.lax.complex(
        (number_re * divisor_re + number_im * divisor_im) / squared,
        (number_im * divisor_re - number_re * divisor_im) / squared,
    )
    absorbed = jnp.where(vanishes, 0.0, -interior_im * inverse_psi**2 / squared)
    electric, magnetic = jnp.where(vanishes, 0.0, coefficient)
    absorption = 2 / x**2 * jnp.sum((2 * order + 1) * absorbed)
    return electric, magnetic, absorption


def _logarithmic_derivatives(x, n, k, n_orders: int, largest_inner: float):
    """Real and imaginary part of D_n(mx), and D_n(x), by downward recurrence, BH eq. 4.89."""
    start = max(n_orders, ceil(largest_inner + 8 * largest_inner ** (1 / 3))) + 15
    squared = (n**2 + k**2) * x
    inverse_re, inverse_im = n / squared, -k / squared

    def one_order_down(carry, order):
        re, im, outer = carry
        term_re, term_im = order * inverse_re, order * inverse_im
        sum_re, sum_im = re + term_re, im + term_im
        modulus = sum_re**2 + sum_im**2
        below = (term_re - sum_re / modulus, term_im + sum_im / modulus, order / x - 1 / (outer + order / x))
        return below, carry

    zero = jnp.zeros_like(x)
    _, values = jax.lax.scan(one_order_down, (zero, zero, zero), np.arange(start, 0.0, -1.0))
    return tuple(v[::-1][:n_orders] for v in values)


def _riccati_bessel_chi(x, n_orders: int):
    """chi_{n-1}, chi_n, and whether the order vanishes, for orders 1 to n_orders, by upward recurrence."""

    def one_order_up(carry, order):
        before, here = carry
        vanishes = jnp.abs(here) >= _LARGEST_CHI
        after = jnp.where(vanishes, here, (2 * order - 1) / x * here - before)
        before = jnp.where(vanishes, before, here)
        return (before, after), (before, after, vanishes)

    start = (-jnp.sin(x), jnp.cos(x))
    return jax.lax.scan(one_order_up, start, np.arange(1.0, n_orders + 1))[1]


def angular_functions(
    n_orders: int, cosine: Float[Array, "*points"]
) -> tuple[Float[Array, "orders *points"], Float[Array, "orders *points"]]:
    """pi_n + tau_n and pi_n - tau_n at cosines of the scattering angle, BH eq. 4.47."""

    def next_order(carry, order):
        two_before, before = carry
        here = jnp.where(order > 1, (2 * order - 1) * cosine * before - order * two_before, order)
        here = here / jnp.maximum(order - 1, 1.0)
        tau = order * cosine * here - (order + 1) * before
        return (before, here), (here + tau, here - tau)

    zero = jnp.zeros_like(cosine, float)
    return jax.lax.scan(next_order, (zero, zero), np.arange(1.0, n_orders + 1))[1]


@lru_cache(maxsize=16)
def angular_quadrature(n_orders: int, n_nodes: int) -> tuple[np.ndarray, ...]:
    """Gauss-Legendre quadrature over the cosine, with the angular functions of the Mie series.

    Returns nodes and weights, shape ``(nodes,)``, and pi_n + tau_n and pi_n - tau_n, shape
    ``(orders, nodes)``; constants of a compiled program.
    """
    nodes, weights = np.polynomial.legendre.leggauss(n_nodes)
    order = np.arange(1, n_orders + 1)[:, None]
    # pi_n = P_n', tau_n = cos pi_n - sin^2 pi_n' = n cos pi_n - (n + 1) pi_{n-1}.
    polynomials = np.polynomial.legendre.legvander(nodes, n_orders).T
    slope = order * (polynomials[:-1] - nodes * polynomials[1:]) / (1 - nodes**2)
    before = np.concatenate([np.zeros((1, n_nodes)), slope[:-1]])
    tau = order * nodes * slope - (order + 1) * before
    return nodes, weights, slope + tau, slope - tau
