"""Swatches of measured and fitted colours."""

import dataclasses

import numpy as np

from jaxink.colour.shown import colours_if_any, shown_colour
from jaxink.measurement import GonioData
from jaxink.report.fit_html import colour_section


def reddish():
    theta_i, theta_o = (np.tile(np.repeat(one, 3), 1) for one in ([0.0, 45.0, 45.0], [20.0, 0.0, 60.0]))
    wave = np.tile([450.0, 550.0, 650.0], 3)
    bsdf = np.tile([0.02, 0.05, 0.2], 3)
    return GonioData(theta_i, theta_o, np.full(9, 90.0), wave, np.zeros(9, bool), bsdf)


def test_the_direction_nearest_to_45_0_is_shown():
    data = reddish()
    found = colours_if_any(data, data.bsdf_per_sr * np.where(data.theta_o_deg == 0, 0.9, 1.0))
    one = shown_colour(found)
    assert one.direction == "45:0"
    assert one.fitted_lab[0] < one.measured_lab[0]
    section = colour_section(found)
    assert section.content.count("<rect") == 2
    assert "450 to 650 nm only" in section.content


def test_one_wavelength_has_no_colour():
    data = reddish().select(wavelength_nm=550.0)
    assert colours_if_any(data, data.bsdf_per_sr) is None
    behind = dataclasses.replace(reddish(), is_transmission=np.ones(9, bool))
    assert shown_colour(colours_if_any(behind, behind.bsdf_per_sr)) is None
