"""What the rim of a printed dot takes: paths through a dot, and the rule for the size of a dot."""

import dataclasses

import numpy as np
import pytest

from benchmarks.validation.render.dot_size import (
    FITTED,
    INKS,
    LIGHTS,
    THICKNESSES,
    fitted,
    ink,
    numbers,
    rim_batch,
    rim_estimate,
)
from jaxink.export.dot_size import RIM, WideLayer, sheet_error


def apart(one, other):
    """Difference of two estimates over its standard error."""
    return (one.value - other.value) / np.hypot(one.error, other.error)


@pytest.fixture(scope="module")
def small():
    return rim_estimate(ink("thin_ink"), 6, None, 1000)


def test_the_error_of_a_sheet_is_inverse_to_the_diameter(small):
    large = rim_estimate(ink("thin_ink"), 24, None, 3000)
    assert np.all(np.abs(apart(small["edge"], large["edge"])) < 3)
    # Four times as large, a quarter of the error; not the same error.
    assert np.all(np.abs(apart(small["error"], large["error"])) > 6)


@pytest.mark.parametrize(
    ("name", "light", "thickness"),
    [("thin_ink", "diffuse", 1.0), ("coloured_dot", "guided", 0.5), ("white_dot", "diffuse", 0.5)],
)
def test_paths_through_a_dot_agree_with_the_rule(name, light, thickness):
    medium, theta_deg = ink(name, thickness), LIGHTS[light]
    seen = rim_estimate(medium, 10, theta_deg, 500)
    layer = WideLayer.of(medium, 0, theta_deg)
    assert np.all(np.abs(np.array(sheet_error(layer)) - seen["edge"].value) < 3 * seen["edge"].error)
    # Without a rim, paths and solver are two ways to the same light.
    assert np.all(np.abs(layer.scattered - seen["sheet"].value) < 3 * seen["sheet"].error)


def test_a_rim_moves_power_from_plate_to_air_if_nothing_is_absorbed():
    sheet, volume = rim_batch(ink("white_dot", 0.5), 6, None, 3000, np.random.default_rng(2))
    # Only the upper face reflects light that was not scattered.
    assert 0.97 < sheet.sum() < 1
    assert volume.sum() == pytest.approx(sheet.sum(), abs=1e-3)
    assert sheet[0] > volume[0] + 0.02


def test_a_rim_takes_more_of_weakly_scattered_light():
    medium = ink("white_dot")
    layers = [
        WideLayer.of(dataclasses.replace(medium, scattering_per_mm=k * medium.scattering_per_mm))
        for k in (0.25, 1.0)
    ]
    thin, thick = (sheet_error(layer) for layer in layers)
    assert thin.returned > 1.5 * thick.returned > 0 > thick.sent_out


def test_the_way_of_light_is_the_same_from_derivatives_as_from_absorption():
    medium = ink("white_dot", 0.5)
    without, with_little = (
        WideLayer.of(dataclasses.replace(medium, absorption_per_mm=np.array([absorption])))
        for absorption in (0.0, 0.05)
    )
    assert with_little.way == pytest.approx(without.way, rel=5e-3)


def test_the_constants_are_those_of_the_committed_paths():
    found = numbers()
    assert len(found) == len(INKS) * len(LIGHTS) * len(THICKNESSES) * 5
    assert len(FITTED) == 2
    np.testing.assert_allclose(fitted(found), RIM, rtol=0.01)
