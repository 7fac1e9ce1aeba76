"""The section on the shape of a remaining residual, and its figure."""

import dataclasses

import pytest

from jaxink.plots.diagnosis_pages import diagnosis_figures
from jaxink.report.sections import remains
from jaxink.report.writing import shape


@pytest.fixture(scope="module")
def left(found):
    """The diagnosis as if nothing had been added: its declared model leaves a smooth residual."""
    declared = found.declared.residual_shape
    return dataclasses.replace(found, after=found.before, shape=declared, overlaps={"drift": -0.4})


def test_the_section_holds_the_sentence_and_all_tables(left):
    content = shape(left).content
    # How much of the residual is smooth is said once on the page, not here again.
    first = left.shape.sentence.split(".")[0]
    assert first in remains(left).content
    assert first not in content
    assert content.count("<table") == 3 + bool(left.shape.asymmetries) + 1
    assert "-0.40" in content


def test_a_diagnosis_without_structure_has_no_section(found):
    assert shape(dataclasses.replace(found, shape=None)) is None


def test_both_sides_are_drawn(left):
    names = [drawn.name for drawn in diagnosis_figures(left)]
    assert {"residual_shape_R_550nm", "residual_shape_T_550nm"} <= set(names)


def test_stray_light_is_seen_where_the_sample_is_dark(left):
    # A constant matters most where the BSDF is small, which no parameter of the ink reproduces.
    assert left.shape.share > 0.3
    assert left.shape.to_dict()["modes"][0]["chi_square"] > 20
