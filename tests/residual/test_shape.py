"""The shape of a residual: planted modes are found, broken symmetries are told, noise has none."""

import re

import numpy as np
import pytest

from jaxink.residual import ResidualPoints, residual_shape
from jaxink.residual.modes import modes_for, zernike_radial

SIGMA = 0.01


def hemisphere(scans=(0.0, 30.0, 60.0, 75.0), side=False, wavelengths=(550.0,)):
    """Directions all over the hemisphere, with mirror images and reciprocal pairs."""
    theta_o = np.array([*scans, 15.0, 45.0, 80.0])
    phi = np.array([-150.0, -110.0, -70.0, -30.0, 0.0, 30.0, 70.0, 110.0, 150.0, 180.0])
    grid = np.meshgrid(wavelengths, scans, theta_o, phi, indexing="ij")
    nm, theta_i, theta_o, phi = (x.ravel() for x in grid)
    kept = ~((theta_o == 0) & (phi != 0))
    return theta_i[kept], theta_o[kept], phi[kept], nm[kept], np.full(kept.sum(), side)


def plane(scans=(0.0, 20.0, 40.0, 60.0)):
    theta_i, signed = (x.ravel() for x in np.meshgrid(scans, np.arange(-80.0, 81, 4), indexing="ij"))
    phi = np.where(signed < 0, 0.0, 180.0)
    return theta_i, np.abs(signed), phi, np.full(signed.size, 550.0), np.zeros(signed.size, bool)


def points_of(columns, relative, scan_relative=0.0, seed=3):
    theta_i, theta_o, phi, nm, side = columns
    _, scan = np.unique(np.stack([theta_i, nm, side], axis=1), axis=0, return_inverse=True)
    rng = np.random.default_rng(seed)
    noise = SIGMA * rng.standard_normal(theta_i.size)
    noise = noise + scan_relative * rng.standard_normal(scan.max() + 1)[scan.reshape(-1)]
    total, sigma, weight = relative + noise, np.full(theta_i.size, SIGMA), np.ones(theta_i.size)
    base = ResidualPoints(*columns, scan.reshape(-1), total, sigma, scan_relative, np.zeros(0), weight)
    whitened = ResidualPoints(
        *columns, scan.reshape(-1), total, sigma, scan_relative, np.zeros(theta_i.size), weight
    ).whiten(total[:, None])[:, 0]
    return ResidualPoints(**{**vars(base), "whitened": whitened})


def sines(columns):
    return (np.sin(np.deg2rad(angle)) for angle in columns[:2])


def test_radial_polynomials_are_zernike_polynomials():
    # Born, Wolf 1999 Principles of Optics, table 9.1.
    r = np.linspace(0, 1, 9)
    np.testing.assert_allclose(zernike_radial(4, 2, r), 4 * r**4 - 3 * r**2, atol=1e-14)
    np.testing.assert_allclose(zernike_radial(4, 0, r), 6 * r**4 - 6 * r**2 + 1, atol=1e-14)
    np.testing.assert_allclose(zernike_radial(5, 1, r), 10 * r**5 - 12 * r**3 + 3 * r, atol=1e-14)


@pytest.mark.parametrize("columns", [hemisphere(), plane()], ids=["hemisphere", "plane"])
def test_modes_in_reflection_are_reciprocal_and_isotropic(columns):
    theta_i, theta_o, phi, nm, side = columns
    here = points_of(columns, np.zeros(theta_i.size))
    # Source and detector exchanged, and all turned half around the normal.
    there = points_of((theta_o, theta_i, -phi, nm, side), np.zeros(theta_i.size))
    for mode in modes_for(here):
        np.testing.assert_allclose(mode.values(here), mode.values(there), atol=1e-12)


def test_a_known_shape_is_found_with_its_amplitudes():
    columns = hemisphere()
    of_i, of_o = sines(columns)
    # (sin sin sin phi)^2 is a sum of four of the modes of up to second order.
    relative = -0.06 * (of_i * of_o * np.sin(np.deg2rad(columns[2]))) ** 2
    found = residual_shape(points_of(columns, relative))
    assert found.share > 0.9
    assert found.p_value < 1e-6
    assert {m.mode.order for m in found.modes} <= {0, 2}
    at = {(m.mode.n, m.mode.m, m.mode.azimuthal_order): m for m in found.modes}
    lead = at[2, 2, 2]
    assert abs(lead.amplitude[0] - 0.03) < 4 * lead.standard_error[0]
    np.testing.assert_allclose(found.relative, relative, atol=4 * SIGMA / np.sqrt(20))
    assert not any(a.is_significant for a in found.asymmetries)
    assert list(found.to_frame()["amplitude"]) == [m.amplitude[0] for m in found.modes]


def test_noise_has_no_shape():
    p_values = [residual_shape(points_of(hemisphere(), 0.0, seed=s)).p_value for s in range(40)]
    # Uniform: three standard deviations of a mean of 40.
    assert abs(np.mean(p_values) - 0.5) < 3 / np.sqrt(12 * 40)


def test_what_parameters_reproduce_is_not_part_of_the_shape():
    columns = hemisphere()
    level = np.full((columns[0].size, 1), 1 / np.sqrt(columns[0].size))
    points = points_of(columns, np.full(columns[0].size, 0.05))
    assert residual_shape(points).share > 0.9
    assert not residual_shape(points, level).modes


def shares_in(sentence):
    return [int(share) for share in re.findall(r"(\d+) %", sentence)]


def test_one_statement_says_how_much_is_smooth_and_how_much_of_that_is_broad():
    columns = plane()
    of_view = columns[1] * np.where(columns[2] < 90, -1, 1)
    broad = 0.05 * np.sin(np.deg2rad(columns[1])) ** 2
    fine = 0.05 * np.sin(2 * np.pi * of_view / 20)
    points = points_of(columns, broad + fine)
    found = residual_shape(points, structured=0.97)
    # All that exceeds the noise is smooth: 0.97 of the mean square, which is larger by its noise.
    assert found.smooth_share == pytest.approx(min(1, 0.97 * np.sum(points.whitened**2) / found.excess))
    first = found.sentence.split(". ")[0]
    whole, part, *_ = shares_in(first)
    other = int(re.search(r"the other (\d+) %", first)[1])
    assert (whole, part) == (round(100 * found.smooth_share), round(100 * found.share))
    assert whole == part + other
    assert "finer scale" in first
    assert found.sentence.count("finer scale") == 1
    # The modes are smooth themselves.
    assert residual_shape(points, structured=0.0).smooth_share == found.share
    alone = residual_shape(points)
    assert alone.smooth_share is None
    assert shares_in(alone.sentence)[0] == round(100 * alone.share)


def test_a_tilt_is_told_from_a_property_of_an_isotropic_sample():
    columns = hemisphere()
    of_i, of_o = sines(columns)
    points = points_of(columns, 0.02 * of_o * np.sin(np.deg2rad(columns[2])))
    mirror = next(a for a in residual_shape(points).asymmetries if a.kind == "mirror")
    assert mirror.is_significant
    assert abs(mirror.largest - 0.02 * np.sin(np.deg2rad(80)) * np.sin(np.deg2rad(70))) < 0.006
    even = 0.02 * of_i * of_o * np.cos(np.deg2rad(columns[2]))
    found = residual_shape(points_of(columns, even)).asymmetries
    assert not next(a for a in found if a.kind == "mirror").is_significant


def test_a_loss_with_view_alone_is_not_reciprocal():
    columns = hemisphere(scans=(0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 80.0))
    of_i, of_o = sines(columns)
    vignetting, absorption = -0.1 * of_o**2, -0.1 * of_o**2 - 0.1 * of_i**2
    for relative, is_broken in ((vignetting, True), (absorption, False)):
        found = residual_shape(points_of(columns, relative)).asymmetries
        assert next(a for a in found if a.kind == "reciprocal").is_significant == is_broken


def test_factors_of_scans_are_not_taken_for_a_broken_reciprocity():
    columns = hemisphere(scans=(0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 80.0))
    broken = [
        next(
            a.is_significant
            for a in residual_shape(points_of(columns, 0.0, 0.03, seed)).asymmetries
            if a.kind == "reciprocal"
        )
        for seed in range(10)
    ]
    assert not any(broken)


def test_whitening_and_its_inverse():
    points = points_of(hemisphere(), 0.0, 0.02)
    column = np.random.default_rng(1).standard_normal(len(points))
    np.testing.assert_allclose(points.unwhiten(points.whiten(column[:, None])[:, 0]), column, rtol=1e-9)
    # Each scan's covariance is 1 + q q^T in units of the independent noise.
    first = points.scan == 0
    whiten = points.whiten(np.eye(len(points)) * SIGMA)[np.ix_(first, first)]
    q = np.full(first.sum(), 0.02 / SIGMA)
    product = whiten @ (np.eye(q.size) + np.outer(q, q)) @ whiten.T
    np.testing.assert_allclose(product, np.eye(q.size), atol=1e-9)


def test_modes_in_the_plane_of_incidence():
    columns = plane()
    theta_i, theta_o, phi, *_ = columns
    signed = np.sin(np.deg2rad(theta_o)) * np.cos(np.deg2rad(phi))
    found = residual_shape(points_of(columns, 0.08 * np.sin(np.deg2rad(theta_i)) * signed))
    assert [(m.mode.n, m.mode.m, m.mode.azimuthal_order) for m in found.modes] == [(1, 1, None)]
    assert abs(found.modes[0].amplitude[0] - 0.08) < 4 * found.modes[0].standard_error[0]


def test_a_tilt_is_seen_at_normal_incidence_in_the_plane():
    columns = plane()
    theta_i, theta_o, phi, *_ = columns
    tilt = np.where(theta_i == 0, 0.05 * np.sin(np.deg2rad(theta_o)) * np.cos(np.deg2rad(phi)), 0.0)
    mirror = residual_shape(points_of(columns, tilt)).asymmetries[0]
    assert mirror.kind == "mirror"
    assert mirror.is_significant


def test_amplitudes_of_each_wavelength():
    columns = hemisphere(wavelengths=(450.0, 550.0, 650.0))
    of_i, of_o = sines(columns)
    size = np.select([columns[3] == 450, columns[3] == 550], [0.06, 0.03], 0.0)
    found = residual_shape(points_of(columns, size * (2 * of_i**2 - 1) * (2 * of_o**2 - 1)))
    lead = found.modes[0]
    assert (lead.mode.n, lead.mode.m, lead.mode.azimuthal_order) == (2, 2, 0)
    assert np.all(np.abs(lead.amplitude - [0.06, 0.03, 0.0]) < 4 * lead.standard_error)
    by_wavelength = {s.wavelength_nm: s.relative_rms for s in found.scans if s.theta_i_deg == 0}
    assert by_wavelength[450.0] > 1.5 * by_wavelength[550.0] > 2 * by_wavelength[650.0]
