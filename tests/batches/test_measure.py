"""The work on one measurement is that of ``jaxink fit``, and whatever goes wrong is a row."""

import subprocess
import sys

import numpy as np
import pytest

import jaxink
from jaxink.batches.measure import measure
from jaxink.batches.plan import load_plan
from jaxink.batches.task import task_of
from jaxink.data import simulated_example

OPTIONS = {"accuracy": 1e-2, "profile": "none"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A batch of one short simulated measurement, and of some bad ones."""
    folder = tmp_path_factory.mktemp("batch")
    data, sample = simulated_example()
    lines = data.read_text(encoding="utf-8").splitlines()
    good = [lines[0], *lines[1::11]]
    texts = {
        "good": good,
        "nan": [*good[:3], good[3].replace(good[3].split(",")[5], "nan"), *good[4:]],
        "red": [line.replace(",550,", ",650,") for line in good],
    }
    for name, rows in texts.items():
        (folder / f"{name}.csv").write_text("\n".join(rows))
    (folder / "sample.toml").write_text(sample.read_text(encoding="utf-8"))
    (folder / "plan.toml").write_text(
        'schema_version = 1\nsample = "sample.toml"\n[measurements]\nfiles = "*.csv"\n'
        '[fit]\naccuracy = 0.01\nprofile = "none"\n'
    )
    return folder


def tasks(folder):
    plan = load_plan(folder / "plan.toml")
    return {one.name: task_of(one, plan) for one in plan.measurements}


def test_a_batch_is_a_loop_of_fits(folder):
    found = jaxink.batch(folder / "plan.toml", folder / "out", workers=0)
    good, nan, red = found
    alone = jaxink.fit(folder / "good.csv", folder / "sample.toml", jaxink.FitOptions(**OPTIONS))
    assert (good.outcome, good.verdict) == ("done", alone.verdict.code)
    for p in good.parameters:
        np.testing.assert_allclose(p.value, alone[p.name].value, rtol=1e-8)
        np.testing.assert_allclose(p.standard_error, alone[p.name].standard_error, rtol=1e-6)
    assert good.reduced_chi_square == pytest.approx(alone.merit.reduced_chi_square, rel=1e-8)
    # The folder is that of `jaxink fit`, with a page besides.
    kept = jaxink.load_result(folder / "out/results/good")
    assert kept.values == pytest.approx(alone.values, rel=1e-8)
    assert "reduced chi-square" in (folder / "out" / good.page).read_text(encoding="utf-8")
    assert [row.outcome for row in (nan, red)] == ["refused", "refused"]
    assert f"{folder / 'nan.csv'}, row 4, column bsdf_per_sr" in nan.sentence
    assert "650 nm" in red.sentence


def test_an_unexpected_error_is_a_row(folder, monkeypatch):
    def fails(*_):
        raise ZeroDivisionError("a mistake of the library")

    monkeypatch.setattr(jaxink, "fit", fails)
    done = measure(tasks(folder)["good"])
    assert (done.row.outcome, done.files) == ("failed", {})
    assert "ZeroDivisionError" in done.row.sentence


def test_importing_jaxink_needs_neither_dask_nor_pandas():
    code = "import sys, jaxink; sys.exit(any(m in sys.modules for m in ('dask', 'distributed', 'pandas')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
