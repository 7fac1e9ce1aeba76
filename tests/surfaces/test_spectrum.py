"""Power spectra: closed forms against quadrature, published transforms, tables against formulas."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import gamma, kv

from jaxink.numerics.hankel import interpolate_log, log_nodes, radial_fourier
from jaxink.surfaces.spectrum import GaussianSpectrum, KCorrelation, tabulated_spectrum

SPECTRA = {
    "gaussian": GaussianSpectrum(0.01, 5.0),
    "k 2.5": KCorrelation(0.01, 5.0, 2.5),
    "k 4": KCorrelation(0.01, 5.0, 4.0),
    "k 6": KCorrelation(0.01, 5.0, 6.0),
}


def test_transform_of_a_gaussian():
    u = np.exp(log_nodes())
    found = np.asarray(radial_fourier(jnp.exp(-(u**2))))
    for k in (1e-3, 0.1, 1.0, 4.0):
        at = np.argmin(np.abs(u - k))
        assert found[at] == pytest.approx(np.pi * np.exp(-(u[at] ** 2) / 4), rel=1e-8)


def test_transform_twice_is_the_identity():
    u = np.exp(log_nodes())
    middle = np.abs(log_nodes()) < 5
    values = jnp.exp(-u)
    twice = radial_fourier(radial_fourier(values)) / (2 * np.pi) ** 2
    np.testing.assert_allclose(twice[middle], values[middle], atol=1e-8)


def test_interpolation_is_cubic():
    at = jnp.array([-3.217, 0.004, 2.9])
    np.testing.assert_allclose(interpolate_log(jnp.asarray(log_nodes()) ** 3, at), at**3, rtol=1e-9)


@pytest.mark.parametrize("name", SPECTRA)
@pytest.mark.parametrize("frequency", [0.05, 0.3, 3.0])
def test_variances_are_integrals_of_the_density(name, frequency):
    spectrum = SPECTRA[name]

    def moment(power):
        return quad(lambda f: float(spectrum.density_um4(f)) * f**power, 0, frequency, limit=200)[0]

    height = float(spectrum.height_variance_below(frequency))
    assert height == pytest.approx(2 * np.pi * moment(1), rel=1e-7)
    slope = float(spectrum.slope_variance_below(frequency))
    assert slope == pytest.approx(4 * np.pi**3 * moment(3), rel=1e-7)


def test_whole_variances_are_the_limits():
    for name in ("gaussian", "k 6"):
        spectrum = SPECTRA[name]
        assert spectrum.height_variance_below(1e4) == pytest.approx(0.01, rel=1e-6)
        assert spectrum.slope_variance_below(1e4) == pytest.approx(float(spectrum.slope_variance), rel=1e-6)
    assert SPECTRA["k 6"].slope_variance == pytest.approx(4 * np.pi**2 * 0.01 / 25 / 2)
    assert SPECTRA["k 4"].slope_variance == np.inf


@pytest.mark.parametrize("exponent", [2.3, 3.0, 4.0, 5.5])
def test_correlation_is_that_of_bessel_functions(exponent):
    r = np.array([1e-3, 0.1, 1.0, 5.0])
    z, nu = 2 * np.pi * r / 5, exponent / 2 - 1
    expected = z**nu * kv(nu, z) * 2 ** (1 - nu) / gamma(nu)
    found = KCorrelation(0.01, 5.0, exponent).correlation(jnp.asarray(r))
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_amplitude_is_the_density_at_zero():
    spectrum = KCorrelation.of_amplitude(0.3, 7.0, 3.2)
    assert spectrum.density_um4(jnp.array(0.0)) == pytest.approx(0.3)
    assert spectrum.amplitude_um4 == pytest.approx(0.3)
    # A / (1 + 1)^(C/2) where B f = 1.
    assert spectrum.density_um4(jnp.array(1 / 7)) == pytest.approx(0.3 / 2**1.6)


def test_density_is_linear_in_the_height_variance():
    frequency = jnp.array([0.1, 1.0])
    slope = jax.jacfwd(lambda v: KCorrelation(v, 5.0, 3.0).density_um4(frequency))(0.0)
    np.testing.assert_allclose(slope, KCorrelation(1.0, 5.0, 3.0).density_um4(frequency), rtol=1e-12)
    assert np.all(slope > 0)


def test_k_correlation_is_differentiable_in_its_shape():
    @jax.jit
    def at(shape):
        s = KCorrelation(0.01, *shape)
        return s.density_um4(jnp.array(0.2)) + s.correlation(jnp.array(1.0)) + s.slope_variance_below(1.0)

    x, step = jnp.array([5.0, 3.0]), 1e-5
    slopes = jax.jit(jax.grad(at))(x)
    for which in (0, 1):
        ahead, behind = (float(at(x.at[which].add(d))) for d in (step, -step))
        assert float(slopes[which]) == pytest.approx((ahead - behind) / (2 * step), rel=1e-6)


@pytest.fixture(scope="module")
def table():
    frequency = np.geomspace(1e-3, 20, 100)
    return tabulated_spectrum(frequency, SPECTRA["k 6"].density_um4(frequency))


def test_table_meets_the_spectrum_it_was_made_of(table):
    exact = SPECTRA["k 6"]
    assert table.height_variance_um2 == pytest.approx(0.01, rel=5e-3)
    frequency = np.geomspace(2e-4, 40, 30)
    expected = np.asarray(exact.density_um4(frequency))
    np.testing.assert_allclose(table.density_um4(jnp.asarray(frequency)), expected, rtol=0.02)
    assert table.slope_variance_below(2.0) == pytest.approx(float(exact.slope_variance_below(2.0)), rel=0.01)
    distance = jnp.array([0.0, 1e-4, 0.1, 1.0, 3.0])
    np.testing.assert_allclose(table.correlation(distance), exact.correlation(distance), atol=2e-3)
    assert table.covered_per_um() == pytest.approx((1e-3, 20))


def test_table_is_differentiable_in_its_nodes(table):
    import equinox as eqx

    @jax.jit
    def at(level):
        moved = eqx.tree_at(lambda s: s.log_shape, table, table.log_shape.at[40].add(level))
        return moved.density_um4(jnp.array(0.05)) + moved.correlation(jnp.array(1.0))

    assert float(jax.jit(jax.grad(at))(0.0)) == pytest.approx(float(at(1e-5) - at(-1e-5)) / 2e-5, rel=1e-5)


def test_bad_tables_are_refused(refused):
    with refused():
        tabulated_spectrum(np.array([1.0, 3.0, 2.0]), np.ones(3))
    with refused("3"):
        tabulated_spectrum(np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.0, 0.0]))
    with refused("3"):
        tabulated_spectrum(np.array([1.0, 2.0]), np.ones(2))
