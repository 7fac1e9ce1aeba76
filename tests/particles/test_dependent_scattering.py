"""The structure factor of hard spheres, what it does to pigments, and mixtures of populations."""

import jax
import jax.flatten_util
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.particles.mie import mie_coefficients
from jaxink.particles.mixture import SpherePopulation, mixture_coefficients
from jaxink.particles.size_distribution import log_normal, monodisperse
from jaxink.particles.structure_factor import percus_yevick

BINDER, WAVELENGTH = 1.5, 550.0
NODES, WEIGHTS = np.polynomial.legendre.leggauss(96)


def direct(x, f):
    """S(q) from the direct correlation function by quadrature, Wertheim 1963."""
    t, w = np.polynomial.legendre.leggauss(200)
    t, w = (t + 1) / 2, w / 2
    alpha = (1 + 2 * f) ** 2 / (1 - f) ** 4
    beta = -6 * f * (1 + f / 2) ** 2 / (1 - f) ** 4
    correlation = alpha + beta * t + f / 2 * alpha * t**3
    return 1 / (1 + 24 * f * np.sum(w * t**2 * correlation * np.sinc(x * t / np.pi)))


@pytest.mark.parametrize("f", [0.01, 0.2, 0.5])
def test_structure_factor_is_that_of_the_direct_correlation(f):
    x = np.array([0.0, 1e-8, 1e-3, 0.5, 1.999, 2.001, 3.0, 6.7, 20.0, 90.0])
    expected = [direct(value, f) for value in x]
    np.testing.assert_allclose(percus_yevick(x**2, f), expected, rtol=2e-12)
    assert float(percus_yevick(0.0, f)) == pytest.approx((1 - f) ** 4 / (1 + 2 * f) ** 2, rel=1e-13)


def test_limits_of_the_structure_factor():
    assert float(percus_yevick(0.0, 0.2)) == pytest.approx(0.209, abs=5e-4)
    np.testing.assert_array_equal(percus_yevick(np.array([0.0, 1.0, 50.0]), 0.0), 1.0)
    assert float(percus_yevick(1e8, 0.4)) == pytest.approx(1, abs=1e-6)
    # Freezing: the main peak of the hard-sphere fluid reaches about 2.85 near 0.49 (Hansen, Verlet 1969).
    peak = float(jnp.max(percus_yevick(np.linspace(30, 70, 2000), 0.49)))
    assert 2.8 < peak < 3.4


def test_derivatives_of_the_structure_factor():
    y = np.array([0.0, 1e-6, 1.0, 3.9999, 4.0001, 40.0])

    structure = jax.jit(percus_yevick)
    forward, reverse = (jax.jit(d(percus_yevick, argnums=(0, 1))) for d in (jax.jacfwd, jax.jacrev))
    for f in (0.0, 0.3):
        in_y, in_f = (np.asarray(slope) for slope in forward(y, f))
        in_y = in_y.diagonal()
        np.testing.assert_allclose(reverse(y, f)[0].diagonal(), in_y, rtol=1e-12)
        np.testing.assert_allclose(reverse(y, f)[1], in_f, rtol=1e-12)
        h = 1e-5
        above, below = structure(y + 2 * h, f), structure(y + h, f)
        one_sided = (-3 * structure(y, f) + 4 * below - above) / (2 * h)
        np.testing.assert_allclose(in_y, one_sided, rtol=1e-5, atol=1e-9)
        above, below = structure(y, f + 2 * h), structure(y, f + h)
        one_sided = (-3 * structure(y, f) + 4 * below - above) / (2 * h)
        np.testing.assert_allclose(in_f, one_sided, rtol=1e-5, atol=1e-8)


COSINES = np.concatenate([[1.0, -1.0], NODES])


def crowded(parameters):
    """Coefficients, moments and phase function of two kinds of spheres."""
    populations = tuple(
        SpherePopulation(log_normal(radius, variance), index + 1j * absorbs, fraction)
        for radius, variance, index, absorbs, fraction in parameters["kinds"]
    )
    phase, scattering, absorption = mixture_coefficients(
        populations, BINDER, WAVELENGTH, parameters["weight"]
    )
    return jnp.stack([scattering, absorption]), phase.moments(40), phase.value(COSINES)


CROWDED = jax.jit(crowded)
SLOPES = jax.jit(jax.jacfwd(crowded))


@jax.jit
def pulled_back(parameters, weights):
    """Reverse mode: derivative of a weighted sum of all that `crowded` returns."""

    def total(parameters):
        return sum(jnp.vdot(w, output) for w, output in zip(weights, crowded(parameters), strict=True))

    return jax.grad(total)(parameters)


PIGMENT = (125.0, 0.0, 2.7, 0.0)
LATEX = (250.0, 0.0, 1.64, 0.0)
SILICA = (1000.0, 0.0, 1.43, 0.0)


def mixed(*kinds, weight=1.0):
    """Arguments of `crowded`; a second kind that is left out takes no volume."""
    kinds = kinds if len(kinds) == 2 else (*kinds, (*LATEX, 0.0))
    return {"kinds": jnp.array(kinds), "weight": jnp.asarray(weight)}


# Ratio of mu_s to independent scattering, g, and ratio of mu_s (1 - g), for spheres of index n and diameter d
# at 550 nm in 1.5: computed separately for the catalogue of effects, to the digits given there.
CATALOGUE = [
    (PIGMENT, 0.573, 0.05, 0.86, 0.52, 0.97),
    (PIGMENT, 0.573, 0.10, 0.74, 0.46, 0.94),
    (PIGMENT, 0.573, 0.20, 0.55, 0.31, 0.89),
    (PIGMENT, 0.573, 0.30, 0.42, 0.14, 0.86),
    (LATEX, 0.882, 0.10, 0.76, 0.85, 0.94),
    (LATEX, 0.882, 0.20, 0.56, 0.82, 0.87),
    (SILICA, 0.987, 0.10, 0.79, 0.984, 0.97),
    (SILICA, 0.987, 0.20, 0.62, 0.981, 0.94),
]


@pytest.mark.parametrize(("sphere", "g0", "fraction", "ratio", "g", "transport"), CATALOGUE)
def test_crowding_of_three_particles(sphere, g0, fraction, ratio, g, transport):
    (independent, alone, _), (scattering, moments, _) = (
        CROWDED(mixed((*sphere, fraction), weight=weight)) for weight in (0.0, 1.0)
    )
    found = float(scattering[0] / independent[0])
    assert float(alone[1]) == pytest.approx(g0, abs=6e-4)
    assert found == pytest.approx(ratio, abs=0.0051)
    assert float(moments[1]) == pytest.approx(g, abs=0.0051 if g < 0.9 else 6e-4)
    assert found * float((1 - moments[1]) / (1 - alone[1])) == pytest.approx(transport, abs=0.0051)


POINTS = {
    "two kinds": mixed((125.0, 0.01, 2.7, 0.01, 0.1), (250.0, 0.0, 1.64, 0.0, 0.05), weight=0.7),
    "independent": mixed((125.0, 0.0, 2.7, 0.0, 0.2), (250.0, 0.04, 1.43, 0.001, 0.1), weight=0.0),
}


@pytest.mark.parametrize("name", POINTS)
def test_derivatives_of_a_mixture(name):
    point = POINTS[name]
    forward, outputs = jax.tree.map(np.asarray, (SLOPES(point), CROWDED(point)))
    flat, unravel = jax.flatten_util.ravel_pytree(point)
    jacobian = [
        np.concatenate([slope["kinds"].reshape(*output.shape, -1), slope["weight"][..., None]], axis=-1)
        for slope, output in zip(forward, outputs, strict=True)
    ]
    assert all(np.all(np.isfinite(block)) for block in jacobian)
    # Coefficients are of the order of 1e3, all else of 1.
    rng = np.random.default_rng(5)
    weights = [rng.normal(size=output.shape) / np.abs(output).max() for output in outputs]
    pushed = sum(np.tensordot(w, block, 1) for w, block in zip(weights, jacobian, strict=True))
    pulled = jax.flatten_util.ravel_pytree(pulled_back(point, weights))[0]
    np.testing.assert_allclose(pulled, pushed, rtol=1e-8, atol=1e-9 * np.abs(pushed).max())
    steps = np.append(np.tile([1e-4, 2e-8, 1e-6, 1e-7, 1e-6], 2), 1e-5)
    for i, step in enumerate(steps):
        move = step * np.eye(11)[i]
        above, below = (CROWDED(unravel(flat + sign * move)) for sign in (1, -1))
        for k, block in enumerate(jacobian):
            high, low = np.asarray(above[k]), np.asarray(below[k])
            tolerance = 1e-4 * np.abs(block[..., i]).max() + 3e-13 * np.abs(high).max() / step
            difference = (high - low) / (2 * step)
            np.testing.assert_allclose(block[..., i], difference, atol=tolerance, err_msg=f"{k} {i}")


@pytest.mark.parametrize("name", POINTS)
def test_mean_is_one_and_moments_are_those_of_the_value(name):
    _, moments, value = CROWDED(POINTS[name])
    assert np.all(np.asarray(value) > 0)
    values = WEIGHTS / 2 * np.asarray(value)[2:]
    np.testing.assert_allclose(moments, np.polynomial.legendre.legvander(NODES, 39).T @ values, atol=1e-10)
    assert float(moments[0]) == pytest.approx(1, abs=1e-13)


def test_the_coefficient_is_linear_in_the_weight():
    kinds = POINTS["two kinds"]["kinds"]
    none, half, full = (float(CROWDED({"kinds": kinds, "weight": w})[0][0]) for w in (0.0, 0.5, 1.0))
    assert half == pytest.approx((none + full) / 2, rel=1e-12)
    assert full < 0.9 * none


def test_populations_add_and_are_weighted_by_what_they_scatter():
    first, second = (125.0, 2.7 + 0.01j, 0.1), (250.0, 1.64 + 0.001j, 0.05)
    alone = [mie_coefficients(*sphere, BINDER, WAVELENGTH) for sphere in (first, second)]
    mixture = mixture_coefficients(
        tuple(SpherePopulation(monodisperse(r), m, f) for r, m, f in (first, second)), BINDER, WAVELENGTH
    )
    for k in (1, 2):
        assert float(mixture[k]) == pytest.approx(sum(float(a[k]) for a in alone), rel=1e-12)
    share = np.array([float(a[1]) for a in alone]) / float(mixture[1])
    value = share @ np.stack([a.phase_function.value(COSINES) for a in alone])
    np.testing.assert_allclose(mixture.phase_function.value(COSINES), value, rtol=1e-10)
    moments = share @ np.stack([a.phase_function.moments(300) for a in alone])
    np.testing.assert_allclose(mixture.phase_function.moments(300), moments, atol=1e-13)
    # Without interference the general way is the same.
    kinds = [(r, 0.0, m.real, m.imag, f) for r, m, f in (first, second)]
    coefficients, _, general = CROWDED(mixed(*kinds, weight=0.0))
    np.testing.assert_allclose(coefficients, np.array(mixture[1:]), rtol=1e-12)
    np.testing.assert_allclose(general, value, rtol=1e-10)


def test_a_population_divided_in_two_is_the_same():
    whole = CROWDED(mixed((*PIGMENT, 0.2)))
    parts = CROWDED(mixed((*PIGMENT, 0.15), (*PIGMENT, 0.05)))
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-12)


def test_particles_that_are_not_there_have_a_slope():
    nothing = mixed((*PIGMENT, 0.0), (*PIGMENT, 0.0))
    coefficients, moments, _ = CROWDED(nothing)
    np.testing.assert_array_equal(coefficients, 0)
    sphere = mie_coefficients(125.0, 2.7 + 0j, 1.0, BINDER, WAVELENGTH)
    assert float(moments[1]) == pytest.approx(float(sphere.phase_function.asymmetry_parameter), abs=1e-12)
    slope = SLOPES(nothing)[0]["kinds"][0, :, 4]
    np.testing.assert_allclose(slope, float(sphere.scattering_coefficient_per_mm), rtol=1e-10)


def test_spheres_of_the_binders_index_do_not_scatter():
    coefficients, _, value = CROWDED(mixed((125.0, 0.0, BINDER, 0.0, 0.2)))
    assert float(coefficients[0]) == pytest.approx(0, abs=1e-20)
    assert np.all(np.isfinite(value))


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: percus_yevick(1.0, 1.0), "volume_fraction"),
        (lambda: percus_yevick(-1.0, 0.1), "squared_phase"),
        (lambda: mixture_coefficients((), 1.5, 550.0), ""),
        (
            lambda: mixture_coefficients(
                tuple(SpherePopulation(monodisperse(100.0), 2.0, f) for f in (0.6, 0.5)), 1.5, 550.0
            ),
            "1.1",
        ),
        (
            lambda: mixture_coefficients((SpherePopulation(monodisperse(100.0), 2.0, 0.1),), 1.5, 550.0, 1.5),
            "structure_factor_weight",
        ),
        (
            lambda: mixture_coefficients((SpherePopulation(monodisperse(100.0), 2.0, -0.1),), 1.5, 550.0),
            "volume_fraction",
        ),
    ],
)
def test_wrong_values_are_refused_with_a_sentence(make, named, refused):
    with refused(named):
        make()
