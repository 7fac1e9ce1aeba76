"""What the rim of a printed dot takes: paths through a dot, and the rule for the size of a dot."""

import dataclasses
import functools

import numpy as np
import pytest

from benchmarks.validation.render.dot_size import (
    DIFFUSE,
    GUIDED,
    INKS,
    LIGHTS,
    RATIOS,
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


@functools.cache
def seen(name, thickness, light=DIFFUSE):
    """Paths through a dot ten times as wide as thick."""
    return rim_estimate(ink(name, thickness), 10, LIGHTS[light], 250)


def test_the_error_of_a_sheet_is_inverse_to_the_diameter():
    small = rim_estimate(ink("thin_ink", 0.5), 6, None, 300)
    large = rim_estimate(ink("thin_ink", 0.5), 24, None, 1200)
    assert np.all(np.abs(apart(small["edge"], large["edge"])) < 3)
    # Four times as large, a quarter of the error; not the same error.
    assert np.all(np.abs(apart(small["error"], large["error"])) > 6)


@pytest.mark.parametrize(
    ("name", "thickness"), [("thin_ink", 0.5), ("coloured_dot", 0.5), ("white_dot", 0.25)]
)
def test_paths_through_a_dot_agree_with_the_rule(name, thickness):
    one, layer = seen(name, thickness), WideLayer.of(ink(name, thickness))
    assert np.all(np.abs(np.array(sheet_error(layer)) - one["edge"].value) < 3 * one["edge"].error)
    # The error is seen clearly, so that the rule could fail.
    assert np.all(np.abs(one["edge"].value) > 3 * one["edge"].error)
    # Without a rim, paths and solver are two ways to the same light.
    assert np.all(np.abs(layer.scattered - one["sheet"].value) < 3 * one["sheet"].error)


def test_light_along_the_plate_leaves_through_the_rim_more_often():
    diffuse, guided = (seen("coloured_dot", 0.5, light) for light in (DIFFUSE, GUIDED))
    _, air = apart(guided["edge"], diffuse["edge"])
    assert air < -3


def test_a_rim_moves_power_from_plate_to_air_if_nothing_is_absorbed():
    sheet, volume = rim_batch(ink("white_dot", 0.5), 6, None, 3000, np.random.default_rng(2))
    # Only the upper face reflects light that was not scattered.
    assert 0.97 < sheet.sum() < 1
    assert volume.sum() == pytest.approx(sheet.sum(), abs=4e-3)
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
    assert len(found) == len(INKS) * len(LIGHTS) * len(THICKNESSES) * len(RATIOS)
    np.testing.assert_allclose(fitted(found), RIM, rtol=0.01)
