"""A file that is missing or broken for a while: no result is lost, and what is said of it is true."""

import pandas
import pytest

import jaxink
from tests.batches.test_run import ANSWERED, FAULTS, NEVER, run, values

KEPT = "input missing or refused now; the earlier result is kept"


@pytest.fixture
def tabled(folder):
    """Measurements by a table, which names files whether they are there or not."""
    (folder / "list.csv").write_text("file,plate.thickness_mm\nsheet_1.csv,1\nsheet_2.csv,1\nsheet_3.csv,1\n")
    text = (folder / "plan.toml").read_text().replace('files = "*.csv"', 'table = "list.csv"')
    (folder / "plan.toml").write_text(text)
    return folder


def test_a_result_outlives_its_missing_measurement(tabled):
    run(tabled)
    (tabled / "sheet_2.csv").rename(tabled / "away")
    row = (tabled / "out/rows/sheet_2.json").read_bytes()
    for workers in (0, 1):
        found = run(tabled, NEVER, workers=workers, retry=True)
        assert values(found) == {"sheet_1": 1.0, "sheet_2": 2.0, "sheet_3": 3.0}
        assert (found.kept, list(found.absent), found.again, found.trouble) == (2, ["sheet_2"], (), ())
        assert "sheet_2.csv" in found.absent["sheet_2"]
    assert (tabled / "out/rows/sheet_2.json").read_bytes() == row
    assert (tabled / "out/results/sheet_2/figures/cut.png").read_bytes() == b"png"
    table = pandas.read_csv(tabled / "out/summary.csv", index_col="name")
    assert dict(table["state"]) == {"sheet_1": "current", "sheet_2": KEPT, "sheet_3": "current"}
    assert f"1 of the 3: {KEPT}." in " ".join(found.summary().split())
    page = (tabled / "out/report.html").read_text(encoding="utf-8")
    assert (
        "sheet_2.csv" in page.split('<section id="input-missing-or-refused-now">')[1].split("</section>")[0]
    )


def test_an_unchanged_file_that_is_back_is_not_done_again(tabled):
    run(tabled)
    (tabled / "sheet_2.csv").rename(tabled / "away")
    run(tabled, NEVER)
    (tabled / "away").rename(tabled / "sheet_2.csv")
    found = run(tabled, NEVER)
    assert (found.kept, found.absent, found.again) == (3, {}, ())


def test_files_that_cannot_be_read_lose_nothing_either(tabled):
    run(tabled)
    for number in (1, 2, 3):
        (tabled / f"sheet_{number}.csv").unlink()
    (tabled / "sheet_3.csv").mkdir()
    found = run(tabled, NEVER)
    assert len(values(found)) == len(found.absent) == 3


@pytest.mark.parametrize("workers", [0, 1])
def test_a_result_outlives_its_broken_measurement(workers, tabled):
    run(tabled)
    row = (tabled / "out/rows/sheet_2.json").read_bytes()
    (tabled / "sheet_2.csv").write_text("broken")
    found = run(tabled, FAULTS, workers=workers)
    assert values(found) == {"sheet_1": 1.0, "sheet_2": 2.0, "sheet_3": 3.0}
    assert (found.kept, list(found.absent), found.again, found.trouble) == (2, ["sheet_2"], (), ())
    assert found.absent["sheet_2"].endswith(
        "is broken; input refused now, so the earlier result is kept, although its measurement changed since."
    )
    assert (tabled / "out/rows/sheet_2.json").read_bytes() == row
    assert (tabled / "out/results/sheet_2/figures/cut.png").read_bytes() == b"png"
    (tabled / "sheet_2.csv").write_text("2")
    found = run(tabled, NEVER)
    assert (found.kept, found.absent, found.again) == (3, {}, ())


def test_a_result_outlives_a_refused_value_of_its_table(tabled):
    run(tabled)
    text = (tabled / "list.csv").read_text()
    (tabled / "list.csv").write_text(text.replace("sheet_2.csv,1", "sheet_2.csv,-1"))
    found = run(tabled, NEVER)
    assert (values(found)["sheet_2"], list(found.absent), found.again) == (2.0, ["sheet_2"], ())
    assert "plate.thickness_mm is -1 mm" in found.absent["sheet_2"]


def test_what_else_has_changed_meanwhile_is_said(tabled):
    run(tabled)
    (tabled / "sheet_2.csv").unlink()
    (tabled / "plan.toml").write_text((tabled / "plan.toml").read_text() + "[fit]\nseed = 5\n")
    found = run(tabled)
    assert found.absent["sheet_2"].endswith("is kept, although the options changed since.")
    assert found.again == tuple(f"sheet_{i} is done again: the options changed." for i in (1, 3))


def test_only_what_is_true_is_said_of_a_measurement_that_has_come(tabled):
    (tabled / "sheet_2.csv").rename(tabled / "away")
    first = run(tabled)
    assert [row.outcome for row in first] == ["done", "refused", "done"]
    assert not first.absent
    (tabled / "away").rename(tabled / "sheet_2.csv")
    found = run(tabled)
    why = "sheet_2 is done again: its measurement could not be read before, and now it can."
    assert (found.again, values(found)["sheet_2"]) == ((why,), 2.0)


def test_a_folder_whose_row_is_damaged_outlives_a_missing_measurement(tabled):
    run(tabled)
    (tabled / "sheet_2.csv").unlink()
    (tabled / "out/rows/sheet_2.json").write_text("{")
    assert [row.outcome for row in run(tabled)] == ["done", "refused", "done"]
    assert (tabled / "out/results/sheet_2/fit.html").exists()


@pytest.mark.parametrize("name", ["sample.toml", "list.csv"])
def test_a_missing_sample_or_table_loses_nothing(name, tabled):
    run(tabled)
    before = {file: file.read_bytes() for file in (tabled / "out").rglob("*") if file.is_file()}
    (tabled / name).rename(tabled / "away")
    with pytest.raises(jaxink.InputRefusedError, match=name):
        run(tabled, NEVER)
    assert {file: file.read_bytes() for file in (tabled / "out").rglob("*") if file.is_file()} == before
    (tabled / "away").rename(tabled / name)
    assert run(tabled, ANSWERED).kept == 3
