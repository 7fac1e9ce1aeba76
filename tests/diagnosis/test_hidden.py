"""What an effect that nobody sees does to the parameters: as a fit to data with it says."""

import pytest

import jaxink
from jaxink.diagnosis import DiagnosisOptions, diagnose
from jaxink.effects.instrument import AngleOffset, Gain
from jaxink.report.hidden import hidden_changes
from jaxink.sample import parse_sample
from tests.diagnosis.printed import SAMPLE, SIZES, drawn

FIT = jaxink.FitOptions(profile="none", config=SIZES)


@pytest.fixture(scope="module")
def found():
    return diagnose(
        drawn((), {}, 11), parse_sample(SAMPLE), DiagnosisOptions(fit=FIT, catalogue=(AngleOffset, Gain))
    )


def test_shifts_are_those_of_a_fit_to_data_with_the_effect(found):
    assert not found.steps
    gain, offset = found.hidden
    assert (gain.effect, offset.effect) == ("gain", "angle_offset")
    assert gain.largest_in_errors > offset.largest_in_errors > 0
    # A fifth of it, so that the parameters move by little.
    data, share = found.declared.data, 0.2
    there = data.replace(bsdf_per_sr=data.bsdf_per_sr * (1 + share * gain.strength))
    again = jaxink.fit(there, parse_sample(SAMPLE), FIT)
    for name, shift in gain.shifts.items():
        moved = again[name].value - found.declared[name].value
        assert moved == pytest.approx(share * shift, rel=0.15)


def test_the_page_says_what_the_ink_would_be(found):
    changes = hidden_changes(found)
    assert [change.hidden.effect for change in changes] == ["gain", "angle_offset"]
    assert changes[0].percent > changes[1].percent > 0
    assert found.to_dict()["hidden_effects"][0]["effect"] == "gain"
