"""``jaxink batch``: what it prints, its exit codes, and that Ctrl-C loses nothing."""

import dataclasses
import json
from contextlib import contextmanager

import pytest
from typer.testing import CliRunner

from jaxink.batches.on_dask import LostSchedulerError
from jaxink.cli.app import app
from tests.batches.functions import answered, interrupted_at_three
from tests.samples import GOOD_SAMPLE

PLAN = 'schema_version = 1\nsample = "sample.toml"\n[measurements]\nfiles = "*.csv"\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "plan.toml").write_text(PLAN)
    (tmp_path / "sample.toml").write_text(GOOD_SAMPLE)
    for number in (1, 2, 3):
        (tmp_path / f"sheet_{number}.csv").write_text(str(number))
    monkeypatch.setattr("jaxink.batches.measure.measure", answered)
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    return tmp_path


def batch(folder, *options):
    words = ["batch", str(folder / "plan.toml"), "--out", str(folder / "out"), "--workers", "0", *options]
    return CliRunner().invoke(app, words)


def test_all_with_a_result_is_success(folder):
    done = batch(folder)
    assert (done.exit_code, "3 done" in done.stdout) == (0, True)
    assert (folder / "out/report.html").exists()
    assert "3 of them done before" in batch(folder).stdout


def test_trouble_is_a_line_and_an_exit_code(folder):
    (folder / "table.csv").write_text("file\nsheet_1.csv\nsheet_7.csv\n")
    (folder / "plan.toml").write_text(PLAN.replace('files = "*.csv"', 'table = "table.csv"'))
    done = batch(folder)
    assert done.exit_code == 4
    assert "sheet_7.csv" in done.stderr
    assert batch(folder, "--quiet").stderr == ""


def test_a_result_without_its_input_is_kept_and_told(folder):
    (folder / "table.csv").write_text("file\nsheet_1.csv\nsheet_2.csv\n")
    (folder / "plan.toml").write_text(PLAN.replace('files = "*.csv"', 'table = "table.csv"'))
    assert batch(folder).exit_code == 0
    (folder / "sheet_2.csv").unlink()
    done = batch(folder)
    assert done.exit_code == 4
    assert "sheet_2: " in done.stderr
    assert "input missing now, so the earlier result is kept." in done.stderr
    assert list(json.loads(batch(folder, "--json").stdout)["absent"]) == ["sheet_2"]


def test_misfits_are_told_and_an_exit_code(folder, monkeypatch):
    def missed(task):
        done = answered(task)
        return dataclasses.replace(done, row=dataclasses.replace(done.row, verdict="misfit"))

    monkeypatch.setattr("jaxink.batches.measure.measure", missed)
    done = batch(folder)
    assert done.exit_code == 3
    assert "3 misfit: the residual exceeds the noise" in " ".join(done.stdout.split())
    assert "jaxink diagnose" in done.stdout


def test_progress_ends_with_all_measurements(folder):
    (folder / "plan.toml").write_text(PLAN.replace('files = "*.csv"', 'table = "table.csv"'))
    (folder / "table.csv").write_text("file\nsheet_1.csv\n")
    assert batch(folder).stderr == ""
    (folder / "table.csv").write_text("file\nsheet_7.csv\nsheet_3.csv\nsheet_1.csv\n")
    told = [line.split(" s ")[1].split(";")[0].strip() for line in batch(folder).stderr.splitlines()]
    assert told == ["1 of 3", "3 of 3"]


def test_the_summary_as_json(folder):
    summary = json.loads(batch(folder, "--json").stdout)
    assert summary["columns"]["ink.scattering_per_mm"] == [1.0, 2.0, 3.0]


def test_ctrl_c_says_how_to_go_on(folder, monkeypatch):
    monkeypatch.setattr("jaxink.batches.measure.measure", interrupted_at_three)
    done = batch(folder)
    assert done.exit_code == 130
    assert "2 of 3" in done.stderr
    monkeypatch.setattr("jaxink.batches.measure.measure", answered)
    assert "2 of them done before" in batch(folder).stdout


def test_a_bad_plan_is_one_sentence(folder, told):
    (folder / "plan.toml").write_text(PLAN.replace("[measurements]", "[measurement]"))
    done = batch(folder)
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, "jaxink: ", "'measurement'")
    assert not (folder / "out").exists()


@pytest.mark.parametrize("n_answered", [0, 1])
def test_a_lost_scheduler_is_a_sentence_after_the_summary(n_answered, folder, monkeypatch, told):
    @contextmanager
    def client(address):
        yield address

    def measured_by(client, tasks, *_):
        for _, task in zip(range(n_answered), tasks, strict=False):
            yield answered(task)
        raise LostSchedulerError

    monkeypatch.setattr("jaxink.batches.run.remote_client", client)
    monkeypatch.setattr("jaxink.batches.run.measured_by", measured_by)
    words = [str(folder / "plan.toml"), "--out", str(folder / "out"), "--scheduler", "tcp://127.0.0.1:8786"]
    done = CliRunner().invoke(app, ["batch", *words])
    assert done.exit_code == 6
    told(done.stderr, "jaxink: ", f"{n_answered} of 3 measurements", "same command")
    assert f"{3 - n_answered} measurements have no row yet" in " ".join(done.stdout.split())
    assert (folder / "out/summary.csv").read_text(encoding="utf-8").startswith("name,")
    assert f"{n_answered} of them done before" in batch(folder).stdout
