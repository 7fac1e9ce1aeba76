"""The table as a thin sheet on its plate, against the full model and against photons."""

import dataclasses

import numpy as np
import pytest

import jaxink
from benchmarks import montecarlo
from jaxink.ink import TableOptions, verify_sheet
from jaxink.ink.hemispherical_totals import power_sent_out
from jaxink.ink.sheet import sheets
from tests.samples import BEHIND_AIR


@pytest.fixture(scope="module")
def verified(unmatched_table, unmatched):
    return verify_sheet(unmatched_table, unmatched)


def test_the_sheet_is_the_full_model_lit_from_either_side(verified):
    assert len(verified.checks) == 20
    assert {(c.lit_from, c.side) for c in verified.checks} == {
        (lit, side) for lit in ("inside", "outside") for side in "RT"
    }
    assert verified.largest_difference < 5e-3
    assert verified.sheet_rms is None


def test_light_without_its_index_step_is_noticed(unmatched_table, unmatched):
    wrong = np.array(unmatched_table.bsdf_per_sr)
    wrong[1] /= 1.49**2
    checks = verify_sheet(dataclasses.replace(unmatched_table, bsdf_per_sr=wrong), unmatched).checks
    by_side = {(c.lit_from, c.side): c.largest_difference for c in checks if c.theta_i_deg == 30}
    assert by_side["inside", "T"] > 0.3
    assert by_side["inside", "R"] < 5e-3


def test_photons_that_know_the_table_only_agree(unmatched_table, unmatched):
    axes = np.meshgrid([5.0, 30, 55, 75, 85], [0.0, 90, 180], [False, True], indexing="ij")
    theta_o, phi, side = (axis.ravel() for axis in axes)
    (sheet,) = sheets(unmatched_table, unmatched)[1]
    plate = montecarlo.Plate(optical_thickness=0.05)
    for seed, theta_i in enumerate((0.0, 60.0)):
        found, error = montecarlo.plate_bsdf(
            unmatched_table, plate, theta_i, (theta_o, phi, side), n_photons=8000, seed=seed
        )
        expected = sheet.bsdf(0, theta_i, theta_o, phi, side)
        assert np.median(error / found) < 4e-3
        assert np.all(np.abs(found - expected) < 4 * error + 1e-3 * expected.max())


def test_the_sheet_explains_the_measurement_as_well_as_the_fit(example_result):
    options = TableOptions(n_theta=41, n_phi=25, accuracy=1e-3)
    table = jaxink.ink_table(example_result.sample, wavelengths_nm=[550.0], options=options)
    found = verify_sheet(table, example_result, theta_i_deg=())
    assert found.checks == ()
    for side in "RT":
        assert 1e-3 < found.sheet_rms[side] < 0.02
        assert found.sheet_rms[side] == pytest.approx(found.model_rms[side], abs=3e-3)


def test_a_table_of_another_sample_is_refused(unmatched_table, unmatched, refused):
    other = unmatched.parameters.replace("plate.refractive_index", value=1.5)
    with refused("1.49"):
        verify_sheet(unmatched_table, dataclasses.replace(unmatched, parameters=other))
    named = dataclasses.replace(unmatched_table, attrs={"layers": "paint"})
    with refused("paint"):
        verify_sheet(named, unmatched)


@pytest.mark.parametrize(
    ("layers", "inside", "tolerance"), [(["air_gap", "ink"], "plate", 4e-3), (["ink"], "air_gap", 1e-3)]
)
def test_an_ink_behind_air_is_one_surface_with_its_gap_or_is_seen_from_the_air(layers, inside, tolerance):
    """The critical angle of the plate is on the grid, and no light is gained there."""
    sample = jaxink.parse_sample(BEHIND_AIR)
    options = TableOptions(n_theta=61, n_phi=25, inside=inside, accuracy=1e-3)
    table = jaxink.ink_table(sample, layers, options=options)
    # At the last angles before 90 degrees, the table is its own limit, not that of the ink.
    assert np.max(power_sent_out(table)[:, :, :-2]) < 1 + 1e-3
    if inside == "plate":
        critical = np.argmin(np.abs(table.theta_deg - np.rad2deg(np.arcsin(1 / 1.5))))
        assert table.theta_deg[critical] == pytest.approx(np.rad2deg(np.arcsin(1 / 1.5)), abs=1e-9)
        np.testing.assert_allclose(power_sent_out(table)[0, 0, critical:], 1.0, rtol=1e-12)
    checks = verify_sheet(table, sample, (0.0, 30.0, 60.0)).checks
    assert max(check.largest_away_from_grazing for check in checks) < tolerance
    assert max(check.largest_difference for check in checks) < 4 * tolerance
