"""The relief of a body: energy, reciprocity, limits, and facets counted one by one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.numerics.precision import computing
from jaxink.surfaces.body_series import BodySeries, Mirror
from jaxink.surfaces.facets import FacetExchange
from jaxink.surfaces.relief import Pairs, facet_averages, mirrored_once, reflected_once, seen_from_both


def minnaert(cosine_in, cosine_out):
    """A reciprocal BSDF that is not Lambertian, in 1/sr."""
    return 0.6 / np.pi * (cosine_in * cosine_out) ** 2 + 0.1


def hemisphere(n_polar=16, n_azimuth=12):
    """Cosines, azimuths and projected solid angles that integrate over the hemisphere."""
    (root, weight), (turn, share) = (np.polynomial.legendre.leggauss(n) for n in (n_polar, n_azimuth))
    root, turn = (root + 1) / 2, (turn + 1) / 2 * np.pi
    solid = (root**3 * weight)[:, None] * np.pi * share
    out, azimuth = np.meshgrid(root**2, turn, indexing="ij")
    return out.ravel(), azimuth.ravel(), solid.ravel()


@pytest.fixture(scope="module")
def series():
    return BodySeries.of_any_body()


@pytest.fixture(scope="module")
def lambertian(series):
    with computing():
        return series.coefficients(jnp.full(series.phi_deg.size, 1 / np.pi))[None]


NO_MIRROR = Mirror(np.zeros((1, 3)))


@jax.jit
def relief(pairs, coefficients, mirror, variance):
    """BSDF of a body with a relief, plane for comparison."""
    body = np.zeros(pairs.cosine_in.shape, int)
    once = reflected_once(pairs, body, coefficients, facet_averages(pairs, variance), variance)
    theta = jnp.rad2deg(jnp.arccos(jnp.stack(pairs[:2])))
    exchanged = FacetExchange.of(coefficients, mirror, variance).at(theta, body)
    mirrored = mirrored_once(pairs, jax.tree.map(lambda x: x[body], mirror), variance)
    return once.facets + exchanged + mirrored, once.plane


@pytest.mark.parametrize("variance", [0.01, 0.2])
@pytest.mark.parametrize("theta_deg", [0.0, 50.0, 80.0])
def test_a_relief_of_a_white_body_is_white(lambertian, theta_deg, variance):
    out, azimuth, solid = hemisphere()
    pairs = Pairs(np.full(out.size, np.cos(np.deg2rad(theta_deg))), out, azimuth)
    with computing():
        found, _ = relief(pairs, lambertian, NO_MIRROR, variance)
    assert solid @ np.asarray(found) == pytest.approx(1.0, abs=1e-3)


def test_a_relief_of_mirrors_and_white_ground_is_white(lambertian):
    # Facets mirror 0.2 and return 0.8 diffusely.
    out, azimuth, solid = hemisphere(24, 24)
    pairs = Pairs(np.full(out.size, np.cos(0.6)), out, azimuth)
    with computing():
        mirror = Mirror(np.array([[0.2, 0.0, 0.0]]))
        found, _ = relief(pairs, 0.8 * lambertian, mirror, 0.1)
    assert solid @ np.asarray(found) == pytest.approx(1.0, abs=3e-3)


@pytest.fixture(scope="module")
def some():
    """Pairs at random, on both sides of 90 degrees azimuth."""
    rng = np.random.default_rng(2)
    return Pairs(*rng.uniform(0.1, 1, (2, 192)), rng.uniform(0, np.pi, 192))


@pytest.fixture(scope="module")
def other_body(series):
    cosines = (np.cos(np.deg2rad(a)) for a in (series.theta_i_deg, series.theta_o_deg))
    with computing():
        return series.coefficients(jnp.asarray(minnaert(*cosines)))[None]


def test_it_is_reciprocal(other_body, some):
    mirror = Mirror(np.array([[0.1, -0.05, 0.0]]))
    with computing():
        there, _ = relief(some, other_body, mirror, 0.15)
        back, _ = relief(Pairs(some[1], some[0], some[2]), other_body, mirror, 0.15)
    np.testing.assert_allclose(there, back, rtol=1e-3)


def test_without_slopes_it_is_the_plane_body(other_body, some):
    with computing():
        found, plane = relief(some, other_body, NO_MIRROR, 0.0)
    np.testing.assert_allclose(plane, minnaert(some[0], some[1]), rtol=1e-3)
    np.testing.assert_allclose(found, plane, rtol=1e-6)


def test_its_derivative_at_the_plane_surface_is_that_of_a_small_step(other_body, some):
    with computing():

        @jax.jit
        def of(variance):
            def at(variance):
                averages = facet_averages(some, variance)
                return reflected_once(some, np.zeros(192, int), other_body, averages, variance).facets

            return jax.jvp(at, (variance,), (1.0,))

        start, slope = of(0.0)
        first, second = (of(variance)[0] - start for variance in (1e-5, 2e-5))
    assert np.all(np.isfinite(slope))
    expected = (4 * first - second) / 2e-5
    np.testing.assert_allclose(slope, expected, atol=2e-3 * np.max(np.abs(expected)))


def test_facets_counted_one_by_one(other_body, some):
    """The facet average by brute force over the slope plane."""
    variance, u = 0.2, np.linspace(-6, 6, 401)
    x, y = (np.sqrt(variance) * s for s in np.meshgrid(u, u))
    share = np.exp(-(x**2 + y**2) / (2 * variance)) / (2 * np.pi) * (u[1] - u[0]) ** 2
    up = 1 / np.sqrt(1 + x**2 + y**2)
    few = Pairs(*(column[:8] for column in some))
    with computing():
        averages = facet_averages(few, variance)
        found = reflected_once(few, np.zeros(8, int), other_body, averages, variance).facets
        seen = seen_from_both(few, variance)
    for k, (into, out, azimuth) in enumerate(zip(*few, strict=True)):
        sine_in, sine_out = np.sqrt(1 - into**2), np.sqrt(1 - out**2)
        a = np.maximum(into + sine_in * x, 0) * up
        b = np.maximum(out + sine_out * (np.cos(azimuth) * x + np.sin(azimuth) * y), 0) * up
        expected = np.sum(share * a * b / up * minnaert(a, b)) / (into * out)
        assert found[k] / seen[k] == pytest.approx(expected, rel=1e-3)
