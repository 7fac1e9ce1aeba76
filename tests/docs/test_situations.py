"""Every row of docs/manual/as-people-have-it.md is what happens, and what is read has the right values."""

from pathlib import Path

import numpy as np
import pytest

import jaxink
from tests.docs.situation_files import truth
from tests.docs.situation_page import outcome, page
from tests.docs.situations import EXCHANGED, GROUPS
from tests.formats.files import bsdf

PAGE = Path(__file__).resolve().parents[2] / "docs" / "manual" / "as-people-have-it.md"
ALL = {each.what: each for situations in GROUPS.values() for each in situations}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def require_read(situation, found, n):
    assert found.tidy is not None, found.sentence
    data = jaxink.read(found.tidy)
    assert len(data) == n
    if not situation.is_truth:
        return
    i, o, phi, nm, _ = data.directions
    if situation.what in EXCHANGED:
        for side in set(data.side.tolist()):
            here = data.side == side
            np.testing.assert_allclose(
                data.bsdf_per_sr[here], bsdf(i[here], o[here], phi[here], side), rtol=1e-6
            )
    else:
        np.testing.assert_allclose(data.bsdf_per_sr, truth(i, o, phi, nm, data.side), atol=2e-7)


@pytest.mark.parametrize("what", ALL)
def test_what_becomes_of_it(what, folder):
    situation = ALL[what]
    found = outcome(situation, situation.options, folder)
    if situation.values is not None:
        require_read(situation, found, situation.values)
        return
    assert found.tidy is None, found.sentence
    assert [name for name in situation.named if name not in found.sentence] == []
    if situation.then is not None:
        require_read(situation, outcome(situation, situation.then, folder), situation.then_values)


def test_the_page_is_up_to_date(folder):
    assert page(folder) == PAGE.read_text(encoding="utf-8")
    assert len(ALL) >= 25
