"""Saved reports, of this version and of version 1."""

import json
from pathlib import Path

import pytest

from jaxink.diagnosis import read_report
from jaxink.errors import InputRefusedError

VALIDATION = Path(__file__).resolve().parents[2] / "benchmarks" / "validation"
KEPT = sorted(VALIDATION.glob("*/reports/*.json"))
OLD = {
    "schema_version": 1,
    "steps": [{"effect": "gain", "class": ["gain"], "predicted_drop": 50.0, "actual_drop": 60.0}],
    "candidates": [{"effect": "gain", "absorbed_fraction": 0.25, "predicted_drop": 50.0, "refit_drop": None}],
    "data_consistency": [{"kind": "mirror", "relative": 0.01, "stated": 0.02, "is_broken": False}],
    "settings": {"level": 0.05},
}
NEW = {
    "schema_version": 2,
    "steps": [
        {
            "effect": "gain",
            "class": ["gain"],
            "predicted_delta_chi_square": 50.0,
            "actual_delta_chi_square": 60.0,
        }
    ],
    "candidates": [
        {
            "effect": "gain",
            "degenerate_fraction": 0.25,
            "predicted_delta_chi_square": 50.0,
            "refit_delta_chi_square": None,
        }
    ],
    "data_consistency": [{"kind": "mirror", "relative": 0.01, "expected": 0.02, "exceeds_noise": False}],
    "settings": {"level": 0.05},
}


@pytest.mark.parametrize("report", [OLD, NEW], ids=["version 1", "version 2"])
def test_both_versions_are_read_with_the_present_names(report, tmp_path):
    (tmp_path / "report.json").write_text(json.dumps(report))
    assert read_report(tmp_path) == read_report(tmp_path / "report.json") == NEW


@pytest.mark.parametrize("path", KEPT, ids=lambda p: f"{p.parent.parent.name}/{p.stem}")
def test_kept_reports_are_read(path):
    report = read_report(path)
    for row in (*report["candidates"], *report["remaining_candidates"]):
        assert {"degenerate_fraction", "predicted_delta_chi_square", "refit_delta_chi_square"} <= set(row)
    assert all("actual_delta_chi_square" in step for step in report["steps"])


@pytest.mark.parametrize("version", [0, 3, True, None, "1"])
def test_other_versions_are_rejected(version, tmp_path):
    (tmp_path / "report.json").write_text(json.dumps({"schema_version": version}))
    with pytest.raises(InputRefusedError, match="schema_version"):
        read_report(tmp_path)
