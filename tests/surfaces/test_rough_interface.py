"""A rough interface alone, against an independent Monte Carlo of its facets (simulated)."""

import dataclasses
import json

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.montecarlo import INTERFACE_FILE
from jaxink.optics.channels import ChannelGrid
from jaxink.optics.fresnel import fresnel_reflectance
from jaxink.surfaces.facets import FacetRule
from jaxink.surfaces.interface import RoughSizes, rough_interface
from jaxink.surfaces.slopes import LAWS, AnalyticSlopes, SlopeMixture, slope_density
from jaxink.surfaces.table import FINE, mixture_table, rough_table
from tests.surfaces.densities import gaussian_slopes

AIR, GLASS = jnp.asarray(1.0), jnp.asarray(1.5)
GRID = ChannelGrid(jnp.array([1.0, 1.5]), jnp.array([False, True]), (16, 12))
SIZES = RoughSizes(FacetRule(72, 20), FacetRule(36, 8), 16, coarse_nodes=12)
SIZES_OF_TABLE = dataclasses.replace(FINE, n_outer=16)


@pytest.fixture(scope="module")
def response():
    return eqx.filter_jit(lambda density: rough_interface(GRID, (AIR, GLASS), density, 4, SIZES))


def cases():
    return [
        c for c in json.loads(INTERFACE_FILE.read_text())["cases"] if c["density"] in ("cauchy", "beckmann")
    ]


def test_totals_are_those_of_the_monte_carlo(response):
    """By reciprocity, what leaves along a direction under uniform light is the total for incidence there."""
    worst = {"R": 0.0, "R_single": 0.0}
    for case in cases():
        t = case["t"]
        interface = response(
            gaussian_slopes(t**2) if case["density"] == "beckmann" else AnalyticSlopes(t**2, LAWS["cauchy"])
        )
        inside = case["n_from"] > 1
        kappa = case["n_from"] * np.sin(np.deg2rad(case["theta_i_deg"]))
        row = GRID.interpolation(jnp.array([kappa]))[0]
        for key, part in (("R", interface.total), ("R_single", interface.one)):
            matrix = part.inner_reflection if inside else part.outer_reflection
            found = float(row @ jnp.sum(matrix[0], axis=1))
            worst[key] = max(worst[key], abs(found - case[key]) - 3 * case[f"{key}_se"])
    assert worst["R"] < 2e-3
    assert worst["R_single"] < 4e-4


def test_flat_surface_is_the_smooth_one(response):
    interface = response(gaussian_slopes(0.0)).total
    cosine = [jnp.sqrt(jnp.maximum(GRID.squared_cosine(n), 0.0)) for n in (1.0, 1.5)]
    smooth = np.asarray(fresnel_reflectance(AIR, GLASS, *cosine))
    for matrix in np.asarray(interface.inner_reflection):
        np.testing.assert_allclose(matrix, np.diag(smooth), atol=1e-4)
    passing = np.where(np.asarray(cosine[0]) > 0, 1 - smooth, 0.0)
    for matrix in np.asarray(interface.leaving):
        np.testing.assert_allclose(matrix, np.diag(passing), atol=1e-4)


@pytest.mark.parametrize("sigma_deg", [3.0, 26.0])
def test_no_light_is_lost_along_any_channel(response, sigma_deg):
    """26 degrees: the median facet is tilted by 30."""
    scale = jnp.sqrt(GRID.etendue_weight)
    outer = GRID.squared_cosine(1.0) > 0
    interface = response(gaussian_slopes(np.tan(np.deg2rad(sigma_deg)) ** 2))
    total = interface.of_fluxes(scale, outer, jnp.ones(28, bool)).total
    v, u = jnp.where(outer, scale, 0.0), scale
    from_outside = v @ total.outer_reflection[0] + u @ total.leaving[0].T
    from_inside = u @ total.inner_reflection[0] + v @ total.leaving[0]
    np.testing.assert_allclose(from_outside / scale, outer, atol=1e-12)
    np.testing.assert_allclose(from_inside / scale, 1.0, atol=1e-12)
    # Before that correction: what the facets' quadrature conserves of uniform light.
    before = interface.total
    uniform = jnp.sum(before.outer_reflection[0] + before.leaving[0], axis=1)[:16]
    np.testing.assert_allclose(uniform, 1.0, atol=3e-3)


def test_table_of_angles_is_the_interface_itself():
    table = rough_table(GRID, (AIR, GLASS), (LAWS["beckmann"], (2.0, 12.0)), 4, SIZES_OF_TABLE)
    known = RoughSizes(FacetRule(72, 20), FacetRule(72, 16), 16, coarse_nodes=12)
    smooth_light = jnp.sqrt(GRID.squared_cosine(1.5))

    def leaving(interface):
        return interface.total.leaving[0][:16] @ smooth_light

    expected = leaving(rough_interface(GRID, (AIR, GLASS), slope_density("beckmann", 5.3), 4, known))
    np.testing.assert_allclose(leaving(table.at(jnp.asarray(5.3))), expected, rtol=3e-4)
    forward = jax.jacfwd(lambda s: leaving(table.at(s)))(5.3)
    difference = (leaving(table.at(jnp.asarray(5.31))) - leaving(table.at(jnp.asarray(5.29)))) / 0.02
    np.testing.assert_allclose(forward, difference, atol=1e-5 * float(jnp.max(jnp.abs(forward))) + 1e-9)
    # At the ends of the range, where a search may begin or end, the derivative is that from within.
    for end, inward in ((2.0, 0.01), (12.0, -0.01)):
        at_end, near, far = (leaving(table.at(jnp.asarray(end + k * inward))) for k in range(3))
        difference = (4 * near - 3 * at_end - far) / (2 * inward)
        forward = jax.jacfwd(lambda s: leaving(table.at(s)))(end)
        np.testing.assert_allclose(forward, difference, atol=1e-4 * float(jnp.max(jnp.abs(forward))))


def test_table_of_two_densities_is_the_interface_itself():
    """The densities are tabulated apart; light that meets several facets follows from what both do."""
    ranges = (LAWS["beckmann"], (2.0, 12.0)), (LAWS["ggx"], (10.0, 30.0))
    table = mixture_table(GRID, (AIR, GLASS), ranges, 4, SIZES_OF_TABLE)
    # Both widths in one quadrature need more nodes.
    known = RoughSizes(FacetRule(72, 20), FacetRule(72, 8), 16, coarse_nodes=12)
    smooth_light = jnp.sqrt(GRID.squared_cosine(1.5))

    def leaving(interface):
        return (interface.total.leaving[:2, :16] @ smooth_light).ravel()

    at = jnp.array([5.3, 17.0, 0.3])
    densities = slope_density("beckmann", 5.3), slope_density("ggx", 17.0)
    for share, density in ((0.0, densities[0]), (1.0, densities[1]), (0.3, SlopeMixture(*densities, 0.3))):
        expected = leaving(rough_interface(GRID, (AIR, GLASS), density, 4, known))
        found = leaving(table.at(at[0], at[1], jnp.asarray(share)))
        np.testing.assert_allclose(found, expected, rtol=5e-4)
    slopes = jax.jacfwd(lambda x: leaving(table.at(*x)))(at)
    for k, step in enumerate((0.01, 0.01, 0.001)):
        change = jnp.zeros(3).at[k].set(step)
        difference = (leaving(table.at(*(at + change))) - leaving(table.at(*(at - change)))) / (2 * step)
        np.testing.assert_allclose(slopes[:, k], difference, atol=1e-4 * float(jnp.max(jnp.abs(difference))))
