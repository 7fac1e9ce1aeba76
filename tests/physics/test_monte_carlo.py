"""The solver against photons, and photons against quadratures: benchmarks.montecarlo imports no jaxink.

Seeded. Standard errors are those of 20 batches; 4 of them is the limit everywhere.
"""

import ast
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import montecarlo
from jaxink.optics.directions import Directions
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power, regular_power
from tests.physics.probe import SMALL, ink, printed

LIMIT = 4.0
THETA_DEG = 35.0
ALBEDO, THICKNESS = 0.995, 8.0
LOOKED_AT = montecarlo.Detectors(
    np.tile([10.0, 45.0, 75.0], 4), np.repeat([0.0, 90.0, 180.0, 60.0], 3), np.repeat([False, True], 6)
)


def white_ink(albedo=ALBEDO):
    return printed(ink(1.5, THICKNESS, albedo, 0.6))


@pytest.fixture(scope="module")
def photons():
    """What 40 000 photons make of a plate with a white ink on its exit face."""
    extinction = THICKNESS / 0.08
    phase = montecarlo.HenyeyGreenstein(0.6)
    layer = montecarlo.Layer(1.5, 0.08, ALBEDO * extinction, (1 - ALBEDO) * extinction, phase)
    sample = montecarlo.Sample((montecarlo.Layer(1.5, 1.0), layer))
    return montecarlo.simulate(sample, THETA_DEG, 40_000, seed=11, detectors=LOOKED_AT)


def deviations(batches, expected):
    value, error = montecarlo.Result.mean_and_error(batches)
    return (value - expected) / error


def solved_powers(stack):
    """Diffuse reflectance and transmittance, what is absorbed, and both regular parts."""
    sine = np.sin(np.deg2rad([THETA_DEG]))
    r, t = (float(x[0]) for x in hemispherical_power(stack, sine, SMALL))
    regular_r, regular_t = (float(x[0]) for x in regular_power(stack, sine))
    return {
        "R_diffuse": r - regular_r,
        "T_diffuse": t - regular_t,
        "absorbed": 1 - r - t,
        "R_regular": regular_r,
    }


def test_the_photons_import_nothing_of_the_solver():
    for path in Path(montecarlo.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            assert not [n for n in names if n.startswith(("jax", "equinox"))], path.name


def test_totals(photons):
    for name, expected in solved_powers(white_ink()).items():
        assert abs(deviations(photons.powers[name], expected)) < LIMIT, name


def test_an_albedo_wrong_by_one_per_cent_shows_in_the_totals(photons):
    wrong = solved_powers(white_ink(0.99 * ALBEDO))
    for name in ("R_diffuse", "T_diffuse", "absorbed"):
        assert abs(deviations(photons.powers[name], wrong[name])) > 5 * LIMIT, name


def test_bsdf_at_given_directions(photons):
    points = Directions.from_degrees(
        np.full(12, THETA_DEG), LOOKED_AT.theta_deg, LOOKED_AT.phi_deg, LOOKED_AT.is_transmission
    )
    expected = np.asarray(diffuse_bsdf(white_ink(), points, SMALL))
    assert np.max(np.abs(deviations(photons.bsdf, expected))) < LIMIT
    wrong = np.asarray(diffuse_bsdf(white_ink(0.99 * ALBEDO), points, SMALL))
    assert np.min(np.abs(deviations(photons.bsdf, wrong))) > LIMIT


def test_photons_draw_the_phase_function_that_they_value():
    cosines = np.linspace(-1, 1, 401)
    table = montecarlo.Tabulated(cosines, np.asarray(HenyeyGreenstein(0.5).value(cosines)))
    edges = np.linspace(-1, 1, 9)
    for phase in (montecarlo.HenyeyGreenstein(0.7, -0.4, shares=(0.6, 0.4)), table):
        drawn = phase.draw(40_000, np.random.default_rng(2))
        share = np.histogram(drawn, edges)[0] / drawn.size
        fine = np.linspace(-1, 1, 8001)
        cumulative = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(fine) * _pairs(phase.value(fine)))])
        expected = 2 * np.pi * np.diff(np.interp(edges, fine, cumulative))
        assert expected.sum() == pytest.approx(1.0, rel=1e-5)
        error = np.sqrt(expected * (1 - expected) / drawn.size)
        assert np.max(np.abs(share - expected) / error) < LIMIT


def _pairs(values):
    return values[1:] + values[:-1]


def polar_slopes(facets):
    """Slopes (p along the ray, q across), and weights P(s) ds of a product rule in log(s) and azimuth."""
    radius = np.geomspace(1e-6 * facets.scale, facets.steepest, 2001)
    azimuth = (np.arange(240) + 0.5) * 2 * np.pi / 240
    step = np.log(radius[1] / radius[0])
    weight = 2 * np.pi * facets.density(radius) * radius**2 * step / azimuth.size
    weight[[0, -1]] *= 0.5
    return radius[:, None] * np.cos(azimuth), radius[:, None] * np.sin(azimuth), weight[:, None]


@pytest.mark.parametrize("kind", sorted(montecarlo.DENSITIES))
def test_visible_facets_fill_the_projected_area(kind):
    """The integral of P(s) (i.m)+ / m_z is (1 + Lambda) cos(theta), or |cos(theta)| Lambda from below."""
    facets = montecarlo.Facets(kind, 0.2)
    p, _, weight = polar_slopes(facets)
    assert weight.sum() * p.shape[1] == pytest.approx(1.0, abs=3e-6)
    for theta in np.deg2rad([20.0, 70.0, 88.0, 110.0]):
        seen = np.sum(weight * np.maximum(np.cos(theta) + p * np.sin(theta), 0))
        area = max(np.cos(theta), 0) + facets.excess(np.cos(theta), np.sin(theta))
        assert area == pytest.approx(seen, rel=1e-4)


@pytest.mark.parametrize(
    ("indices", "theta_deg"), [((1.0, 1.5), 60.0), ((1.5, 1.0), 20.0), ((1.5, 1.0), 50.0)]
)
def test_light_after_one_facet_is_a_quadrature(indices, theta_deg):
    facets = montecarlo.Facets("cauchy", np.tan(np.deg2rad(3.2)))
    cosine, sine = np.cos(np.deg2rad(theta_deg)), np.sin(np.deg2rad(theta_deg))
    p, q, weight = polar_slopes(facets)
    rise = 1 / np.sqrt(1 + p**2 + q**2)
    with_facet = np.maximum((cosine + p * sine) * rise, 1e-12)
    met = weight * with_facet / rise / (cosine + facets.excess(cosine, sine))
    reflectance, refracted = montecarlo.fresnel(*indices, with_facet)
    up = 2 * with_facet * rise - cosine
    ratio = indices[0] / indices[1]
    down = ratio * cosine - (ratio * with_facet - refracted) * rise
    expected = [
        np.sum(met * share * facets.escape(away, np.sqrt(np.maximum(1 - away**2, 0))))
        for share, away in ((reflectance, up), (1 - reflectance, down))
    ]
    result = montecarlo.interface_alone(indices, theta_deg, facets, 60_000, seed=3)
    for name, value in zip(("R_single", "T_single"), expected, strict=True):
        assert abs(result[name][0] - value) < LIMIT * result[name][1], name
    assert result["R"][0] + result["T"][0] == pytest.approx(1.0, abs=1e-12)


def test_reference_of_one_interface_is_what_the_script_makes():
    reference = json.loads(montecarlo.INTERFACE_FILE.read_text(encoding="utf-8"))
    for case in reference["cases"]:
        assert case["R"] + case["T"] == pytest.approx(1.0, abs=2e-6)
    case = next(c for c in reference["cases"] if c["density"] == "ggx" and c["theta_i_deg"] == 50)
    facets = montecarlo.Facets("ggx", case["t"])
    result = montecarlo.interface_alone((case["n_from"], case["n_to"]), 50, facets, 60_000, seed=5)
    for name in ("R", "R_single", "T_single"):
        error = np.hypot(result[name][1], case[f"{name}_se"])
        assert abs(result[name][0] - case[name]) < LIMIT * error, name


def test_next_events_through_a_rough_face_add_up_to_the_photons_that_leave():
    """Integral of the BSDF over both hemispheres against counting, all facet events and scatterings in it."""
    sine_squared, weight = np.polynomial.legendre.leggauss(8)
    theta = np.rad2deg(np.arcsin(np.sqrt((sine_squared + 1) / 2)))
    azimuth = (np.arange(8) + 0.5) * 22.5
    grid = [axis.ravel() for axis in np.meshgrid(theta, azimuth, [False, True], indexing="ij")]
    etendue = np.repeat(weight / 2 * np.pi, 16) / 8
    rough = montecarlo.Facets("beckmann", 0.4)
    layer = montecarlo.Layer(1.5, 0.08, 25.0, 1.0, montecarlo.HenyeyGreenstein(0.4))
    sample = montecarlo.Sample((montecarlo.Layer(1.4, 1.0), layer), faces=(None, None, rough))
    result = montecarlo.simulate(sample, 30.0, 5_000, seed=4, detectors=montecarlo.Detectors(*grid))
    for name, side in (("R", ~grid[2]), ("T", grid[2])):
        counted = result.powers[f"{name}_diffuse"] + result.powers[f"{name}_surface"]
        difference = etendue[side] @ result.bsdf[side] - counted
        assert abs(deviations(difference, 0.0)) < LIMIT, name
        assert difference.std(ddof=1) / 20**0.5 < 0.04 * counted.mean()


def test_light_seen_near_the_axis():
    ink_layer = montecarlo.Layer(1.5, 0.08, 95.0, 1.1, montecarlo.HenyeyGreenstein(0.6))
    whole = montecarlo.Sample((montecarlo.Layer(1.5, 1.0), ink_layer))
    wide = dataclasses.replace(whole, seen_radius_mm=1e6)
    all_of_it, all_seen = (
        montecarlo.simulate(sample, THETA_DEG, 2_000, seed=5, detectors=LOOKED_AT).bsdf
        for sample in (whole, wide)
    )
    assert all_seen == pytest.approx(all_of_it, rel=1e-6)
    # A ring is seen by counting, too; in it, the BSDF hardly depends on the direction.
    disc = dataclasses.replace(whole, beam_radius_mm=1.0, seen_radius_mm=2.0)
    edges = [np.array([40.0, 50.0]), np.array([80.0, 100.0])]
    middle = montecarlo.Detectors(np.full(2, 45.2), np.full(2, 90.0), np.array([False, True]))
    counted = montecarlo.simulate(disc, THETA_DEG, 200_000, seed=6, ring_edges=edges).rings[:, 0, 0]
    (sent, error), (seen, its_error) = (
        montecarlo.Result.mean_and_error(batches)
        for batches in (montecarlo.simulate(disc, THETA_DEG, 40_000, seed=7, detectors=middle).bsdf, counted)
    )
    assert np.all(np.abs(sent - seen) < LIMIT * np.hypot(error, its_error))
    unseen = montecarlo.simulate(whole, THETA_DEG, 40_000, seed=7, detectors=middle).bsdf.mean(-1)
    assert np.all(sent < 0.9 * unseen)


def test_light_near_the_axis_is_not_followed_through_unlike_layers():
    unlike = montecarlo.Sample((montecarlo.Layer(1.5, 1.0), montecarlo.Layer(1.6, 0.1)), seen_radius_mm=1.0)
    with pytest.raises(ValueError, match="one index"):
        montecarlo.simulate(unlike, 0.0, 20, detectors=LOOKED_AT)
