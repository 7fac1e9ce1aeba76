"""No light is lost or made: reflected, transmitted and regular power add up to what came in."""

import numpy as np
import pytest

from jaxink.optics.directions import Directions
from jaxink.optics.layers import OPAQUE_OPTICAL_THICKNESS, ClearLayer
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power, regular_power
from jaxink.solver.stack import Stack
from tests.physics.probe import Light, film, ink, matched, printed, two_inks

# The vanishing eigenvalue of a layer without absorption has a rounding, which counts times its thickness.
ROUNDING = 1e-10


def rounding(optical_thickness):
    return ROUNDING + 1e-13 * optical_thickness


@pytest.mark.parametrize("asymmetry", [-0.3, 0.0, 0.3])
@pytest.mark.parametrize("optical_thickness", [0.0, 1e-6, 0.1, 2.0, 50.0, 1e4])
def test_matched_layer_without_absorption(optical_thickness, asymmetry):
    light = Light(matched(optical_thickness, 1.0, asymmetry))
    np.testing.assert_allclose(light.total, 1.0, atol=rounding(optical_thickness))


@pytest.mark.parametrize("refractive_index", [1.0, 1.00001, 1.2, 1.5, 2.0, 2.5])
@pytest.mark.parametrize("optical_thickness", [0.1, 2.0, 1e3])
def test_film_without_absorption(refractive_index, optical_thickness):
    light = Light(film(ink(refractive_index, optical_thickness, albedo=1.0)))
    np.testing.assert_allclose(light.total, 1.0, atol=rounding(optical_thickness))


@pytest.mark.parametrize(("index_front", "index_back"), [(1.33, 1.0), (1.0, 1.33)])
def test_film_between_different_surroundings(index_front, index_back):
    light = Light(film(ink(albedo=1.0), index_front, index_back))
    np.testing.assert_allclose(light.total, 1.0, atol=ROUNDING)


@pytest.mark.parametrize("behind", [False, True])
@pytest.mark.parametrize("plate_index", [1.0, 1.3, 1.5, 1.6, 2.0])
def test_plate_below_at_and_above_the_ink_index(plate_index, behind):
    light = Light(printed(ink(albedo=1.0), plate_index, behind=behind))
    np.testing.assert_allclose(light.total, 1.0, atol=ROUNDING)


def test_two_layers_without_absorption():
    light = Light(two_inks(ink(albedo=1.0, asymmetry=0.0), ink(albedo=1.0, optical_thickness=5.0)))
    np.testing.assert_allclose(light.total, 1.0, atol=ROUNDING)


@pytest.mark.parametrize("stack", [matched(OPAQUE_OPTICAL_THICKNESS, 1.0, 0.3),
                                   film(ink(1.5, OPAQUE_OPTICAL_THICKNESS, 1.0))])  # fmt: skip
def test_opaque_layer_without_absorption_reflects_everything(stack):
    light = Light(stack)
    np.testing.assert_allclose(light.reflectance + light.specular, 1.0, atol=1e-5)
    assert np.all(np.abs(light.transmittance) < 1e-6)
    assert np.all(light.undeviated == 0)


def test_absorption_takes_away_and_more_of_it_takes_away_more():
    totals = [Light(film(ink(albedo=albedo))).total for albedo in (1.0, 0.999, 0.9, 0.5, 0.0)]
    assert np.all(np.diff(totals, axis=0) < 0)


def test_layer_that_only_absorbs_leaves_the_regular_light():
    light = Light(film(ink(albedo=0.0)))
    np.testing.assert_allclose(light.bsdf, 0.0, atol=1e-11)


def test_light_at_the_critical_angle_of_an_air_gap_is_totally_reflected():
    """Seen from a plate, an ink behind air is invisible from the critical angle on, itself included."""
    gap = Stack((ClearLayer(1.0, 0.0), ink(1.5, albedo=1.0)), 1.5, 1.0)
    # The last two are the critical angle, exactly, and just beyond.
    sines = np.array([0.0, 0.5, 0.6666, 1 / 1.5, 0.6667])
    reflected, transmitted = hemispherical_power(gap, sines)
    np.testing.assert_allclose(reflected + transmitted, 1.0, atol=2e-4)
    np.testing.assert_allclose(regular_power(gap, sines)[0][3:], 1.0)
    at = Directions.from_degrees(np.full(4, np.rad2deg(np.arcsin(1 / 1.5))), [10, 41, 10, 60],
                                 np.zeros(4), [False, False, True, True])  # fmt: skip
    assert np.all(np.asarray(diffuse_bsdf(gap, at)) == 0)
