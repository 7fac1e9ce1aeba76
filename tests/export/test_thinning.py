"""Angles that linear interpolation does not need are left out, and the stated error holds."""

import dataclasses

import numpy as np
import pytest

from jaxink.export import ExportOptions, write
from jaxink.export.mitsuba import thinned
from jaxink.ink import read_ink_table
from jaxink.ink.hemispherical_totals import diffuse_totals
from tests.ink.analytic_tables import lambertian, smooth_table, table_of, tilted_lobe


def between(table, found, largest_theta_deg=85.0):
    """Largest error at the entries of the table, over the largest BSDF of the incidence; and of totals."""
    looked_at = table.theta_deg <= largest_theta_deg
    theta = table.theta_deg[looked_at]
    grid = np.meshgrid(theta, theta, table.phi_deg, indexing="ij")
    worst = 0.0
    for c, name in enumerate(("R_II", "T_IA", "T_AI", "R_AA")):
        exact = table.bsdf_per_sr[c, 0][looked_at][:, looked_at]
        top = np.maximum(exact.max(axis=(1, 2), keepdims=True), 1e-30)
        worst = max(worst, np.max(np.abs(found.interpolated(name, *grid) - exact) / top))
    totals = diffuse_totals(table)[:, :, looked_at] - np.array(
        [[np.interp(theta, found.theta_deg, row) for row in rows] for rows in diffuse_totals(found)]
    )
    return worst, np.max(np.abs(totals))


@pytest.mark.parametrize("largest", [0.02, 0.005])
@pytest.mark.parametrize("table", [smooth_table, tilted_lobe], ids=["smooth", "lobe"])
def test_the_error_is_as_stated(table, largest):
    table = table()
    found = thinned(table, largest)
    assert found.bsdf_per_sr.size < table.bsdf_per_sr.size / 2
    assert max(between(table, found)) <= largest
    assert set(found.theta_deg) <= set(table.theta_deg)
    assert set(found.phi_deg) <= set(table.phi_deg)


def test_smooth_inks_need_few_angles_and_narrow_lobes_keep_theirs():
    theta = np.linspace(0, 90, 61)

    def peak(component, wavelength_nm, theta_i, theta_o, phi):
        return np.exp(-0.5 * ((theta_i - theta_o) / 2) ** 2)

    phi = np.linspace(0, 180, 37)
    constant = thinned(table_of(lambda *_: 0.1, theta, phi), 0.005)
    # Beyond 85 degrees all angles are kept.
    assert list(constant.theta_deg) == [0, *theta[theta > 85]]
    assert list(constant.phi_deg) == [0, 180]
    assert len(thinned(table_of(peak, theta, phi), 0.005).theta_deg) > 55


def test_steps_of_the_regular_part_are_kept():
    table = smooth_table()
    table.regular[0] = np.where(table.theta_deg > 41.9, 0.8, 0.04)
    found = thinned(table, 0.005)
    again = np.interp(table.theta_deg, found.theta_deg, found.regular[0, 0])
    np.testing.assert_allclose(again, table.regular[0, 0], atol=0.005)


def test_mitsuba_gets_the_thinned_table_and_says_so(tmp_path):
    table = smooth_table()
    with_errors = dataclasses.replace(table, bsdf_standard_error_per_sr=0.01 * table.bsdf_per_sr)
    options = ExportOptions(drop=("standard_errors",), interpolation_error=0.01)
    write(with_errors, "mitsuba", tmp_path, options)
    found = read_ink_table(tmp_path / "ink.nc")
    assert found.bsdf_standard_error_per_sr is None
    assert max(between(table, found)) <= 0.01 + 1e-6
    shape = f"{len(found.theta_deg)} of {len(table.theta_deg)} polar angles"
    assert shape in found.attrs["resolution"]
    assert "1 %" in found.attrs["resolution"]
    assert found.attrs["resolution"] in (tmp_path / "ink_README.txt").read_text()


def test_nothing_is_left_out_if_no_error_is_allowed(tmp_path, refused):
    table = lambertian()
    np.testing.assert_array_equal(thinned(table, 0.0).bsdf_per_sr, table.bsdf_per_sr)
    for error in (-0.1, 0.2, float("nan")):
        with refused("interpolation_error"):
            ExportOptions(interpolation_error=error)
