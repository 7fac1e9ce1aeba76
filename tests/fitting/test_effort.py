"""What a result says of the way to it: every search counts, and what did not move is said."""

import dataclasses

import pytest

import jaxink
from jaxink.fitting.method import search as search_from

UNMOVED = "No parameter moved from its start value."


@pytest.fixture
def ran(monkeypatch):
    """All searches that were made."""
    searches = []

    def recorded(*arguments, **options):
        searches.append(search_from(*arguments, **options))
        return searches[-1]

    for module in ("gradient", "multistart"):
        monkeypatch.setattr(f"jaxink.fitting.{module}.search", recorded)
    return searches


def test_scan_and_profiles_count(inputs, coarse, ran):
    data, sample = inputs
    table = sample.parameters.replace("ink.asymmetry_parameter", multimodal=True)
    options = jaxink.FitOptions(config=coarse, profile="all")
    result = jaxink.fit(data, dataclasses.replace(sample, parameters=table), options)
    methods = [search.method for search in result.searches]
    assert methods == [*["gradient"] * (len(methods) - 2), "scan", "profile"]
    for effort in ("jacobians", "run_seconds", "compile_seconds"):
        told = sum(getattr(search, effort) for search in result.searches)
        assert told == pytest.approx(sum(getattr(search, effort) for search in ran)), effort
    saved = result.to_dict()
    for seconds in ("run_seconds", "compile_seconds"):
        whole = sum(getattr(search, seconds) for search in ran)
        assert saved[seconds] == getattr(result, seconds) == pytest.approx(whole)
    assert result.searches[-2].jacobians > 96
    again = result.to_dict()["searches"]
    assert [search["method"] for search in again] == methods


def test_going_on_from_what_was_found_is_no_standing_still(inputs, coarse, monkeypatch):
    sizes = iter([coarse])
    # Larger sizes that are the same ones: the search ends where it begins.
    monkeypatch.setattr("jaxink.fitting.multistart._finer", lambda *_: next(sizes, None))
    result = jaxink.fit(*inputs, jaxink.FitOptions(config=coarse))
    first, refined = (search for search in result.searches if search.method == "gradient")
    assert refined.values == pytest.approx(first.values)
    assert UNMOVED not in result.notes


def test_what_did_not_move_is_said(inputs, example_result, coarse):
    found = jaxink.fit(inputs[0], example_result.sample, jaxink.FitOptions(config=coarse, profile="none"))
    assert UNMOVED in found.notes


def test_a_start_that_no_other_search_betters_is_called_that(inputs, example_result, coarse, told):
    options = jaxink.FitOptions(config=coarse, profile="none", starts=2)
    found = jaxink.fit(inputs[0], example_result.sample, options)
    # The second search moved, though it led to nothing better.
    assert found.searches[1].start != pytest.approx(found.searches[1].values)
    assert UNMOVED not in found.notes
    (note,) = (note for note in found.notes if "start" in note)
    told(note, "1 search ")
