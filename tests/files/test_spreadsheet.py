"""Users' text in files that they open with a spreadsheet."""

import csv

import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.data import simulated_example
from jaxink.files.spreadsheet import cell, comment
from tests.samples import GOOD_SAMPLE

FORMULAS = [
    "=cmd|' /C calc'!A0",
    "=1+1",
    "+A1",
    "-A1",
    "@SUM(A1:A9)",
    "\t=1",
    "\r=1",
    "\n1",
    " =1+1",
    "-1.5+A1",
    "-inf",
    "+1e",
    "\uff1d1",
]


@pytest.mark.parametrize("text", FORMULAS)
def test_formulas_get_an_apostrophe(text):
    assert cell(text) == f"'{text}"


@pytest.mark.parametrize(
    "value", ["-1.5", "+.5E-7", "-3.", "a=1", "2024-01-01", "'=1", "", "n/a", -1.5, 3, None]
)
def test_numbers_and_harmless_text_stay(value):
    assert cell(value) is value


def test_the_summary_of_a_batch_holds_no_formula_of_the_users(tmp_path):
    """File names, messages and the columns of the plan's table are words of others."""
    (tmp_path / "sample.toml").write_text(GOOD_SAMPLE)
    plan = 'schema_version = 1\nsample = "sample.toml"\n[measurements]\ntable = "list.csv"\n'
    (tmp_path / "plan.toml").write_text(plan)
    texts = [text.strip() for text in FORMULAS]
    with open(tmp_path / "list.csv", "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["name", "file", "=note", "level"])
        for number, text in enumerate(texts):
            (tmp_path / f"{number}.csv").write_text("1")
            writer.writerow([f"-{number}", f"{number}.csv", text, "-1.5"])
        writer.writerow(["absent", "=1+1", "plain", "2"])
    found = jaxink.batch(
        tmp_path / "plan.toml", tmp_path / "out", workers=0, function="tests.batches.functions:answered"
    )
    assert len(found) == len(texts) + 1
    with open(tmp_path / "out/summary.csv", encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    for text in [*head, *(each for row in rows for each in row)]:
        assert cell(text) == text
    column = dict(zip(head, zip(*rows, strict=True), strict=True))
    assert column["'=note"] == (*(cell(text) for text in texts), "plain")
    assert set(column["level"]) == {"-1.5", "2"}
    assert column["ink.scattering_per_mm"][0] == "1.0"


def test_comments_are_cut_at_separators():
    assert comment("# a, b;c,=1; @x\t-2") == "# a, b;c,'=1;' @x\t'-2"


def test_predictions_hold_no_formula_of_the_users(coarse, tmp_path, monkeypatch):
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    monkeypatch.setattr("jaxink.model.forward.model_sizes", lambda *_: coarse)
    data, sample = simulated_example()
    head, *rows = data.read_text(encoding="utf-8").splitlines()
    further = [(text.strip(), "-1.5", f"{k}") for k, text in enumerate(FORMULAS)]
    further += [("-1.5", "n/a", "-1.5"), ("plain", "-2.5", "-0.5")]
    with open(tmp_path / "data.csv", "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*head.split(","), "=note", "mixed", "-level"])
        for k, row in enumerate(rows):
            writer.writerow([*row.split(","), *further[k % len(further)]])
    out = tmp_path / "predicted.csv"
    done = CliRunner().invoke(app, ["predict", str(sample), str(tmp_path / "data.csv"), "--out", str(out)])
    assert (done.exit_code, done.stderr) == (0, "")
    with open(out, encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    # The values measured and why a row is masked come last.
    assert head[-5:-2] == ["'=note", "mixed", "'-level"]
    assert not [text for row in rows for text in row if text[:1] in "=@" and text]
    # Numbers of a column of text, and of a column of numbers.
    assert {row[-4] for row in rows} == {"-1.5", "n/a", "-2.5"}
    assert {row[-3] for row in rows} == {*(f"{k}.0" for k in range(len(FORMULAS))), "-1.5", "-0.5"}
    assert {row[-5] for row in rows} == {
        "-1.5",
        "plain",
        *(f"'{text.strip()}" for text in FORMULAS if text != "\n1"),
        "1",
    }
    assert jaxink.read(out).extra["mixed"].dtype.kind == "U"
