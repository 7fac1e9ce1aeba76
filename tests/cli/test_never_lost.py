"""What is fitted stays, whatever fails once it is written."""

import json
from pathlib import Path

import pytest

import jaxink
from jaxink.cli.fit import run_fit, write_result
from jaxink.data import simulated_example
from jaxink.plots.figure import PageFigure
from jaxink.report import write_report
from tests.cli.test_process import jaxink as command
from tests.report.conftest import change, found  # noqa: F401

DATA, SAMPLE = map(str, simulated_example())


def broken(problem):
    """A method `savefig` that fails for in-plane scans in transmission only."""
    save = PageFigure.savefig

    def fails(page, *arguments, **options):
        title = " ".join(text.get_text() for text in page.texts)
        if "in-plane scans" in title and "transmission" in title:
            raise problem
        save(page, *arguments, **options)

    return fails


@pytest.mark.parametrize("backend", ["module://matplotlib_inline.backend_inline", "none such"])
def test_the_backend_of_a_notebook_concerns_no_command(backend, tmp_path):
    fast = "--accuracy", "0.1", "--profile", "none"
    words = ("fit", DATA, "--sample", SAMPLE, "--out", "out", "--quiet", *fast)
    done = command(*words, cwd=tmp_path, MPLBACKEND=backend, DISPLAY="")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (tmp_path / "out" / "figures" / "cuts_R_550nm.png").read_bytes().startswith(b"\x89PNG")


def test_a_figure_that_fails_costs_itself_only(example_result, tmp_path, monkeypatch, capsys, told):
    monkeypatch.setattr(PageFigure, "savefig", broken(ValueError("no such font")))
    files = write_result(example_result, tmp_path / "out", ("png", "pdf"))
    told(capsys.readouterr().err, "jaxink: ", "cuts_T_550nm", "no such font")
    drawn = [file.name for file in files if file.parent.name == "figures"]
    assert drawn == ["cuts_R_550nm.pdf", "cuts_R_550nm.png"]
    assert all(file.is_file() for file in files)
    assert jaxink.load_result(tmp_path / "out").values == example_result.values


def test_without_matplotlib_there_is_the_result(example_result, tmp_path, monkeypatch, capsys, told):
    monkeypatch.setitem(__import__("sys").modules, "jaxink.plots.figure", None)
    files = write_result(example_result, tmp_path / "out", ("png",))
    told(capsys.readouterr().err, "jaxink: ", "jaxink.plots.figure")
    assert files
    assert not (tmp_path / "out" / "figures").exists()
    assert jaxink.load_result(tmp_path / "out").values == example_result.values


@pytest.mark.parametrize("problem", [KeyboardInterrupt, SystemExit])
def test_the_result_is_in_place_before_anything_is_drawn(problem, example_result, tmp_path, monkeypatch):
    """Also where drawing ends the process, as a lack of memory or Ctrl-C does."""
    out = tmp_path / "out"
    write_result(example_result, out, ("png",))
    (out / "result.json").unlink()
    monkeypatch.setattr(PageFigure, "savefig", broken(problem()))
    with pytest.raises(problem):
        write_result(example_result, out, ("png",))
    assert jaxink.load_result(out).values == example_result.values
    # Figures of an older result would lie about this one.
    assert not (out / "figures").exists()


def test_a_disk_that_is_full_for_figures_keeps_the_result(
    example_result, tmp_path, monkeypatch, capsys, told
):
    from jaxink.files import writing

    placed = []

    def full(new, out, owned):
        if placed:
            raise OSError(28, "No space left on device")
        placed.append(out)
        take_place(new, out, owned)

    take_place = writing.take_place
    monkeypatch.setattr(writing, "take_place", full)
    files = write_result(example_result, tmp_path / "out", ("png",))
    told(capsys.readouterr().err, "jaxink: ", "No space left on device")
    assert files
    assert {file.parent.name for file in files} == {"out"}
    assert jaxink.load_result(tmp_path / "out").values == example_result.values


def test_a_report_names_the_figures_that_it_lacks(found, change, tmp_path, monkeypatch, caplog, told):  # noqa: F811
    monkeypatch.setattr(PageFigure, "savefig", broken(ValueError("no such font")))
    files = write_report(found, tmp_path, change=change)
    (sentence,) = [record.getMessage() for record in caplog.records]
    told(sentence, "cuts_T_550nm", "no such font")
    assert sentence in (tmp_path / "report.html").read_text(encoding="utf-8")
    names = [file.name for file in files]
    assert "cuts_R_550nm.png" in names
    assert "cuts_T_550nm.png" not in names
    assert json.loads((tmp_path / "report.json").read_text()) == found.to_dict()


def test_a_diagnosis_is_in_place_before_its_page(found, change, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.setattr(PageFigure, "savefig", broken(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        write_report(found, tmp_path, change=change)
    assert jaxink.load_diagnosis(tmp_path).verdict == found.verdict


def test_a_table_of_the_ink_that_fails_costs_itself_only(found, tmp_path, monkeypatch, caplog, told):  # noqa: F811
    def fails(_):
        raise FloatingPointError("overflow")

    monkeypatch.setattr("jaxink.report.writing.inside_change", fails)
    files = write_report(found, tmp_path, with_figures=False)
    told(caplog.records[0].getMessage(), "overflow")
    assert {"report.html", "report.json", "sample.toml"} <= {file.name for file in files}


def test_a_fit_whose_input_is_still_tested_is_kept(tmp_path, monkeypatch, example_result, capsys, told):
    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    monkeypatch.setattr("jaxink.fit", lambda *_: example_result)
    monkeypatch.setattr("jaxink.fitting.check_input", stopped)
    monkeypatch.setattr("jaxink.fitting.is_doubtful", lambda _: True)
    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        run_fit([Path(DATA)], Path(SAMPLE), out, {}, {}, (), "quiet")
    told(capsys.readouterr().err, "kept")
    assert jaxink.load_result(out).values == example_result.values
    # Left out, nothing is tested.
    run_fit([Path(DATA)], Path(SAMPLE), out, {}, {}, (), "quiet", checks_input=False)
