"""Paths at sheets, in dots and through the guide, against the table, the solver and each other."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.ink.hemispherical_totals import diffuse_totals
from jaxink.ink.lobes import COMPONENTS
from jaxink.optics.fresnel import fresnel_reflectance
from jaxink.render import Guide, RenderedInk
from jaxink.render.dots import SheetDots, VolumeDots
from jaxink.render.guide_paths import BINS, HEMISPHERE, NORMAL, guide_batch
from jaxink.render.sheet_sampling import INSIDE, OUTSIDE, SheetSampler
from jaxink.render.smooth_faces import fresnel, refracted
from tests.render.inks import PRINTED

N = 40_000


def total(table, component, theta_deg):
    """Power of a component, diffuse and regular."""
    c = COMPONENTS.index(component)
    return np.interp(theta_deg, table.theta_deg, diffuse_totals(table)[c, 0] + table.regular[c, 0])


def along(theta_deg, n=N):
    theta = np.deg2rad(theta_deg)
    return np.tile([np.sin(theta), 0.0, -np.cos(theta)], (n, 1))


@pytest.mark.parametrize("theta_deg", [0.0, 40.0, 70.0])
@pytest.mark.parametrize(("side", "names"), [(INSIDE, ("R_II", "T_IA")), (OUTSIDE, ("R_AA", "T_AI"))])
def test_sampled_power_is_that_of_the_table(ink, side, names, theta_deg):
    drawn = SheetSampler(ink.table).scatter(side, np.full(N, np.deg2rad(theta_deg)), np.random.default_rng(3))
    for name, transmitted in zip(names, (False, True), strict=True):
        weight = np.where(drawn.goes_on & (drawn.is_transmitted == transmitted), drawn.weight[:, 0], 0.0)
        error = weight.std() / np.sqrt(N)
        # Cells are a little coarser than the exact integral.
        assert weight.mean() == pytest.approx(total(ink.table, name, theta_deg), abs=4 * error + 0.003)


def test_directions_follow_the_table(ink):
    """Mean cosine of the reflected light, against quadrature of the interpolated table."""
    theta_deg, sampler = 50.0, SheetSampler(ink.table)
    drawn = sampler.scatter(INSIDE, np.full(N, np.deg2rad(theta_deg)), np.random.default_rng(4))
    back = drawn.goes_on & ~drawn.is_transmitted
    weight = drawn.weight[back, 0]
    forward = np.sin(drawn.theta_o[back]) * np.cos(drawn.phi[back])
    theta, phi = np.deg2rad(np.linspace(0.1, 89.9, 400)), np.deg2rad(np.linspace(0, 180, 181))
    o, p = np.meshgrid(theta, phi, indexing="ij")
    power = ink.table.interpolated("R_II", theta_deg, np.rad2deg(o), np.rad2deg(p)) * np.sin(o) * np.cos(o)
    expected = np.sum(power * np.sin(o) * np.cos(p)) / np.sum(power)
    assert np.average(forward, weights=weight) == pytest.approx(expected, abs=0.01)
    # No handedness.
    assert np.average(np.sin(drawn.phi[back]), weights=weight) == pytest.approx(0.0, abs=0.02)


def test_scattering_in_a_wide_dot_agrees_with_the_solver(ink):
    """The walk shares nothing with the solver but the coefficients."""
    wide = Guide(pitch_mm=30.0, first_radius_mm=14.0, last_radius_mm=14.0)
    for theta_deg in (0.0, 60.0):
        middle = np.tile([15.0, 15.0, 0.0], (N, 1))
        after = VolumeDots(ink.medium, 0).visit(wide, middle, along(theta_deg), np.random.default_rng(5))
        expected = total(ink.table, "R_II", theta_deg)
        assert after.goes_on.mean() == pytest.approx(expected, abs=4 * 0.5 / np.sqrt(N))
        assert np.all(after.direction[after.goes_on, 2] > 0)
        assert np.allclose(np.linalg.norm(after.direction, axis=1), 1)


def test_light_is_lost_through_the_rim_of_a_thick_dot(ink):
    """What leaves through the rim and enters the plate from below is not guided."""
    guided = []
    for pitch, radius in ((1.0, 0.45), (1.0, 0.015)):
        guide = Guide(pitch_mm=pitch, first_radius_mm=radius, last_radius_mm=radius)
        middle = np.tile([pitch / 2, pitch / 2, 0.0], (N, 1))
        after = VolumeDots(ink.medium, 0).visit(guide, middle, along(60.0), np.random.default_rng(5))
        guided.append(np.mean(after.goes_on & (after.direction[:, 2] < np.sqrt(1 - 1 / 1.5**2))))
    assert guided[1] < 0.9 * guided[0]


def test_smooth_faces_are_those_of_snell_and_fresnel():
    cosine = np.linspace(0.1, 1.0, 20)
    for ratio in (1.5, 1 / 1.5):
        sine = ratio * np.sqrt(1 - cosine**2)
        expected = np.asarray(
            fresnel_reflectance(*map(jnp.asarray, (ratio, 1.0, cosine, np.sqrt(np.maximum(1 - sine**2, 0)))))
        )
        assert np.allclose(fresnel(cosine, ratio)[sine < 1], expected[sine < 1])
        assert np.all(fresnel(cosine, ratio)[sine >= 1] == 1)
    (down,) = refracted(along(30.0, 1), 2, 1.5)
    assert np.hypot(*down[:2]) == pytest.approx(0.75)
    assert down[2] == pytest.approx(-np.sqrt(1 - 0.75**2))


@pytest.mark.parametrize("view", [NORMAL, HEMISPHERE])
def test_sheets_and_thin_volumes_light_the_same_guide(ink, view):
    guide, n = Guide(), 12
    seen = [
        guide_batch(guide, dots, view, n, np.random.default_rng(6))
        for dots in (SheetDots(SheetSampler(ink.table)), VolumeDots(ink.medium, 0))
    ]
    assert seen[0].shape == (guide.rows * BINS, guide.columns * BINS, 1)
    one, other = (picture.mean() for picture in seen)
    error = np.sqrt((one + other) / seen[0].size / n)
    assert one == pytest.approx(other, abs=3.5 * error)
    assert error < 0.05 * one


def test_many_paths_are_traced_in_parts_of_equal_weight_per_path(ink, monkeypatch):
    numbers, guide = [], Guide()
    bins = guide.rows * BINS * guide.columns * BINS

    def traced(_guide, _dots, _view, n, _random):
        numbers.append(n)
        return np.full((1, 1, 1), float(n))

    monkeypatch.setattr("jaxink.render.guide_paths._traced", traced)
    monkeypatch.setattr("jaxink.render.guide_paths._MOST_PATHS", 5 * bins)
    mean = guide_batch(guide, SheetDots(SheetSampler(ink.table)), NORMAL, 12, np.random.default_rng(1))
    assert numbers == [5, 5, 2]
    assert mean == pytest.approx((5 * 5 + 5 * 5 + 2 * 2) / 12)


def test_without_dots_that_scatter_nothing_is_seen(ink):
    """Light from the edge is totally reflected by the faces of the plate."""
    black = dataclasses.replace(
        ink.table, bsdf_per_sr=0 * ink.table.bsdf_per_sr, regular=0 * ink.table.regular
    )
    seen = guide_batch(Guide(), SheetDots(SheetSampler(black)), HEMISPHERE, 5, np.random.default_rng(7))
    assert not seen.any()


def test_weights_make_every_wavelength_right(tmp_path):
    """Paths are drawn by the mean over the wavelengths, of which one is absorbed much more."""
    text = PRINTED.replace("wavelength_nm = 550", "wavelength_nm = [450, 550]")
    text = text.replace(
        "absorption_per_mm = 4", "absorption_per_mm = { per_wavelength = true, value = [60, 4] }"
    )
    (tmp_path / "two.toml").write_text(text, encoding="utf-8")
    table = RenderedInk.of(tmp_path / "two.toml").table
    drawn = SheetSampler(table).scatter(INSIDE, np.full(N, np.deg2rad(50.0)), np.random.default_rng(8))
    back = (drawn.goes_on & ~drawn.is_transmitted)[:, None]
    seen = np.where(back, drawn.weight, 0.0)
    c = COMPONENTS.index("R_II")
    expected = [
        np.interp(50.0, table.theta_deg, diffuse_totals(table)[c, w] + table.regular[c, w]) for w in (0, 1)
    ]
    assert expected[1] > 1.3 * expected[0]
    assert np.allclose(seen.mean(axis=0), expected, atol=4 * seen.std(axis=0).max() / np.sqrt(N) + 0.003)
