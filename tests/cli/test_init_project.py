"""A first project is accepted as it is, says what may differ, and how its files will be divided."""

import csv
import shlex

import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app

HEADER = ["theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr"]


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments, answers=None: CliRunner().invoke(app, [*map(str, arguments)], input=answers)


@pytest.fixture
def write(tmp_path):
    """Write a file with four directions of each state, whose cells are given by column."""

    def write(name, columns=None, without=()):
        states = list(zip(*columns.values(), strict=True)) if columns else [()]
        rows = [
            [30, view, 180, 550, side, 0.2 + 0.01 * k + view / 1000, *state]
            for k, state in enumerate(states)
            for side in "RT"
            for view in (0, 20, 40, 60)
        ]
        (tmp_path / name).parent.mkdir(exist_ok=True)
        table = [[*HEADER, *(columns or {})], *rows]
        keep = [k for k, head in enumerate(table[0]) if head not in without]
        with open(tmp_path / name, "w", newline="") as file:
            csv.writer(file).writerows([row[k] for k in keep] for row in table)
        return name

    return write


def names(folder, name="project.toml"):
    return [one.name for one in jaxink.load_project(folder / name).measurements]


def test_two_files(run, write, tmp_path, told):
    done = run("init", write("thin.csv"), write("thick print.csv"), "--project", "--ink-um", 30)
    assert (done.exit_code, done.stderr) == (0, "")
    told(done.stdout, "project.toml", "sample.toml")
    told((tmp_path / "project.toml").read_text(), numbers=False)
    assert names(tmp_path) == ["thin", "thick_print"]
    assert jaxink.load_sample(tmp_path / "sample.toml").parameters["ink.thickness_um"].value == 30
    words = shlex.split(done.stdout.splitlines()[-1])
    assert words == ["Next:", "jaxink", "fit", "project.toml", "--out", "result"]


def test_files_with_conditions(run, write, tmp_path, told):
    runs = {
        "lit_side": ["ink", "plate", "plate"],
        "thickness (um)": [40, 40, 75],
        "card": ["Black", "none", "shelf 3"],
        "specimen": ["a", "a", "No 2"],
    }
    done = run("init", write("runs.csv", runs), write("one.csv", {"lit_side": ["ink"]}), "--project")
    assert (done.exit_code, done.stderr) == (0, "")
    told((tmp_path / "project.toml").read_text(), "ASSUMED", "[specimens.a]", numbers=False)
    project = jaxink.load_project(tmp_path / "project.toml")
    assert names(tmp_path) == [
        "runs_ink_a_40um_Black",
        "runs_plate_a_40um_none",
        "runs_plate_No_2_75um_shelf_3",
        "one",
    ]
    # The sample is that of the first rows.
    sample = jaxink.load_sample(tmp_path / "sample.toml")
    assert [layer.name for layer in sample.layers] == ["ink", "plate"]
    assert sample.parameters["ink.thickness_um"].value == 40
    assert project["one"].sample.layers[0].name == "ink"
    assert project.parameters["backing_Black/backing.reflectance"].value == 0.04


def test_one_file_in_another_folder(run, write, tmp_path):
    (tmp_path / "fits").mkdir()
    write("data/runs.csv", {"lit_side": ["plate", "ink"]})
    done = run("init", "data/runs.csv", "--project", "--out", "fits/both.toml", "--quiet")
    assert (done.exit_code, done.stdout) == (0, "")
    assert names(tmp_path, "fits/both.toml") == ["runs_plate", "runs_ink"]
    assert (tmp_path / "fits" / "sample.toml").exists()


def test_what_the_files_do_not_state_is_kept(run, write, tmp_path):
    lacking = ("side", "wavelength_nm")
    for name in ("R.csv", "a/R.csv"):
        write(name, without=lacking)
        lines = (tmp_path / name).read_text().splitlines()
        (tmp_path / name).write_text("\n".join(lines[:5]))
    stated = ("--side", "R,T", "--wavelength-nm", 550, "--columns", "theta_o_deg=theta_o_deg")
    done = run("init", "R.csv", "a/R.csv", "--project", *stated)
    assert (done.exit_code, done.stderr) == (0, "")
    project = jaxink.load_project(tmp_path / "project.toml")
    assert [set(one.data.side) for one in project.measurements] == [{"R"}, {"T"}]
    assert names(tmp_path) == ["R", "R_2"]


def test_questions_are_asked_once(run, write, tmp_path, monkeypatch):
    monkeypatch.setattr("jaxink.cli.init._is_terminal", lambda: True)
    write("runs.csv", {"lit_side": ["plate", "ink"], "thickness_um": [30, 60]})
    done = run("init", "runs.csv", "--project", answers="1.5\n2\n1.5\nrayleigh\n")
    assert (done.exit_code, done.stderr) == (0, "")
    assert jaxink.load_sample(tmp_path / "sample.toml").parameters["ink.thickness_um"].value == 30


@pytest.mark.parametrize("there", ["project.toml", "sample.toml"])
def test_what_exists_is_kept(there, run, write, tmp_path, told):
    write("ink.csv")
    (tmp_path / there).write_text("mine")
    done = run("init", "ink.csv", "--project")
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, there, "--force")
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["ink.csv", there])
    assert run("init", "ink.csv", "--project", "--force").exit_code == 0
    assert names(tmp_path) == ["ink"]


@pytest.mark.parametrize(
    ("columns", "options", "named"),
    [
        ({"lit_side": ["top", "bottom"]}, (), ("'top'", "lit_side")),
        ({"thickness": [30, 60]}, (), ("thickness_um",)),
        ({}, ("--out", "sample.toml"), ("sample.toml", "project.toml")),
        ({}, ("--out", "absent/project.toml"), ("absent/project.toml",)),
    ],
    ids=["top", "no unit", "name of the sample", "no folder"],
)
def test_a_refusal_writes_nothing(columns, options, named, run, write, tmp_path, told):
    write("ink.csv", columns)
    done = run("init", "ink.csv", "--project", *options)
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, "jaxink: ", *named)
    assert [p.name for p in tmp_path.iterdir()] == ["ink.csv"]


def test_several_conditions_without_a_project(run, write, told):
    done = run("init", write("ink.csv", {"lit_side": ["plate", "ink"]}))
    assert done.exit_code == 5
    told(done.stderr, "lit_side", "jaxink init --project")
