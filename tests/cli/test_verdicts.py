"""What `jaxink fit` says of a fit that is no result."""

import csv
import json

import pytest

from jaxink.data import simulated_example
from tests.cli.test_commands import SAMPLE, run  # noqa: F401


@pytest.fixture
def spoiled(tmp_path):
    """The embedded measurement with changed values and standard deviations."""

    def write(value=1.0, sigma=1.0):
        lines = simulated_example()[0].read_text(encoding="utf-8").splitlines()
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        for row in rows:
            row["bsdf_per_sr"] = float(row["bsdf_per_sr"]) * value
            row["sigma_per_sr"] = float(row["sigma_per_sr"]) * sigma
        path = tmp_path / "spoiled.csv"
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
        return path

    return write


def test_a_misfit_is_the_headline_and_the_exit_code(run, spoiled, tmp_path):  # noqa: F811
    data = spoiled(sigma=0.5)
    done = run("fit", data, "--sample", SAMPLE, "--out", tmp_path / "out", "--no-figures")
    assert done.exit_code == 3
    lines = done.stdout.splitlines()
    written = json.loads((tmp_path / "out" / "result.json").read_text())
    assert lines[0] == written["verdict"]["sentence"]
    assert (written["verdict"]["code"], written["verdict"]["standard_errors_hold"]) == ("misfit", False)
    assert written["verdict"]["reduced_chi_square"] == pytest.approx(3.7, rel=0.05)
    # In the heads of parameters and of optical properties, which may be in two lines.
    assert done.stdout.count("value(meaningless") == 2
    # The command to type next is the last line, and can be typed as it is.
    last = [line.strip() for line in lines if line.strip()][-1]
    assert last == f"jaxink diagnose {data} --sample {SAMPLE} --out {tmp_path / 'out'}-report"


def test_overstated_noise_is_said_but_no_failure(run, spoiled, tmp_path):  # noqa: F811
    data = spoiled(sigma=10.0)
    done = run(
        "fit", data, "--sample", SAMPLE, "--out", tmp_path / "out", "--no-figures", "--profile", "none"
    )
    assert done.exit_code == 0
    written = json.loads((tmp_path / "out" / "result.json").read_text())
    assert written["verdict"]["code"] == "overstated_noise"
    assert done.stdout.splitlines()[0] == written["verdict"]["sentence"]
    assert "meaningless" not in done.stdout


def test_a_mistake_stops_a_diagnosis_before_it_looks_for_effects(run, tmp_path, told):  # noqa: F811
    lines = simulated_example()[0].read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    for row in rows:
        row["side"] = "T" if row["side"] == "R" else "R"
    data = tmp_path / "exchanged.csv"
    with data.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    done = run("diagnose", data, "--sample", SAMPLE, "--out", tmp_path / "report", "--no-figures")
    assert done.exit_code == 3
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    assert report["verdict"]["code"] == "input_mistake"
    assert report["verdict"]["sentence"] in done.stdout
    assert report["candidates"] == []
    told(report["verdict"]["sentence"])
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "R and T" in page
