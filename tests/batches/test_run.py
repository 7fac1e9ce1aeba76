"""Batches with a stand-in for the fit: nothing is lost, nothing is done twice, and trouble is a row."""

import json

import pandas
import pytest

import jaxink
from jaxink.batches.folder import BatchFolder

STANDS_IN = "tests.batches.functions:"
ANSWERED, FAULTS, NEVER = (STANDS_IN + name for name in ("answered", "with_faults", "never"))


def run(folder, function=ANSWERED, workers=0, **options):
    return jaxink.batch(folder / "plan.toml", folder / "out", workers=workers, function=function, **options)


def values(found):
    return {row.name: row.parameters[0].value for row in found if row.parameters}


def test_each_measurement_has_a_row_a_folder_and_a_line_of_the_summary(folder):
    found = run(folder)
    assert values(found) == {"sheet_1": 1.0, "sheet_2": 2.0, "sheet_3": 3.0}
    assert (folder / "out/results/sheet_2/figures/cut.png").read_bytes() == b"png"
    table = pandas.read_csv(folder / "out/summary.csv", index_col="name")
    assert list(table["ink.scattering_per_mm"]) == [1.0, 2.0, 3.0]
    assert list(table["ink.scattering_per_mm_se"]) == [0.5] * 3
    assert set(table["outcome"]) == {"done"}
    pandas.testing.assert_frame_equal(found.to_frame(), pandas.read_parquet(folder / "out/summary.parquet"))


def test_what_is_done_is_not_done_again(folder):
    before = run(folder)
    again = run(folder, NEVER)
    assert again.kept == 3
    assert [row.to_dict() for row in again] == [row.to_dict() for row in before]


def test_what_has_changed_is_done_again_and_said(folder):
    run(folder)
    (folder / "sheet_2.csv").write_text("2.5")
    found = run(folder)
    assert values(found) == {"sheet_1": 1.0, "sheet_2": 2.5, "sheet_3": 3.0}
    assert found.kept == 2
    assert [sentence.split()[0] for sentence in found.again] == ["sheet_2"]


def test_a_damaged_row_or_a_lost_result_is_done_again(folder):
    run(folder)
    (folder / "out/rows/sheet_1.json").write_text("{")
    (folder / "out/results/sheet_2/fit.html").unlink()
    found = run(folder)
    assert (found.kept, len(values(found))) == (1, 3)


def test_a_missing_file_is_a_row_and_is_done_when_it_comes(folder):
    (folder / "list.csv").write_text("file\nsheet_1.csv\nsheet_9.csv\nsheet_3.csv\n")
    text = (folder / "plan.toml").read_text().replace('files = "*.csv"', 'table = "list.csv"')
    (folder / "plan.toml").write_text(text)
    found = run(folder)
    assert [row.outcome for row in found] == ["done", "refused", "done"]
    assert "sheet_9.csv" in found.rows[1].sentence
    (folder / "sheet_9.csv").write_text("9")
    assert values(run(folder))["sheet_9"] == 9.0


def test_rows_of_an_earlier_plan_are_kept_and_not_listed(folder):
    run(folder)
    (folder / "sheet_3.csv").unlink()
    found = run(folder, NEVER)
    assert (len(found), found.others) == (2, 1)
    assert (folder / "out/rows/sheet_3.json").exists()


def test_an_interrupted_batch_goes_on(folder):
    with pytest.raises(KeyboardInterrupt):
        run(folder, STANDS_IN + "interrupted_at_three")
    found = run(folder)
    assert (found.kept, len(values(found))) == (2, 3)


def test_what_ended_this_process_twice_is_not_begun_a_third_time(folder):
    # As a process leaves it that was killed in the middle.
    BatchFolder(folder / "out").note_tries({"sheet_1": 2, "sheet_2": 1})
    seen = []
    found = run(folder, follow=lambda row, n_done, n_all: seen.append((row.name, n_done, n_all)))
    assert [row.outcome for row in found] == ["killed", "done", "done"]
    # What may end it again comes after the others.
    assert seen == [("sheet_3", 1, 3), ("sheet_2", 2, 3), ("sheet_1", 3, 3)]
    assert run(folder, NEVER).kept == 3
    assert values(run(folder, retry=True))["sheet_1"] == 1.0


def test_two_batches_do_not_write_to_one_folder(folder):
    with BatchFolder(folder / "out").locked(), pytest.raises(jaxink.InputRefusedError):
        run(folder)


def test_workers_of_dask_answer_and_trouble_is_a_row(folder):
    for i, content in enumerate(("hang", "die", "die once", "4", "eat", "5"), 4):
        (folder / f"sheet_{i}.csv").write_text(content)
    plan = (folder / "plan.toml").read_text() + "[limits]\nseconds = 5\nmemory_gib = 0.5\n"
    (folder / "plan.toml").write_text(plan)
    found = run(folder, FAULTS, workers=2)
    outcomes = ["done"] * 3 + ["time_limit", "killed", "done", "done", "memory_limit", "done"]
    assert [row.outcome for row in found] == outcomes
    assert [values(found)[f"sheet_{i}"] for i in (1, 2, 3, 6, 7, 9)] == [1.0, 2.0, 3.0, 7.0, 4.0, 5.0]
    assert [row.attempts for row in found][4:6] == [2, 2]
    again = run(folder, NEVER, workers=2)
    assert (again.kept, [row.outcome for row in again]) == (9, outcomes)


def test_the_workers_of_a_scheduler_that_runs_do_the_same(folder):
    from distributed import LocalCluster

    (folder / "sheet_4.csv").write_text("die")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(protocol="tcp", **options) as cluster:
        found = run(folder, FAULTS, workers=None, scheduler=cluster.scheduler_address)
        # It goes on serving others.
        assert len(cluster.scheduler.workers) == 2
    assert [row.outcome for row in found] == ["done"] * 3 + ["killed"]


def test_workers_and_a_scheduler_exclude_each_other(folder):
    with pytest.raises(jaxink.InputRefusedError, match="scheduler"):
        run(folder, workers=2, scheduler="tcp://127.0.0.1:8786")


def test_where_no_scheduler_answers_a_sentence_says_so(folder, monkeypatch):
    monkeypatch.setattr("jaxink.batches.on_dask._CONNECT_S", 0.5)
    with pytest.raises(jaxink.InputRefusedError, match=r"127\.0\.0\.1:9"):
        run(folder, workers=None, scheduler="tcp://127.0.0.1:9")


def test_a_row_of_another_version_is_no_row(folder):
    run(folder)
    file = folder / "out/rows/sheet_1.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"schema_version": 2}))
    assert BatchFolder(folder / "out").row("sheet_1") is None
