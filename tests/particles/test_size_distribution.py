"""Averages over the radius against direct integrals over numbers of spheres, and their limits."""

import jax
import jax.numpy as jnp
import miepython
import numpy as np
import pytest

from jaxink.particles.mie import mie_coefficients
from jaxink.particles.mixture import SpherePopulation, mixture_coefficients
from jaxink.particles.size_distribution import (
    MOST_SIZES,
    SizeDistribution,
    discrete,
    log_normal,
    monodisperse,
    sizes_needed,
)

# Of the order of rutile in a printing binder: median radius 125 nm, index 2.7 in 1.5, at 550 nm.
RADIUS, INDEX, BINDER, WAVELENGTH, FRACTION = 125.0, 2.7, 1.5, 550.0, 0.1
N_SIZES = 143


@jax.jit
def observables(radius, variance):
    """Scattering coefficient per mm, g, and some of the phase function, of a log-normal distribution."""
    population = SpherePopulation(log_normal(radius, variance, N_SIZES), INDEX, FRACTION)
    phase, scattering, _ = mixture_coefficients((population,), BINDER, WAVELENGTH)
    rest = jnp.concatenate([phase.moments(8)[1:], phase.value(jnp.array([1.0, 0.3, -1.0]))])
    return jnp.concatenate([jnp.log(scattering)[None], rest])


@jax.jit
def equal_spheres(radius):
    phase, scattering, _ = mie_coefficients(radius, INDEX + 0j, FRACTION, BINDER, WAVELENGTH)
    rest = jnp.concatenate([phase.moments(8)[1:], phase.value(jnp.array([1.0, 0.3, -1.0]))])
    return jnp.concatenate([jnp.log(scattering)[None], rest])


SLOPES = jax.jit(jax.jacfwd(observables, argnums=(0, 1)))


def test_without_variance_it_is_one_radius_exactly():
    np.testing.assert_allclose(observables(RADIUS, 0.0), equal_spheres(RADIUS), rtol=1e-11, atol=1e-12)
    shares = log_normal(RADIUS, 0.0, 9)
    np.testing.assert_array_equal(shares.volume_share, np.eye(9)[4])
    assert float(shares.radius_nm[4]) == RADIUS == float(shares.volume_mean_radius_nm)


def test_slope_in_the_variance_at_zero_is_that_of_the_second_derivative():
    # The volume's median moves by 3 v and the spread adds half the second derivative, both in ln r; of the
    # quantities that are averages by volume, mu_s and mu_s p.
    def averaged(shift):
        values = np.asarray(equal_spheres(RADIUS * np.exp(shift)))
        return np.exp(values[0]) * np.append(1.0, values[1:])

    h = 2e-3
    far_below, below, here, above, far_above = (averaged(k * h) for k in range(-2, 3))
    slope = (8 * (above - below) - (far_above - far_below)) / (12 * h)
    bend = (16 * (above + below) - (far_above + far_below) - 30 * here) / (12 * h**2)
    expected = 3 * slope + bend / 2
    here, change = np.asarray(observables(RADIUS, 0.0)), np.asarray(SLOPES(RADIUS, 0.0)[1])
    found = np.exp(here[0]) * np.append(change[0], change[1:] + here[1:] * change[0])
    np.testing.assert_allclose(found, expected, rtol=2e-4, atol=2e-4 * np.abs(expected[1:]).max())
    assert abs(found[0]) > 1e3


@pytest.mark.parametrize("variance", [0.0, 3e-8, 0.01, 0.16])
def test_derivatives_are_differences(variance):
    # Reverse mode: test_dependent_scattering.
    slopes = SLOPES(RADIUS, variance)
    # Resonances of the largest spheres are narrow: no larger steps.
    for position, step in ((0, 1e-7 * RADIUS), (1, 1e-7 if variance > 1e-4 else 2e-8)):
        here = np.asarray(slopes[position])
        assert np.all(np.isfinite(here))
        at = np.array([RADIUS, variance])
        move = step * np.eye(2)[position]
        difference = (observables(*(at + move)) - observables(*(at - move))) / (2 * step)
        np.testing.assert_allclose(here, difference, rtol=1e-4, atol=1e-4 * np.abs(here).max())


@pytest.mark.parametrize(
    ("geometric_deviation", "asymmetry_parameter"), [(1.1, 0.5858), (1.3, 0.5614), (1.5, 0.5296)]
)
def test_averages_are_those_of_a_direct_sum_over_numbers(geometric_deviation, asymmetry_parameter):
    # Wider distributions of this pigment scatter less forward, by cross-section.
    sigma = np.log(geometric_deviation)
    t = np.linspace(-7, 7, 8001)
    radius, number = RADIUS * np.exp(sigma * t), np.exp(-(t**2) / 2)
    _, scattering, _, g = miepython.efficiencies_mx(
        np.full(t.shape, INDEX / BINDER + 0j), 2 * np.pi * radius * BINDER / WAVELENGTH
    )
    section = number * scattering * np.pi * radius**2
    per_volume = np.sum(section) / np.sum(number * 4 / 3 * np.pi * radius**3)
    found = observables(RADIUS, sigma**2)
    direct = np.sum(section * g) / np.sum(section)
    assert direct == pytest.approx(asymmetry_parameter, abs=1e-4)
    assert float(found[1]) == pytest.approx(direct, abs=3e-4)
    assert float(jnp.exp(found[0])) == pytest.approx(FRACTION * per_volume * 1e6, rel=1.5e-3)


def test_ripple_is_averaged_by_the_number_of_sizes_that_is_asked_for():
    x = 2 * np.pi * RADIUS * BINDER / WAVELENGTH
    assert sizes_needed(x, 0.0) == 31
    assert sizes_needed(x, np.log(1.5) ** 2) == N_SIZES
    assert sizes_needed(10 * x, 0.16) == MOST_SIZES


def test_moments_of_the_distribution():
    sizes = log_normal(100.0, 0.1, 41)
    r, share = np.asarray(sizes.radius_nm), np.asarray(sizes.volume_share)
    assert share.sum() == pytest.approx(1, abs=1e-14)
    # Hatch, Choate: by volume the median is r0 exp(3 v); numbers are share / r^3.
    assert np.sum(share * np.log(r)) == pytest.approx(np.log(100) + 0.3, rel=1e-12)
    assert np.sum(share * (np.log(r / 100) - 0.3) ** 2) == pytest.approx(0.1, rel=1e-4)
    assert (1 / np.sum(share / r**3)) ** (1 / 3) == pytest.approx(
        float(sizes.volume_mean_radius_nm), rel=1e-4
    )


def test_table_of_sizes_is_the_sum_of_its_rows():
    sizes = discrete([100.0, 200.0], [3.0, 1.0])
    np.testing.assert_allclose(sizes.volume_share, np.array([3.0, 8.0]) / 11)
    assert float(sizes.volume_mean_radius_nm) == pytest.approx((11e6 / 4) ** (1 / 3))
    phase, scattering, absorption = mixture_coefficients(
        (SpherePopulation(sizes, INDEX + 0.01j, FRACTION),), BINDER, WAVELENGTH
    )
    parts = [
        mie_coefficients(r, INDEX + 0.01j, FRACTION * share, BINDER, WAVELENGTH)
        for r, share in ((100.0, 3 / 11), (200.0, 8 / 11))
    ]
    each = np.array([p.scattering_coefficient_per_mm for p in parts])
    assert float(scattering) == pytest.approx(each.sum(), rel=1e-12)
    assert float(absorption) == pytest.approx(
        sum(float(p.absorption_coefficient_per_mm) for p in parts), rel=1e-12
    )
    mixed = each @ np.stack([p.phase_function.moments(20) for p in parts]) / each.sum()
    np.testing.assert_allclose(phase.moments(20), mixed, atol=1e-13)


def test_a_tail_of_larger_spheres_than_are_served_stands_aside():
    # The tail reaches to a size parameter of 81; half the volume lies below 11.
    population = SpherePopulation(log_normal(400.0, 0.16, N_SIZES), INDEX, FRACTION)
    phase, scattering, _ = mixture_coefficients((population,), BINDER, WAVELENGTH, None, 90.0)
    cut = observables(400.0, 0.16)
    assert float(cut[0]) != float(jnp.log(scattering))
    assert float(cut[0]) == pytest.approx(float(jnp.log(scattering)), abs=2e-3)
    assert float(cut[1]) == pytest.approx(float(phase.moments(2)[1]), abs=5e-4)


def test_median_beyond_what_is_served_is_not_a_number():
    assert np.all(np.isfinite(observables(1000.0, 0.01)))
    assert np.all(np.isnan(observables(3000.0, 0.04)))


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: monodisperse(0.0), "radius_nm"),
        (lambda: log_normal(-1.0, 0.1), "median_radius_nm"),
        (lambda: log_normal(100.0, -0.1), "variance_ln"),
        (lambda: log_normal(100.0, 0.1, 30), "n_sizes"),
        (lambda: discrete([100.0, 200.0], [1.0]), ""),
        (lambda: discrete([100.0, 200.0], [1.0, -1.0]), "1"),
        (lambda: discrete([100.0, 200.0], [0.0, 0.0]), "0"),
    ],
)
def test_wrong_values_are_refused_with_a_sentence(make, named, refused):
    with refused(named):
        make()


def test_a_distribution_is_a_tree_of_arrays():
    assert isinstance(jax.tree.map(lambda a: a, log_normal(100.0, 0.1)), SizeDistribution)
