"""The two tables of simulated samples, of the diagnoses and of the exported BSDF, name one verdict."""

import json
from pathlib import Path

import pytest

SIMULATED = Path(__file__).resolve().parents[2] / "benchmarks" / "validation" / "simulated"
EXPORTED = sorted((SIMULATED / "inside").glob("*.json"))


@pytest.mark.parametrize("exported", EXPORTED, ids=lambda path: path.stem)
def test_the_exported_ink_is_that_of_the_verdict_beside_it(exported):
    verdict = json.loads((SIMULATED / "reports" / exported.name).read_text())["verdict"]
    found = json.loads(exported.read_text())
    assert (found["verdict"], found["effects"]) == (verdict["code"], verdict["effects"])


def test_every_undeclared_effect_has_its_exported_ink():
    assert [path.stem for path in EXPORTED] == sorted(
        path.stem for path in (SIMULATED / "reports").glob("undeclared_*.json")
    )
