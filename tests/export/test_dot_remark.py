"""The size of printed dots that an export states, and where it says nothing."""

import re

import numpy as np
import pytest

import jaxink
from jaxink.export import medium_of, remark_on_dots
from jaxink.export.dot_size import WideLayer, sheet_error
from jaxink.ink import find_ink
from tests.samples import edited

INK = """
schema_version = 1
wavelength_nm = [500, 600]
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 20
scattering_per_mm = { per_wavelength = true, value = [380, 250] }
absorption_per_mm = 4.4
asymmetry_parameter = 0.6
"""


def remark(*changes, **choice):
    sample = jaxink.parse_sample(edited(INK, changes))
    return remark_on_dots(find_ink(sample, **choice), sample.wavelengths_nm)


def sizes(words):
    """Diameters over the thickness, and in mm."""
    found = re.findall(r"(?:about|less than) ([\d.]+) times the ink's thickness \(([\d.]+) mm\)", words)
    return np.array(found, float).T


def test_the_size_is_that_of_the_wavelength_with_the_largest_error(told):
    words = remark()
    sample = jaxink.parse_sample(INK)
    medium = medium_of(find_ink(sample), sample.wavelengths_nm)
    each = 100 * np.abs([sheet_error(WideLayer.of(medium, w)) for w in range(2)])
    ratios, diameters_mm = sizes(words)
    np.testing.assert_allclose(ratios, each.max(axis=0), rtol=0.05)
    np.testing.assert_allclose(diameters_mm, 0.02 * ratios, rtol=0.05)
    told(words)


def test_the_same_ink_in_a_thinner_layer_has_smaller_dots():
    denser = "value = [380, 250]", "value = [760, 500]", "_per_mm = 4.4", "_per_mm = 8.8"
    thick, thin = sizes(remark()), sizes(remark(*denser, "thickness_um = 20", "thickness_um = 10"))
    np.testing.assert_allclose(thin[0], thick[0])
    np.testing.assert_allclose(2 * thin[1], thick[1], rtol=0.06)


def test_too_little_transmission_is_not_judged(told):
    words = remark("_per_mm = 4.4", "_per_mm = 15", "thickness_um = 20", "thickness_um = 70")
    assert sizes(words).shape == (2, 1)
    told(words)


AFTER = "asymmetry_parameter = 0.6\n"


@pytest.mark.parametrize(
    "changes",
    [
        ("thickness_um = 20", "thickness_um = 2"),
        ("_per_mm = 4.4", "_per_mm = 60"),
        ("asymmetry_parameter = 0.6", "asymmetry_parameter = 0.1"),
        ("refractive_index = 1.5\nthickness_mm", "refractive_index = 1.7\nthickness_mm"),
        (AFTER, AFTER + "[surroundings]\nindex_back = 1.5\n"),
        (
            AFTER,
            AFTER + '[[layers]]\nname = "cover"\nkind = "clear"\nrefractive_index = 1.5\nthickness_mm = 1\n',
        ),
        (AFTER, AFTER + "[effects.air_gap]\nposition = 1\nshare = 0.5\n"),
        (AFTER, AFTER + '[layers.back_roughness]\ndensity = "cauchy"\nsigma_deg = 10\n'),
    ],
    ids=["thin", "absorbing", "isotropic", "dense_glass", "immersed", "covered", "air_gap", "rough"],
)
def test_nothing_is_said_where_the_rule_was_not_tested(changes):
    assert remark() is not None
    assert remark(*changes, inside="plate") is None


def test_an_ink_without_a_plate_has_no_dots():
    assert remark(inside="back") is None
