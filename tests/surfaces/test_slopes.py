import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from jaxink.sample import schema
from jaxink.surfaces.facets import FacetRule, projected_area
from jaxink.surfaces.slopes import DENSITIES, LAWS, AnalyticSlopes, SlopeMixture, slope_density
from tests.surfaces.densities import gaussian_slopes


def of_law(name, scale):
    return AnalyticSlopes(scale**2, LAWS[name])


def test_sample_files_name_the_densities_that_exist():
    assert set(schema.ROUGHNESS_DENSITIES) == set(DENSITIES)


@pytest.mark.parametrize("sigma_deg", [0.5, 4.0, 25.0])
@pytest.mark.parametrize("name", DENSITIES)
def test_densities_are_normalised(name, sigma_deg):
    density = slope_density(name, sigma_deg)
    t, end = float(density.scale), float(density.largest_slope)
    breaks = [0, *[e for e in np.geomspace(t / 100, end, 12) if e < end], end]
    parts = [
        quad(lambda s: 2 * np.pi * float(density.radial(jnp.asarray(s))), a, b, epsrel=1e-9)[0]
        for a, b in zip(breaks[:-1], breaks[1:], strict=True)
    ]
    assert sum(parts) == pytest.approx(1, abs=3e-8)


def test_constants_of_densities():
    """Closed forms: Gauss, Walter and others 2007 eq. 33, and the constants of the simulated measurements."""
    t, s = np.tan(np.deg2rad(3.2)), 0.1
    gauss = np.exp(-(s**2) / (2 * t**2)) / (2 * np.pi * t**2)
    np.testing.assert_allclose(gaussian_slopes(t**2).density(jnp.asarray(s)), gauss, rtol=1e-6)
    # What the cut-off leaves out is of the order of (t / 100)^2.
    np.testing.assert_allclose(
        of_law("ggx", t).density(jnp.asarray(s)), t**2 / (np.pi * (t**2 + s**2) ** 2), rtol=1e-5
    )
    norm = 1 / (np.pi * t**2 * (-np.log(t**2) / (1 - t**2) ** 2 - 1 / (1 - t**2)))
    cauchy = norm / ((1 + s**2) ** 2 * (1 + s**2 / t**2))
    np.testing.assert_allclose(of_law("cauchy", t).density(jnp.asarray(s)), cauchy, rtol=1e-5)
    plane = of_law("cauchy2d", t)
    assert plane.density(jnp.asarray(5.6)) > 0
    assert plane.density(jnp.asarray(5.7)) == 0


def test_smith_masking_of_gaussian_slopes():
    """Closed form of Smith 1967: Lambda = exp(-v^2) / (2 v sqrt(pi)) - erfc(v) / 2, v = cot / (t sqrt 2)."""
    from scipy.special import erfc

    t, theta = 0.3, np.deg2rad([5.0, 40.0, 70.0, 85.0])
    v = 1 / (np.tan(theta) * t * np.sqrt(2))
    smith = np.exp(-(v**2)) / (2 * v * np.sqrt(np.pi)) - erfc(v) / 2
    area = projected_area(
        jnp.cos(theta), jnp.sin(theta), gaussian_slopes(t**2), FacetRule(48, 24).without_total_reflection
    )
    np.testing.assert_allclose(area, (1 + smith) * np.cos(theta), rtol=2e-5)


def test_mixture_is_between():
    first, second, s = gaussian_slopes(0.01), of_law("ggx", 0.3), jnp.asarray(0.2)
    half = SlopeMixture(first, second, 0.5).density(s)
    np.testing.assert_allclose(half, (first.density(s) + second.density(s)) / 2, rtol=1e-7)


def test_variance_is_a_coordinate_of_the_flat_surface():
    """An average over Gaussian facets has a finite derivative, not zero, in their variance, even of 0."""
    theta = jnp.deg2rad(jnp.array([60.0]))

    def visible_tilt(strength):
        # Smooth in the facet and zero for flat ones: the mean of 1 - m_z over the facets.
        slopes, weights = np.polynomial.legendre.leggauss(400)
        here = gaussian_slopes(strength)
        reach = jnp.arcsinh(here.largest_slope / here.scale)
        v = (slopes + 1) / 2 * reach
        s = here.scale * jnp.sinh(v)
        step = weights / 2 * reach * here.scale * jnp.cosh(v)
        return 2 * jnp.pi * jnp.sum(step * here.radial(s) * (1 - 1 / jnp.sqrt(1 + s**2)))

    slope = jax.grad(visible_tilt)(0.0)
    rise = (visible_tilt(1e-4) - visible_tilt(0.0)) / 1e-4
    assert np.isfinite(slope)
    assert slope > 0.1
    np.testing.assert_allclose(slope, rise, rtol=0.05)
    assert np.isfinite(
        jax.grad(
            lambda x: projected_area(jnp.cos(theta), jnp.sin(theta), gaussian_slopes(x), FacetRule())[0]
        )(0.0)
    )


def test_a_density_smooth_in_the_angle_at_the_flat_surface():
    for name in DENSITIES:
        assert np.isfinite(jax.grad(lambda x, n=name: slope_density(n, x).density(0.1))(0.0))
