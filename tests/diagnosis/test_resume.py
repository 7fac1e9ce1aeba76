"""A diagnosis that was stopped goes on where it ended, with the same result, and does nothing twice."""

import copy
import dataclasses
import json
import shutil

import numpy as np
import pytest

import jaxink
from jaxink.diagnosis import DiagnosisOptions, FolderState, Unfinished, diagnose
from jaxink.diagnosis.search.checkpoint import SEARCH
from jaxink.effects import ReadingEffect
from jaxink.fitting.compiled import CompiledObjective
from jaxink.sample import Parameter, parse_sample
from tests.diagnosis.test_loop import OPTIONS, SAMPLE, Rounding, drawn
from tests.diagnosis.test_time_limit import PAIR, complete_and_looks

SMALL = parse_sample(SAMPLE)


class Stopped(Exception):
    pass


@pytest.fixture(scope="module")
def complete():
    return complete_and_looks(drawn(*PAIR, 12))[0]


@pytest.fixture
def linearised(monkeypatch):
    """Number of Jacobians computed."""
    count = []

    def counted(self, unit, original=CompiledObjective.linearised):
        count.append(1)
        return original(self, unit)

    monkeypatch.setattr(CompiledObjective, "linearised", counted)
    return count


def same_report(one, other):
    """Reports without what is bound to differ: times."""
    plain = [copy.deepcopy(found.to_dict()) for found in (one, other)]
    for report in plain:
        report.pop("time_limit")
    return json.dumps(plain[0], sort_keys=True) == json.dumps(plain[1], sort_keys=True)


def test_what_was_finished_is_not_done_again(complete, tmp_path, linearised):
    data = complete.declared.data

    def until(what, step, misfit):
        if what == "held out with angle_offset and stray_light":
            raise Stopped

    folder = tmp_path / "out" / "unfinished"
    with pytest.raises(Stopped):
        diagnose(data, SMALL, OPTIONS, until, unfinished=Unfinished(folder, data, SMALL, OPTIONS))
    before = len(linearised)
    again = Unfinished(folder, data, SMALL, OPTIONS)
    assert again.origin is FolderState.SAME
    found = diagnose(data, SMALL, OPTIONS, unfinished=again)
    assert same_report(found, complete)
    after = len(linearised) - before
    linearised.clear()
    # Once more, everything is there; only hypotheses about the input are always refitted if none was kept.
    repeated = diagnose(data, SMALL, OPTIONS, unfinished=Unfinished(folder, data, SMALL, OPTIONS))
    assert same_report(repeated, complete)
    assert len(linearised) == 0
    assert after > 0
    again.clear()
    assert not folder.exists()


def test_pieces_of_another_input_are_not_used_and_the_user_is_told(complete, tmp_path, told):
    data, folder = complete.declared.data, tmp_path / "unfinished"
    assert Unfinished(folder, data, SMALL, OPTIONS).origin is FolderState.EMPTY
    Unfinished(folder, data, SMALL, OPTIONS).begin(complete.declared)
    longer = dataclasses.replace(OPTIONS, time_limit_s=7.0)
    assert Unfinished(folder, data, SMALL, longer).origin is FolderState.SAME
    assert Unfinished(folder, data, SMALL, longer).fitted().values == complete.declared.values
    brighter = data.replace(bsdf_per_sr=data.bsdf_per_sr * 1.01)
    other = Unfinished(folder, brighter, SMALL, OPTIONS)
    stricter = dataclasses.replace(OPTIONS, level=0.01)
    assert Unfinished(folder, data, SMALL, stricter).origin is FolderState.OTHER_INPUT
    assert other.origin is FolderState.OTHER_INPUT
    assert other.fitted() is None
    told(other.sentence)
    about = folder / "about.json"
    about.write_text(json.dumps(json.loads(about.read_text()) | {"code": "older"}))
    older = Unfinished(folder, data, SMALL, OPTIONS)
    assert older.origin is FolderState.OTHER_CODE
    told(older.sentence)
    (folder / "x.npz").write_bytes(b"of the older version")
    older.begin(complete.declared)
    assert not (folder / "x.npz").exists()
    assert Unfinished(folder, data, SMALL, OPTIONS).origin is FolderState.SAME


def test_a_damaged_piece_is_made_again(complete, tmp_path):
    data, folder = complete.declared.data, tmp_path / "unfinished"
    options = dataclasses.replace(OPTIONS, catalogue=OPTIONS.catalogue[1:2])
    first = diagnose(data, SMALL, options, unfinished=Unfinished(folder, data, SMALL, options))
    files = sorted(folder.glob("*.piece"))
    assert len(files) > 5
    for number, file in enumerate(files):
        content = file.read_bytes()
        # Cut short, empty, or one byte changed.
        damaged = (
            content[: len(content) // 2],
            b"",
            content[:200] + bytes([content[200] ^ 1]) + content[201:],
        )
        file.write_bytes(damaged[number % 3])
    (folder / "declared" / "result.json").write_text("{")
    again = diagnose(data, SMALL, options, unfinished=Unfinished(folder, data, SMALL, options))
    assert same_report(first, again)


def test_exchanged_pieces_are_made_again(complete, tmp_path):
    data, folder = complete.declared.data, tmp_path / "unfinished"
    options = dataclasses.replace(OPTIONS, catalogue=OPTIONS.catalogue[1:3])
    first = diagnose(data, SMALL, options, unfinished=Unfinished(folder, data, SMALL, options))
    files = sorted(file for file in folder.iterdir() if file.is_file() and not file.name.startswith("about"))
    contents = [file.read_bytes() for file in files]
    assert len(files) > 5
    # Each piece gets the content of the next one of the same size, which is of the same kind.
    for size in {len(content) for content in contents}:
        alike = [n for n, content in enumerate(contents) if len(content) == size]
        for n, other in zip(alike, alike[1:] + alike[:1], strict=True):
            files[n].write_bytes(contents[other])
    again = diagnose(data, SMALL, options, unfinished=Unfinished(folder, data, SMALL, options))
    assert same_report(first, again)


def test_the_fit_of_another_measurement_is_not_gone_on_from(complete, tmp_path):
    data = complete.declared.data
    brighter = data.replace(bsdf_per_sr=data.bsdf_per_sr * 1.01)
    fitted = jaxink.fit(brighter, SMALL, OPTIONS.fit)
    own, other = (
        Unfinished(tmp_path / name, about, SMALL, OPTIONS)
        for name, about in (("own", data), ("other", brighter))
    )
    own.begin(complete.declared)
    other.begin(fitted)
    assert Unfinished(own.folder, data, SMALL, OPTIONS).fitted().values == complete.declared.values
    shutil.rmtree(own.folder / "declared")
    for file in other.folder.iterdir():
        if file.name.startswith("declared"):
            (shutil.copytree if file.is_dir() else shutil.copy)(file, own.folder / file.name)
    assert Unfinished(own.folder, data, SMALL, OPTIONS).origin is FolderState.SAME
    assert Unfinished(own.folder, data, SMALL, OPTIONS).fitted() is None


def test_a_search_is_the_same_after_writing(complete):
    search = dataclasses.replace(complete.steps[0].refit.solution.search, decrement=np.inf)
    again = SEARCH.made_of(SEARCH.arrays_of(search))
    assert again.outcome is search.outcome
    for field in dataclasses.fields(search):
        if field.name != "path":
            np.testing.assert_array_equal(getattr(again, field.name), getattr(search, field.name))
    for field in dataclasses.fields(search.path):
        np.testing.assert_array_equal(getattr(again.path, field.name), getattr(search.path, field.name))


def test_an_effect_of_ones_own_has_no_name_in_another_process(complete, tmp_path, told):
    class Own(ReadingEffect):
        name, statement = "own", "something of one's own"
        terms = (Parameter("own.strength", 0.0, True, 0.0, 1.0),)

        def change(self, predicted, values, field):
            return predicted * (1 + values["own.strength"])

    data, folder = complete.declared.data, tmp_path / "unfinished"
    for own in (Own, Rounding):
        unfinished = Unfinished(folder, data, SMALL, DiagnosisOptions(catalogue=(own,)))
        assert unfinished.origin is FolderState.UNKNOWN
        assert unfinished.begin(complete.declared).folder is None
        assert not folder.exists()
    told(unfinished.sentence)
