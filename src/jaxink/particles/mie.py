"""Scattering of light by a sphere: the Mie series, differentiable in size and refractive index.

Symbols: x = size parameter 2 pi radius / wavelength in the medium, m = refractive index of the sphere over
that of the medium, n + ik; psi_n, chi_n = Riccati-Bessel functions with psi_n - i chi_n the outgoing wave;
D_n(z) = psi_n'(z) / psi_n(z). Equation numbers: Bohren, Huffman 1983 ("BH").
"""

from functools import lru_cache, partial
from math import ceil
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from jaxtyping import Array, Complex, Float

from jaxink.numerics.legendre import moments_of_function
from jaxink.numerics.validity import require
from jaxink.optics.phase_function import PhaseFunction

DEFAULT_MAX_SIZE_PARAMETER = 40.0
# The recurrence inside the sphere is started for Re(m) x up to this times the largest size parameter.
MAX_RELATIVE_INDEX = 3.0
# Orders with chi_n beyond this contribute less than its square's inverse; chi_n is not carried further.
_LARGEST_CHI = 1e15


def mie_orders(max_size_parameter: float) -> int:
    """Number of orders of the Mie series that a sphere needs.

    Parameters
    ----------
    max_size_parameter
        Largest size parameter that will be asked for.

    Returns
    -------
    int
        Orders 1 ... this are summed.

    References
    ----------
    Wiscombe 1980 Appl. Opt. 19, 1505, eq. 12 (range 8 ... 4200, which serves below 8 too), and 2 more.
    """
    x = max_size_parameter
    return ceil(x + 4.05 * x ** (1 / 3) + 4)


class MieSphere(PhaseFunction):
    """Scattering of unpolarised light by a sphere; make it with `mie_sphere`.

    Parameters
    ----------
    size_parameter
        2 pi radius / wavelength in the medium.
    electric_coefficients, magnetic_coefficients
        a_n and b_n, BH eq. 4.53 (n from 1), shape ``(orders,)``.
    absorption_efficiency
        Absorption cross-section over pi radius^2.
    """

    size_parameter: Float[Array, ""]
    electric_coefficients: Complex[Array, " orders"]
    magnetic_coefficients: Complex[Array, " orders"]
    absorption_efficiency: Float[Array, ""]

    @property
    def _scattering_sum(self) -> Float[Array, ""]:
        n = np.arange(1, self.electric_coefficients.shape[0] + 1)
        return jnp.sum(
            (2 * n + 1) * (_squared(self.electric_coefficients) + _squared(self.magnetic_coefficients))
        )

    @property
    def scattering_efficiency(self) -> Float[Array, ""]:
        """Scattering cross-section over pi radius^2, BH eq. 4.61."""
        return 2 * self._scattering_sum / self.size_parameter**2

    @property
    def extinction_efficiency(self) -> Float[Array, ""]:
        """Scattering and absorption efficiency together."""
        return self.scattering_efficiency + self.absorption_efficiency

    @property
    def asymmetry_parameter(self) -> Float[Array, ""]:
        """Mean cosine of the scattering angle, BH section 4.5."""
        a, b = self.electric_coefficients, self.magnetic_coefficients
        n = np.arange(1, a.shape[0] + 1)
        neighbours = _inner(a[:-1], a[1:]) + _inner(b[:-1], b[1:])
        total = jnp.sum((n * (n + 2) / (n + 1))[:-1] * neighbours)
        total += jnp.sum((2 * n + 1) / (n * (n + 1)) * _inner(a, b))
        return 2 * total / _nonzero(self._scattering_sum)

    @eqx.filter_jit
    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """Phase function at the cosines, 1 where nothing is scattered; see `PhaseFunction.value`."""
        functions = _angular_functions(self.electric_coefficients.shape[0], jnp.asarray(scattering_cosine))
        return self._from_angular_functions(*functions)

    @eqx.filter_jit
    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """Legendre moments, exact: the phase function is a polynomial in the cosine."""
        n_orders = self.electric_coefficients.shape[0]
        nodes, weights, plus, minus = angular_quadrature(n_orders, n_orders + n_moments // 2 + 1)
        values = self._from_angular_functions(plus, minus)
        return moments_of_function(values, nodes, weights, n_moments)

    def intensity(
        self, plus: Float[ArrayLike, "orders *points"], minus: Float[ArrayLike, "orders *points"]
    ) -> Float[Array, "*points"]:
        """Twice |S_1|^2 + |S_2|^2, that is |S_1 + S_2|^2 + |S_1 - S_2|^2, BH eq. 4.74.

        Parameters
        ----------
        plus, minus
            pi_n + tau_n and pi_n - tau_n at the wanted directions, such as `angular_quadrature` gives.

        Returns
        -------
        Float[Array, "*points"]
            Over the square of the size parameter: scattering efficiency times phase function.
        """
        a, b = self.electric_coefficients, self.magnetic_coefficients
        n = np.arange(1, a.shape[0] + 1)
        factor = (2 * n + 1) / (n * (n + 1))
        total = 0.0
        for coefficients, functions in ((a + b, plus), (a - b, minus)):
            weighted = factor * coefficients
            # Two real products: the angular functions are real.
            parts = jnp.stack([jnp.real(weighted), jnp.imag(weighted)])
            total += jnp.sum(jnp.tensordot(parts, functions, 1) ** 2, axis=0)
        return total

    def _from_angular_functions(self, plus, minus):
        norm = self._scattering_sum
        return jnp.where(norm == 0, 1.0, self.intensity(plus, minus) / (2 * _nonzero(norm)))


class MieCoefficients(NamedTuple):
    """Scattering of a suspension of equal spheres.

    Parameters
    ----------
    phase_function
        That of one sphere.
    scattering_coefficient_per_mm, absorption_coefficient_per_mm
        Coefficients of the suspension.
    """

    phase_function: MieSphere
    scattering_coefficient_per_mm: Float[Array, ""]
    absorption_coefficient_per_mm: Float[Array, ""]


def mie_sphere(
    size_parameter, relative_index, max_size_parameter: float = DEFAULT_MAX_SIZE_PARAMETER
) -> MieSphere:
    """Mie series of a homogeneous sphere in a medium that does not absorb.

    Parameters
    ----------
    size_parameter
        2 pi radius / wavelength in the medium, above 0. Use `jax.vmap` for many spheres.
    relative_index
        Refractive index of the sphere over that of the medium, n + ik with k >= 0.
    max_size_parameter
        Largest size parameter to be served; fixes the number of orders at compile time.

    Returns
    -------
    MieSphere
        Differentiable in both arguments, forward and reverse, k = 0 included. All NaN where traced
        arguments leave the range served: x above the maximum, or n x above 3 times the maximum.

    Raises
    ------
    InputRefusedError
        If an argument is known and outside its range.

    Notes
    -----
    Absorption is summed from the flow into the sphere: Re a_n - |a_n|^2 is the imaginary part of a
    logarithmic derivative times a Wronskian, so that nothing cancels for a small k.

    References
    ----------
    Bohren, Huffman 1983, eqs. 4.53, 4.61, 4.74, 4.88, 4.89.
    """
    x, index = jnp.asarray(size_parameter, float), jnp.asarray(relative_index)
    n, k = jnp.real(index), jnp.imag(index)
    require("size_parameter", x, lambda v: v > 0, "be above 0")
    require("size_parameter", x, lambda v: v <= max_size_parameter, _at_most(max_size_parameter))
    require("the real part of relative_index", n, lambda v: v > 0, "be above 0")
    require("the imaginary part of relative_index", k, lambda v: v >= 0, "be 0 or more (index n + ik)")
    largest_inner = MAX_RELATIVE_INDEX * max_size_parameter
    require(
        "relative_index times size_parameter", n * x, lambda v: v <= largest_inner, _at_most(largest_inner)
    )
    # A number outside the range served would be wrong without a sign of it.
    x = jnp.where((x > 0) & (x <= max_size_parameter) & (n * x <= largest_inner), x, jnp.nan)
    return _mie_series(x, n, k, mie_orders(max_size_parameter), largest_inner)


def mie_coefficients(
    radius_nm,
    particle_index,
    volume_fraction,
    binder_index,
    wavelength_nm,
    max_size_parameter: float = DEFAULT_MAX_SIZE_PARAMETER,
) -> MieCoefficients:
    """Scattering and absorption coefficient of equal spheres that scatter independently.

    Parameters
    ----------
    radius_nm
        Radius of the spheres.
    particle_index
        Complex refractive index n + ik of the spheres.
    volume_fraction
        Share of the volume that the spheres take, 0 ... 1.
    binder_index
        Real refractive index of the binder.
    wavelength_nm
        Wavelength in vacuum.
    max_size_parameter
        As in `mie_sphere`.

    Returns
    -------
    MieCoefficients
        Coefficients 3/4 volume_fraction Q / radius.

    Raises
    ------
    InputRefusedError
        If an argument is known and outside its range.
    """
    for name, value in (
        ("radius_nm", radius_nm),
        ("binder_index", binder_index),
        ("wavelength_nm", wavelength_nm),
    ):
        require(name, value, lambda v: (np.imag(v) == 0) & (np.real(v) > 0), "be real and above 0")
    require("volume_fraction", volume_fraction, lambda v: (v >= 0) & (v <= 1), "lie in 0 ... 1")
    size_parameter = 2 * jnp.pi * radius_nm * binder_index / wavelength_nm
    sphere = mie_sphere(size_parameter, particle_index / binder_index, max_size_parameter)
    per_mm = 0.75 * volume_fraction / (radius_nm * 1e-6)
    return MieCoefficients(
        sphere, per_mm * sphere.scattering_efficiency, per_mm * sphere.absorption_efficiency
    )


def _at_most(limit: float) -> str:
    return f"be at most {limit:g}: ask for a larger max_size_parameter"


@partial(jax.jit, static_argnums=(3, 4))
def _mie_series(x, n, k, n_orders: int, largest_inner: float) -> MieSphere:
    inner_re, inner_im, outer = _logarithmic_derivatives(x, n, k, n_orders, largest_inner)
    chi_before, chi, vanishes = _riccati_bessel_chi(x, n_orders)
    order = np.arange(1, n_orders + 1)
    chi_slope = chi_before - order * chi / x
    # 1/psi_n from the Wronskian psi chi' - psi' chi = -1.
    inverse_psi = outer * chi - chi_slope
    # Electric: D(mx) / m; magnetic: m D(mx). Real and imaginary part by hand: quicker than complex numbers.
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
    return MieSphere(x, electric, magnetic, absorption)


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
    """chi_{n-1}, chi_n, and whether the order vanishes, for orders 1 ... n_orders, by upward recurrence."""

    def one_order_up(carry, order):
        before, here = carry
        vanishes = jnp.abs(here) >= _LARGEST_CHI
        after = jnp.where(vanishes, here, (2 * order - 1) / x * here - before)
        before = jnp.where(vanishes, before, here)
        return (before, after), (before, after, vanishes)

    start = (-jnp.sin(x), jnp.cos(x))
    return jax.lax.scan(one_order_up, start, np.arange(1.0, n_orders + 1))[1]


def _angular_functions(n_orders: int, cosine):
    """pi_n + tau_n and pi_n - tau_n, BH eq. 4.47, shape ``(orders, *points)``."""

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
    """Gauss-Legendre quadrature over the cosine with the angular functions of the Mie series there.

    Parameters
    ----------
    n_orders, n_nodes
        Orders of the series and nodes.

    Returns
    -------
    tuple[np.ndarray, ...]
        Nodes and weights, shape ``(nodes,)``, pi_n + tau_n and pi_n - tau_n, shape ``(orders, nodes)``:
        constants of a compiled program.
    """
    nodes, weights = np.polynomial.legendre.leggauss(n_nodes)
    order = np.arange(1, n_orders + 1)[:, None]
    # pi_n = P_n', tau_n = cos pi_n - sin^2 pi_n' = n cos pi_n - (n + 1) pi_{n-1}.
    polynomials = np.polynomial.legendre.legvander(nodes, n_orders).T
    slope = order * (polynomials[:-1] - nodes * polynomials[1:]) / (1 - nodes**2)
    before = np.concatenate([np.zeros((1, n_nodes)), slope[:-1]])
    tau = order * nodes * slope - (order + 1) * before
    return nodes, weights, slope + tau, slope - tau


def _squared(z):
    return jnp.real(z) ** 2 + jnp.imag(z) ** 2


def _inner(z, w):
    """Re(z w*)."""
    return jnp.real(z) * jnp.real(w) + jnp.imag(z) * jnp.imag(w)


def _nonzero(norm):
    return jnp.where(norm == 0, 1.0, norm)
