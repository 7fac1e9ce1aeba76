"""Scattering of light by a sphere: the Mie series, differentiable in size and refractive index.

Symbols: x = size parameter 2 pi radius / wavelength in the medium, m = refractive index of the sphere over
that of the medium, n + ik; psi_n, chi_n = Riccati-Bessel functions with psi_n - i chi_n the outgoing wave;
D_n(z) = psi_n'(z) / psi_n(z). Equation numbers: Bohren, Huffman 1983 ("BH").
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from jaxtyping import Array, Complex, Float

from jaxink.numerics.legendre import moments_of_function
from jaxink.numerics.validity import require
from jaxink.optics import PhaseFunction
from jaxink.particles.mie_series import angular_functions, angular_quadrature, mie_orders, mie_series

DEFAULT_MAX_SIZE_PARAMETER = 40.0
# The recurrence inside the sphere is started for Re(m) x up to this factor times the largest size parameter.
MAX_RELATIVE_INDEX = 3.0


class MieSphere(PhaseFunction):
    """Scattering of unpolarised light by a sphere; created by `mie_sphere`.

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
        """Sum of the scattering and absorption efficiencies."""
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
        """Phase function at the cosines, 1 if nothing is scattered; see `PhaseFunction.value`."""
        functions = angular_functions(self.electric_coefficients.shape[0], jnp.asarray(scattering_cosine))
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

        Divided by the squared size parameter, it is the scattering efficiency times the phase function.

        Parameters
        ----------
        plus, minus
            pi_n + tau_n and pi_n - tau_n at the directions, for instance from `angular_quadrature`.
        """
        plus, minus = self._amplitudes(plus, minus)
        return jnp.sum(plus**2, axis=0) + jnp.sum(minus**2, axis=0)

    def matrix_elements(
        self, plus: Float[ArrayLike, "orders *points"], minus: Float[ArrayLike, "orders *points"]
    ) -> Float[Array, "3 *points"]:
        """Elements F11, F12 and F33 of the scattering matrix, with the factor and arguments of `intensity`.

        References
        ----------
        Bohren, Huffman 1983, eq. 4.77.
        """
        plus, minus = self._amplitudes(plus, minus)
        of_sum, of_difference = jnp.sum(plus**2, axis=0), jnp.sum(minus**2, axis=0)
        return jnp.stack([of_sum + of_difference, -2 * jnp.sum(plus * minus, axis=0), of_sum - of_difference])

    def _amplitudes(self, plus, minus):
        """Real and imaginary parts of S_1 + S_2 and of S_1 - S_2, BH eq. 4.74."""
        a, b = self.electric_coefficients, self.magnetic_coefficients
        n = np.arange(1, a.shape[0] + 1)
        factor = (2 * n + 1) / (n * (n + 1))

        def series(coefficients, functions):
            weighted = factor * coefficients
            # Two real products, because the angular functions are real.
            return jnp.tensordot(jnp.stack([jnp.real(weighted), jnp.imag(weighted)]), functions, 1)

        return series(a + b, plus), series(a - b, minus)

    def _from_angular_functions(self, plus, minus):
        norm = self._scattering_sum
        return jnp.where(norm == 0, 1.0, self.intensity(plus, minus) / (2 * _nonzero(norm)))


class MieCoefficients(NamedTuple):
    """Coefficients of a suspension of equal spheres, and the phase function of one of them."""

    phase_function: MieSphere
    scattering_coefficient_per_mm: Float[Array, ""]
    absorption_coefficient_per_mm: Float[Array, ""]


def mie_sphere(
    size_parameter, relative_index, max_size_parameter: float = DEFAULT_MAX_SIZE_PARAMETER
) -> MieSphere:
    """Mie series of a homogeneous sphere in a non-absorbing medium.

    Parameters
    ----------
    size_parameter
        2 pi radius / wavelength in the medium, above 0. Use `jax.vmap` for many spheres.
    relative_index
        Refractive index of the sphere over that of the medium, n + ik with k >= 0.
    max_size_parameter
        Largest size parameter supported; determines the number of orders at compile time.

    Returns
    -------
    MieSphere
        Differentiable in both arguments, forward and reverse, including k = 0. All NaN if traced arguments
        are out of range: x above the maximum, or n x above 3 times the maximum.

    Raises
    ------
    InputRefusedError
        If a known argument is out of range.

    Notes
    -----
    Absorption is summed from the flux into the sphere: Re a_n - |a_n|^2 is the imaginary part of a
    logarithmic derivative times a Wronskian, so there is no cancellation for small k.

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
    # Outside this range the result would be wrong without any sign of it.
    x = jnp.where((x > 0) & (x <= max_size_parameter) & (n * x <= largest_inner), x, jnp.nan)
    return MieSphere(x, *mie_series(x, n, k, mie_orders(max_size_parameter), largest_inner))


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
        Fraction of the volume occupied by the spheres, 0 to 1.
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
        If a known argument is out of range.
    """
    for name, value in (
        ("radius_nm", radius_nm),
        ("binder_index", binder_index),
        ("wavelength_nm", wavelength_nm),
    ):
        require(name, value, lambda v: (np.imag(v) == 0) & (np.real(v) > 0), "be real and above 0")
    require("volume_fraction", volume_fraction, lambda v: (v >= 0) & (v <= 1), "be between 0 and 1")
    size_parameter = 2 * jnp.pi * radius_nm * binder_index / wavelength_nm
    sphere = mie_sphere(size_parameter, particle_index / binder_index, max_size_parameter)
    per_mm = 0.75 * volume_fraction / (radius_nm * 1e-6)
    return MieCoefficients(
        sphere, per_mm * sphere.scattering_efficiency, per_mm * sphere.absorption_efficiency
    )


def _at_most(limit: float) -> str:
    return f"be at most {limit:g}, or max_size_parameter must be larger"


def _squared(z):
    return jnp.real(z) ** 2 + jnp.imag(z) ** 2


def _inner(z, w):
    """Re(z w*)."""
    return jnp.real(z) * jnp.real(w) + jnp.imag(z) * jnp.imag(w)


def _nonzero(norm):
    return jnp.where(norm == 0, 1.0, norm)
