"""Plan files: what they mean, and that a bad one is rejected before anything runs."""

import pytest

import jaxink
from jaxink.batches.plan import load_plan
from jaxink.batches.task import MeasurementTask, Unreadable, task_of


def test_files_are_listed_by_name_and_options_kept(folder):
    text = (folder / "plan.toml").read_text().replace("[measurements]", 'work = "both"\n[measurements]')
    text += '[fit]\naccuracy = 0.01\nprofile = "none"\n[limits]\nseconds = 9\nmemory_gib = 2\n'
    (folder / "plan.toml").write_text(text + '[diagnosis]\nmax_effects = 1\n[reading]\nside = "R"\n')
    plan = load_plan(folder / "plan.toml")
    assert [one.name for one in plan.measurements] == ["sheet_1", "sheet_2", "sheet_3"]
    assert (plan.work, plan.seconds, plan.memory_gib) == ("both", 9.0, 2.0)
    assert plan.fit == {"accuracy": 0.01, "profile": "none"}
    assert (plan.diagnosis, plan.reading) == ({"max_effects": 1}, {"side": "R"})


def test_files_of_equal_names_are_told_apart_by_their_folders(folder):
    for name in ("a", "b"):
        (folder / name).mkdir()
        (folder / name / "scan.csv").write_text("1")
    text = (folder / "plan.toml").read_text().replace('"*.csv"', '"[ab]/*.csv"')
    (folder / "plan.toml").write_text(text)
    assert [one.name for one in load_plan(folder / "plan.toml").measurements] == ["a_scan.csv", "b_scan.csv"]


def tabled(folder, table):
    (folder / "sheets.csv").write_text(table)
    text = (folder / "plan.toml").read_text().replace('files = "*.csv"', 'table = "sheets.csv"')
    (folder / "plan.toml").write_text(text)
    return folder / "plan.toml"


def test_columns_of_a_table_go_into_the_sample(folder):
    table = "name,file,plate.thickness_mm,x_mm,y_mm,operator\n"
    table += "first,sheet_1.csv|sheet_2.csv,2.5,10,20,Ann\nsecond,sheet_3.csv,,30,20,Bob\n"
    plan = load_plan(tabled(folder, table))
    first, second = (task_of(one, plan) for one in plan.measurements)
    assert (first.name, first.contents, second.contents) == ("first", (b"1", b"2"), (b"3",))
    thickness = [
        next(p["value"] for p in task.sample["parameters"] if p["name"] == "plate.thickness_mm")
        for task in (first, second)
    ]
    assert thickness == [2.5, 1.0]
    assert plan.measurements[1].columns == {"x_mm": 30.0, "y_mm": 20.0, "operator": "Bob"}


def test_semicolons_separate_columns_too(folder):
    plan = load_plan(tabled(folder, "file;plate.thickness_mm\nsheet_1.csv;2\n"))
    assert plan.measurements[0].values == {"plate.thickness_mm": 2.0}


BAD_TABLES = {
    "no column file": ("sheet\nsheet_1.csv\n", "'file'"),
    "no rows": ("file\n", "no rows"),
    "unknown parameter": ("file,plate.thicknes_mm\nsheet_1.csv,1\n", "plate.thickness_mm"),
    "no number": ("file,plate.thickness_mm\nsheet_1.csv,thin\n", "row 2, column plate.thickness_mm"),
    "infinite": ("file,x_mm\nsheet_1.csv,inf\n", "row 2, column x_mm"),
    "no file": ("file,x_mm\n,1\n", "row 2, column file"),
    "cells missing": ("file,x_mm\nsheet_1.csv,1\nsheet_2.csv\n", "row 3"),
    "columns of one name": ("file,file\na,b\n", "row 1"),
    "measurements of one name": ("file\nsheet_1.csv\nsheet_1.csv\n", "sheet_1"),
}


@pytest.mark.parametrize(("table", "named"), BAD_TABLES.values(), ids=list(BAD_TABLES))
def test_a_bad_table_is_rejected(table, named, folder, told):
    with pytest.raises(jaxink.InputRefusedError) as caught:
        load_plan(tabled(folder, table))
    told(str(caught.value), named)
    assert "sheets.csv" in str(caught.value)


BAD_PLANS = {
    "no version": ("schema_version = 1\n", "", "schema_version"),
    "a sample file": ("[measurements]", "[[layers]]\n[measurements]", "sample file"),
    "unknown key": ("[measurements]", "worker = 3\n[measurements]", "'worker'"),
    "unknown work": ("[measurements]", 'work = "export"\n[measurements]', "work"),
    "no sample": ('sample = "sample.toml"\n', "", "sample"),
    "absent sample": ('"sample.toml"', '"simple.toml"', "simple.toml"),
    "no files": ('"*.csv"', '"*.txt"', "matches no file"),
    "files and table": ('files = "*.csv"', 'files = "*.csv"\ntable = "a.csv"', "one key"),
    "files is a number": ('"*.csv"', "3", "measurements.files"),
    "option of a fit": ('"*.csv"', '"*.csv"\n[fit]\naccurracy = 0.1', "accuracy"),
    "value of an option": ('"*.csv"', '"*.csv"\n[fit]\nmethod = "newton"', "[fit]"),
    "object of Python": ('"*.csv"', '"*.csv"\n[fit]\nconfig = 3', "config"),
    "diagnosis of a fit": ('"*.csv"', '"*.csv"\n[diagnosis]\nmax_effects = 1', "[diagnosis]"),
    "limit": ('"*.csv"', '"*.csv"\n[limits]\nseconds = -1', "limits.seconds"),
    "side": ('"*.csv"', '"*.csv"\n[reading]\nside = "front"', "side"),
    "matrix": ('"*.csv"', '"*.csv"\n[reading]\nmatrix = 1', "matrix"),
    "azimuth": ('"*.csv"', '"*.csv"\n[reading]\nphi_deg = true', "phi_deg"),
    "columns": ('"*.csv"', '"*.csv"\n[reading]\ncolumns = { side = 1 }', "columns"),
    "no TOML": ("[measurements]", "[measurements", "plan.toml"),
}


@pytest.mark.parametrize(("old", "new", "named"), BAD_PLANS.values(), ids=list(BAD_PLANS))
def test_a_bad_plan_is_rejected(old, new, named, folder, told):
    text = (folder / "plan.toml").read_text()
    assert text.count(old) == 1
    (folder / "plan.toml").write_text(text.replace(old, new))
    with pytest.raises(jaxink.InputRefusedError) as caught:
        load_plan(folder / "plan.toml")
    told(str(caught.value), named)


def test_a_value_beyond_the_physical_range_is_refused_for_its_row_only(folder):
    plan = load_plan(tabled(folder, "file,plate.thickness_mm\nsheet_1.csv,-1\nsheet_2.csv,1\n"))
    bad, good = (task_of(one, plan) for one in plan.measurements)
    assert isinstance(bad, Unreadable)
    assert isinstance(good, MeasurementTask)
    assert "plate.thickness_mm" in bad.sentence


def test_no_file_of_another_measurement_is_suggested_for_a_missing_one(folder):
    plan = load_plan(tabled(folder, "file\nsheet_03.csv\nsheet_1.csv\nsheet_2.csv\nsheet_3.csv\n"))
    assert task_of(plan.measurements[0], plan).sentence.endswith("there is no such measurement file.")
    plan = load_plan(tabled(folder, "file\nsheet_03.csv\nsheet_1.csv\nsheet_2.csv\n"))
    assert task_of(plan.measurements[0], plan).sentence.endswith("similar name there is sheet_3.csv.")


def test_digests_say_what_has_changed(folder):
    plan = load_plan(folder / "plan.toml")
    before = task_of(plan.measurements[0], plan).inputs
    assert task_of(plan.measurements[0], plan).inputs == before
    (folder / "sheet_1.csv").write_text("1.5")
    changed = task_of(plan.measurements[0], plan).inputs.changed_since(before)
    assert changed == ("its measurement changed",)
    (folder / "sheet_1.csv").write_text("1")
    sample = (folder / "sample.toml").read_text()
    (folder / "sample.toml").write_text(sample.replace("thickness_um = 80", "thickness_um = 81"))
    (folder / "plan.toml").write_text((folder / "plan.toml").read_text() + "[fit]\nseed = 1\n")
    other = load_plan(folder / "plan.toml")
    changed = task_of(other.measurements[0], other).inputs.changed_since(before)
    assert changed == ("its sample changed", "the options changed")
