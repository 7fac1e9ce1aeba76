"""Boundaries alone: totals, reciprocity across the index step, and the smooth limit."""

import dataclasses
import json

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.montecarlo.facets import Facets
from benchmarks.montecarlo.interface import interface_alone
from benchmarks.validation.published import boundary
from jaxink.export import write
from jaxink.ink import read_ink_table
from jaxink.ink.boundary import BoundaryOptions, facet_boundary, wave_boundary, within_incident_power
from jaxink.ink.hemispherical_totals import diffuse_totals, power_sent_out
from jaxink.ink.table import COMPONENTS
from jaxink.numerics.precision import computing
from jaxink.surfaces.height_map import HeightMap, TabulatedSlopes
from jaxink.surfaces.slopes import slope_density
from jaxink.surfaces.spectrum import GaussianSpectrum
from jaxink.surfaces.wave_power import balance
from jaxink.surfaces.wave_surface import WaveSurface
from tests.surfaces.densities import gaussian_slopes

OPTIONS = BoundaryOptions(1.5, 1.0, n_theta=61, n_phi=37)
WAVES = GaussianSpectrum(0.05**2, 1.2)


@pytest.fixture(scope="module")
def facets():
    return facet_boundary(gaussian_slopes(0.3**2), [550.0], BoundaryOptions(1.5, 1.0, n_theta=121, n_phi=61))


@pytest.fixture(scope="module")
def waves():
    return wave_boundary(WAVES, [450.0, 650.0], OPTIONS)


@pytest.fixture(params=["facets", "waves"])
def table(request):
    return request.getfixturevalue(request.param)


def test_reciprocity_has_the_square_of_the_index(table):
    r_ii, t_ia, t_ai, r_aa = table.bsdf_per_sr
    for reflected in (r_ii, r_aa):
        np.testing.assert_allclose(reflected, np.swapaxes(reflected, 1, 2), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(t_ia / 1.0**2, np.swapaxes(t_ai, 1, 2) / 1.5**2, rtol=1e-6, atol=1e-9)
    assert t_ia.max() > 0.1


@pytest.mark.parametrize(("law", "sigma_deg"), [("cauchy", 3.2), ("ggx", 10.0)])
def test_facets_send_out_all_power_at_any_incidence(law, sigma_deg):
    with computing():
        density = slope_density(law, sigma_deg)
    table = facet_boundary(density, [550.0], BoundaryOptions(1.5, 1.0, n_theta=41, n_phi=19))
    assert not table.regular.any()
    assert power_sent_out(table) == pytest.approx(1.0, abs=1e-5)
    least, largest = (float(n) for n in table.attrs["power_of_table"].split(" ... "))
    assert 0.99999 <= least <= largest <= 1.00001
    # Between the angles as well: the rest is linear, and the lobes are in closed form.
    finer = np.array([12.0, 33.0, 47.0, 58.0])
    lobes = dataclasses.replace(
        table.lobes,
        theta_deg=np.unique([*table.theta_deg, *finer]),
        passage=np.apply_along_axis(
            lambda row: np.interp(np.unique([*table.theta_deg, *finer]), table.theta_deg, row),
            -1,
            table.lobes.passage,
        ),
    )
    apart = dataclasses.replace(table, lobes=None, bsdf_per_sr=table.rest_per_sr)
    for first, second in (("R_II", "T_IA"), ("R_AA", "T_AI")):
        at = np.searchsorted(lobes.theta_deg, finer)
        once = sum(lobes.totals(name, 0)[at] for name in (first, second))
        several = diffuse_totals(apart)[[COMPONENTS.index(name) for name in (first, second)], 0].sum(axis=0)
        total = once + np.interp(finer, table.theta_deg, several)
        np.testing.assert_allclose(total, 1.0, atol=0.01)


def test_facets_are_those_that_rays_meet(facets):
    # Rays from facet to facet: reflected and transmitted power, and what met only one facet.
    totals = diffuse_totals(facets)[:, 0]
    once = np.array([facets.lobes.totals(name, 0) for name in COMPONENTS])
    met = Facets("beckmann", 0.3)
    for indices, reflected, transmitted in (((1.5, 1.0), 0, 1), ((1.0, 1.5), 3, 2)):
        for theta_deg in (20.0, 60.0):
            rays = interface_alone(indices, theta_deg, met, 60_000, seed=7)
            for name, component in (("R", reflected), ("T", transmitted)):
                for suffix, found in (("", totals), ("_single", once)):
                    value, error = rays[name + suffix]
                    at = np.interp(theta_deg, facets.theta_deg, found[component])
                    assert abs(at - value) < 4 * error + 5e-4
    assert facets.attrs["share_of_several"] > 0.15


def test_light_from_several_facets_leaves_where_rays_do(facets):
    # From inside at 60 degrees, a fifth of the light meets several facets; its share in each ring of exits.
    edges = np.arange(0.0, 91.0, 15.0)
    once = dataclasses.replace(facets, bsdf_per_sr=facets.bsdf_per_sr - facets.rest_per_sr, lobes=None)
    assert np.max(np.abs(once.bsdf_per_sr)) > 0
    rays = interface_alone((1.5, 1.0), 60.0, Facets("beckmann", 0.3), 100_000, seed=11, edges_deg=edges)
    for name, component in (("R", "R_II"), ("T", "T_IA")):
        value, error = rays[f"{name}_bsdf"]
        for low, high, mean, step in zip(edges[:-1], edges[1:], value, error, strict=True):
            theta = np.linspace(low, high, 61)
            phi = np.linspace(0.0, 180.0, 91)
            bsdf = facets.interpolated(component, 60.0, theta[:, None], phi)
            mean_bsdf = np.trapezoid(
                np.trapezoid(bsdf, phi, axis=1) / 180 * np.sin(2 * np.deg2rad(theta)), theta
            )
            mean_bsdf /= np.trapezoid(np.sin(2 * np.deg2rad(theta)), theta)
            assert mean_bsdf == pytest.approx(mean, abs=4 * step + 0.02 * mean)


def test_wave_table_has_the_power_of_the_theory(waves):
    totals = diffuse_totals(waves)
    for w, wavelength in enumerate(waves.wavelength_nm):
        for first, (front, back) in ((0, (1.5, 1.0)), (2, (1.0, 1.5))):
            i = np.argmin(np.abs(waves.theta_deg - 25))
            with computing():
                cosine = jnp.cos(jnp.deg2rad(waves.theta_deg[i]))
                expected = balance(WaveSurface(WAVES, front, back, wavelength), cosine)
            reflected, transmitted = (first, first + 1) if first == 0 else (first + 1, first)
            scattered = totals[[reflected, transmitted], w, i]
            np.testing.assert_allclose(
                scattered, [expected.scattered_reflected, expected.scattered_transmitted], rtol=0.02
            )
            np.testing.assert_allclose(
                waves.regular[[reflected, transmitted], w, i],
                [expected.regular_reflected, expected.regular_transmitted],
                rtol=1e-10,
            )


def test_shorter_waves_leave_less_regular_light(waves):
    assert np.all(waves.regular[:, 0, 0] < waves.regular[:, 1, 0])


def test_no_roughness_is_fresnel_only():
    for table in (
        facet_boundary(gaussian_slopes(0.0), [550.0], OPTIONS),
        wave_boundary(GaussianSpectrum(0.0, 1.2), [550.0], OPTIONS),
    ):
        assert not table.bsdf_per_sr.any()
        np.testing.assert_allclose(table.regular[:, 0, 0], [0.04, 0.96, 0.96, 0.04], rtol=1e-10)
        beyond = table.theta_deg > np.rad2deg(np.arcsin(1 / 1.5))
        np.testing.assert_allclose(table.regular[0, 0, beyond], 1.0)
        np.testing.assert_allclose(table.regular[1, 0, beyond], 0.0, atol=1e-12)
        np.testing.assert_allclose(power_sent_out(table), 1.0, rtol=1e-10)


def test_table_can_be_written(waves, tmp_path, refused):
    again = read_ink_table(waves.to_netcdf(tmp_path / "boundary.nc"))
    np.testing.assert_array_equal(again.bsdf_per_sr, waves.bsdf_per_sr)
    assert again.attrs["power_of_table"] == waves.attrs["power_of_table"]
    # The theory gains power near grazing, which no ray tracer takes.
    with refused():
        write(waves, "csv", tmp_path)
    assert all(path.exists() for path in write(within_incident_power(waves), "csv", tmp_path))


def test_limited_power_keeps_reciprocity(waves):
    limited = within_incident_power(waves)
    assert power_sent_out(waves).max() > 1.01
    assert power_sent_out(limited).max() < 1 + 1e-8
    assert 0.9 < limited.attrs["least_power_factor"] < 1
    r_ii, t_ia, t_ai, _ = limited.bsdf_per_sr
    np.testing.assert_allclose(r_ii, np.swapaxes(r_ii, 1, 2), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(t_ia, np.swapaxes(t_ai, 1, 2) / 1.5**2, rtol=1e-6, atol=1e-9)


def test_measured_surface_by_both_optics(facets, waves):
    # Simulated heights: the table of what was measured is that of the spectrum they were made of.
    frequency = np.hypot(*np.meshgrid(*[np.fft.fftfreq(512, 0.15)] * 2))
    noise = np.fft.fft2(np.random.default_rng(8).standard_normal((512, 512)))
    amplitudes = np.sqrt(np.asarray(WAVES.density_um4(frequency))) / 0.15
    heights = HeightMap(np.fft.ifft2(noise * amplitudes).real, 0.15)
    with computing():
        measured = heights.slope_density()
        steeper = 0.3 / np.sqrt(heights.slope_statistics().variance)
        slopes = TabulatedSlopes(steeper, measured.slopes, measured.log_density)
        spectrum = heights.power_spectrum()
    options = BoundaryOptions(1.5, 1.0, n_theta=121, n_phi=61)
    for table, expected in (
        (facet_boundary(slopes, [550.0], options), facets),
        (wave_boundary(spectrum, [450.0, 650.0], OPTIONS), waves),
    ):
        # In the plane of incidence, light from air; the specular direction is an entry.
        i = np.argmin(np.abs(expected.theta_deg - 10))
        found, wanted = (t.bsdf_per_sr[3, 0, i, :, -1] for t in (table, expected))
        bright = (wanted > 0.3 * wanted.max()) & (expected.theta_deg < 50)
        assert bright[i]
        np.testing.assert_allclose(found[bright], wanted[bright], rtol=0.15)


def test_a_spectrum_made_in_32_bits_is_tabulated_in_64():
    options = BoundaryOptions(1.5, 1.0, n_theta=9, n_phi=5)
    numbers = [float(np.float32(number)) for number in (0.0025, 1.2)]
    made_in_32 = GaussianSpectrum(*numbers)
    with computing():
        made_in_64 = GaussianSpectrum(*numbers)
    found, wanted = (wave_boundary(made, [550.0], options) for made in (made_in_32, made_in_64))
    np.testing.assert_array_equal(found.bsdf_per_sr, wanted.bsdf_per_sr)
    np.testing.assert_array_equal(found.regular, wanted.regular)


def test_wrong_options_are_refused(refused):
    with refused("index_outside"):
        facet_boundary(gaussian_slopes(0.01), [550.0], BoundaryOptions(1.5, 0.0))
    with refused("450"):
        facet_boundary(gaussian_slopes(0.01), [550.0, 450.0], OPTIONS)
    with refused("amplitude"):
        BoundaryOptions(1.5, 1.0, amplitude="kirchhoff")


def test_a_joined_boundary_is_the_relief_in_the_stack():
    # Sample 2 of the published protocols, as kept by the script that writes their page.
    kept = json.loads(boundary.FILE.read_text(encoding="utf-8"))
    joined, whole = (np.array(kept[name]["bsdf"]) for name in (boundary.BOUNDARY, boundary.WHOLE))
    rms = np.sqrt(np.mean((joined / whole - 1) ** 2, axis=(1, 2)))
    assert np.all(rms < 0.015)
    assert kept[boundary.BOUNDARY]["power"] == pytest.approx([1.0, 1.0], abs=0.01)
