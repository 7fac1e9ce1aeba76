import jax
import jax.numpy as jnp
import miepython
import numpy as np
import pytest

from jaxink.particles.mie import mie_coefficients, mie_sphere
from jaxink.particles.mie_series import mie_orders
from jaxink.particles.mixture import SpherePopulation, mixture_matrix
from jaxink.particles.phase_function import Rayleigh
from jaxink.particles.size_distribution import monodisperse

COSINES = np.cos(np.deg2rad(np.linspace(0, 180, 181)))
SIZE_PARAMETERS = (0.05, 0.3, 1.0, 2.7, 6.0, 10.3, 15.0, 40.0)
RELATIVE_INDICES = (1.05, 1.405 + 0.00009j, 1.9 + 0.01j, 0.75, 2.6)
N_GRID = len(SIZE_PARAMETERS) * len(RELATIVE_INDICES)


@jax.jit
def spheres(size_parameters, relative_indices):
    def one(size_parameter, relative_index):
        sphere = mie_sphere(size_parameter, relative_index)
        return {
            "extinction": sphere.extinction_efficiency,
            "scattering": sphere.scattering_efficiency,
            "absorption": sphere.absorption_efficiency,
            "asymmetry": sphere.asymmetry_parameter,
            "value": sphere.value(COSINES),
            "moments": sphere.moments(96),
        }

    return jax.vmap(one)(size_parameters, relative_indices)


@pytest.fixture(scope="module")
def grid():
    x, m = (a.ravel() for a in np.meshgrid(SIZE_PARAMETERS, RELATIVE_INDICES))
    return x, m, jax.tree.map(np.asarray, spheres(x, m))


def test_efficiencies_and_asymmetry_are_those_of_miepython(grid):
    x, m, result = grid
    # miepython's index is n - ik; its own series stops early enough to differ by 2e-7 at the smallest x.
    extinction, scattering, _, asymmetry = miepython.efficiencies_mx(np.conj(m), x)
    np.testing.assert_allclose(result["extinction"], extinction, rtol=1e-6)
    np.testing.assert_allclose(result["scattering"], scattering, rtol=1e-6)
    np.testing.assert_allclose(result["asymmetry"], asymmetry, atol=1e-7)


def test_phase_function_is_that_of_miepython_at_every_angle(grid):
    for x, m, value in zip(grid[0], grid[1], grid[2]["value"], strict=True):
        expected = 4 * np.pi * miepython.i_unpolarized(np.conj(m), x, COSINES, norm="one")
        np.testing.assert_allclose(value, expected, rtol=1e-6, err_msg=f"x={x} m={m}")


def test_moments_rebuild_the_phase_function(grid):
    _, _, result = grid
    moments = result["moments"]
    np.testing.assert_allclose(moments[:, 0], 1, atol=1e-12)
    np.testing.assert_allclose(moments[:, 1], result["asymmetry"], atol=1e-12)
    small = grid[0] <= 15  # of degree 2 * 29, so that 96 moments are all of it
    rebuilt = np.polynomial.legendre.legval(
        COSINES, ((2 * np.arange(96) + 1) * moments[small]).T, tensor=True
    )
    np.testing.assert_allclose(rebuilt, result["value"][small], rtol=1e-7)


# Q_ext, Q_sca, Q_abs of the series summed with 60 decimal digits (mpmath 1.4.1, 40 orders).
HIGH_PRECISION = [
    (0.05, (1.5 + 1e-05j), 2.439942413849569e-06, 1.4420066625996853e-06, 9.979357512498836e-07),
    (3.0, (1.4 + 1e-05j), 2.502648666329179, 2.5025141489533347, 0.00013451737584446234),
    (3.0, (1.4 + 1e-09j), 2.5026617935024285, 2.502661780049929, 1.345249967496102e-08),
    (14.0, (1.8 + 1e-05j), 2.417352769697408, 2.416661260317656, 0.0006915093797520191),
    (10.0, (0.8 + 0.3j), 2.046457934298014, 1.1150784715211888, 0.9313794627768249),
]


@pytest.mark.parametrize(("x", "m", "extinction", "scattering", "absorption"), HIGH_PRECISION)
def test_efficiencies_of_a_sum_with_60_digits(x, m, extinction, scattering, absorption):
    sphere = mie_sphere(x, m)
    assert float(sphere.extinction_efficiency) == pytest.approx(extinction, rel=1e-12)
    assert float(sphere.scattering_efficiency) == pytest.approx(scattering, rel=1e-12)
    assert float(sphere.absorption_efficiency) == pytest.approx(absorption, rel=1e-12)


def test_sphere_that_does_not_absorb():
    assert float(mie_sphere(3.0, 1.5).absorption_efficiency) == 0


def test_number_of_orders_suffices():
    tight, ample = mie_sphere(15.0, 1.5, max_size_parameter=15.0), mie_sphere(15.0, 1.5)
    np.testing.assert_allclose(tight.value(COSINES), ample.value(COSINES), rtol=1e-6)
    assert float(tight.scattering_efficiency) == pytest.approx(float(ample.scattering_efficiency), rel=1e-12)
    assert mie_orders(15.0) < mie_orders(40.0) < 60


def test_limit_of_a_small_sphere():
    m = 1.5 + 0.02j
    polarisability = (m**2 - 1) / (m**2 + 2)
    for x in (1e-3, 1e-2):
        sphere = mie_sphere(x, m)
        # Bohren, Huffman 1983, eqs. 5.8 and 5.11; the next terms are smaller by x^2.
        assert float(sphere.scattering_efficiency) == pytest.approx(
            8 / 3 * x**4 * abs(polarisability) ** 2, rel=2 * x**2
        )
        assert float(sphere.absorption_efficiency) == pytest.approx(4 * x * polarisability.imag, rel=3 * x**2)
        np.testing.assert_allclose(sphere.value(COSINES), Rayleigh().value(COSINES), atol=2 * x**2)
        np.testing.assert_allclose(sphere.moments(5), Rayleigh().moments(5), atol=x**2)


def test_extinction_paradox():
    efficiency = mie_sphere(400.0, 1.5 + 0.1j, max_size_parameter=400.0).extinction_efficiency
    assert float(efficiency) == pytest.approx(2, rel=0.05)


# "optics" of the simulated samples white_ink_mie, free_film_mie and coloured_ink: radius_nm, n, k, volume
# fraction, wavelength_nm, mus and mua per mm, g, as the Monte Carlo program states them.
SIMULATED = [
    (231.0, 2.1076, 0.000134, 0.0515, 550, 602.9177518874402, 0.26891410690886913, 0.802192813550482),
    (200.0, 2.3, 0.0002, 0.06, 550, 957.3420279320237, 0.5860809973203611, 0.7306069068362187),
    (250.0, 1.8, 3.1e-05, 0.14, 570, 529.0038122557503, 0.12685869207239991, 0.8614269006242855),
    (250.0, 1.8, 0.00019, 0.14, 600, 479.31762088247183, 0.7343752110793395, 0.8532293627799629),
    (250.0, 1.8, 5e-05, 0.14, 630, 436.79850117075296, 0.18350882843233083, 0.8459913426744772),
]


@pytest.mark.parametrize(("radius", "n", "k", "fraction", "wavelength", "mus", "mua", "g"), SIMULATED)
def test_coefficients_of_the_simulated_samples(radius, n, k, fraction, wavelength, mus, mua, g):
    result = mie_coefficients(
        radius_nm=radius,
        particle_index=n + 1j * k,
        volume_fraction=fraction,
        binder_index=1.5,
        wavelength_nm=wavelength,
    )
    assert float(result.scattering_coefficient_per_mm) == pytest.approx(mus, rel=1e-5)
    assert float(result.absorption_coefficient_per_mm) == pytest.approx(mua, rel=1e-5)
    assert float(result.phase_function.asymmetry_parameter) == pytest.approx(g, abs=1e-5)


def observables(parameters):
    """Everything that a fit uses, each of order 1."""
    x, n, k = parameters
    sphere = mie_sphere(x, n + 1j * k)
    return jnp.concatenate(
        [
            jnp.stack(
                [sphere.scattering_efficiency, sphere.absorption_efficiency, sphere.asymmetry_parameter]
            ),
            jnp.log(sphere.value(jnp.array([-1.0, -0.3, 0.6, 1.0]))),
            sphere.moments(12),
        ]
    )


POINTS = [
    (3.0, 1.4, 0.01),
    (3.0, 1.4, 0.0),
    (13.0, 1.8, 0.001),
    (0.05, 1.5, 0.0),
    (0.05, 1.5, 0.02),
    (38.0, 1.3, 0.0),
]


@pytest.fixture(scope="module")
def derivatives():
    return jax.jit(jax.jacfwd(observables)), jax.jit(jax.jacrev(observables)), jax.jit(observables)


@pytest.mark.parametrize("point", POINTS)
def test_forward_and_reverse_derivative_agree(point, derivatives):
    forward, reverse = (d(jnp.array(point)) for d in derivatives[:2])
    assert np.all(np.isfinite(forward))
    np.testing.assert_allclose(reverse, forward, rtol=1e-8, atol=1e-10 * np.abs(forward).max())


@pytest.mark.parametrize("point", POINTS)
def test_derivative_is_that_of_differences(point, derivatives):
    forward, _, function = derivatives
    analytic = np.asarray(forward(jnp.array(point)))
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-5 * (point[0] if i == 0 else 1)
        # A traced k below 0 passes: the series is analytic there, so k = 0 has two sides.
        difference = (function(point + step) - function(point - step)) / (2 * step[i])
        scale = 1e-6 * np.abs(difference).max() + 1e-12
        np.testing.assert_allclose(analytic[:, i], difference, rtol=2e-5, atol=scale)


def test_sphere_of_the_binders_index_does_not_scatter(derivatives):
    forward, _, function = derivatives
    point = jnp.array([2.0, 1.0, 0.0])
    np.testing.assert_allclose(function(point)[:2], 0, atol=1e-28)
    assert np.all(np.isfinite(function(point)))
    # Scattering grows as the square of the contrast.
    np.testing.assert_allclose(forward(point)[0], 0, atol=1e-13)


def test_slope_of_absorption_of_a_small_sphere_at_k_zero(derivatives):
    # Q_abs = 4 x Im((m^2 - 1) / (m^2 + 2)): slope in k is 24 x n / (n^2 + 2)^2.
    x, n = 1e-3, 1.5
    slope = derivatives[0](jnp.array([x, n, 0.0]))[1, 2]
    assert float(slope) == pytest.approx(24 * x * n / (n**2 + 2) ** 2, rel=1e-5)


def test_derivative_of_the_coefficients_in_the_radius():
    def scattering(radius_nm):
        return mie_coefficients(radius_nm, 2.3 + 0j, 0.1, 1.5, 550.0).scattering_coefficient_per_mm

    value_and_slope = jax.jit(jax.value_and_grad(scattering))
    step = 1e-3
    difference = (value_and_slope(200.0 + step)[0] - value_and_slope(200.0 - step)[0]) / (2 * step)
    assert float(value_and_slope(200.0)[1]) == pytest.approx(float(difference), rel=1e-6)


def test_outside_the_range_a_traced_sphere_is_not_a_number():
    for x, m in ((41.0, 1.5), (-1.0, 1.5), (0.0, 1.5), (39.0, 3.5)):
        result = spheres(np.full(N_GRID, x), np.full(N_GRID, m + 0j))
        assert all(np.all(np.isnan(v)) for v in result.values()), (x, m)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: mie_sphere(0.0, 1.5), "size_parameter"),
        (lambda: mie_sphere(50.0, 1.5), "size_parameter"),
        (
            lambda: mie_sphere(5.0, 1.5 - 0.1j),
            "relative_index",
        ),
        (lambda: mie_sphere(5.0, -1.5), "relative_index"),
        (lambda: mie_sphere(39.0, 3.5), "relative_index"),
        (lambda: mie_coefficients(-1.0, 2.0, 0.1, 1.5, 550.0), "radius_nm"),
        (
            lambda: mie_coefficients(200.0, 2.0, 1.1, 1.5, 550.0),
            "volume_fraction",
        ),
        (
            lambda: mie_coefficients(200.0, 2.0, 0.1, 1.5 + 0.1j, 550.0),
            "binder_index",
        ),
        (lambda: mie_coefficients(200.0, 2.0, 0.1, 1.5, 0.0), "wavelength_nm"),
    ],
)
def test_wrong_values_are_refused_with_a_sentence(make, named, refused):
    with refused(named):
        make()


def test_the_scattering_matrix_is_that_of_miepython():
    index, x = 1.8, 4.2
    spheres = (SpherePopulation(monodisperse(x / (2 * np.pi * 1.5 / 550.0)), 1.5 * index, 0.1),)
    found = mixture_matrix(spheres, 1.5, 550.0, 10.0).elements(COSINES)
    s_1, s_2 = miepython.S1_S2(index, x, COSINES, norm="4pi")
    f_11, f_12, f_33 = found
    np.testing.assert_allclose(f_11, (np.abs(s_1) ** 2 + np.abs(s_2) ** 2) / 2, rtol=1e-8)
    np.testing.assert_allclose(f_12, (np.abs(s_2) ** 2 - np.abs(s_1) ** 2) / 2, atol=1e-8)
    np.testing.assert_allclose(f_33, np.real(s_1 * np.conj(s_2)), atol=1e-8)


def test_small_spheres_scatter_as_dipoles():
    spheres = (SpherePopulation(monodisperse(0.5), 2.5, 0.1),)
    found = mixture_matrix(spheres, 1.5, 550.0, 1.0).elements(COSINES)
    np.testing.assert_allclose(found, Rayleigh().matrix().elements(COSINES), atol=1e-3)
