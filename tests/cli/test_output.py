"""Where the commands write: refused before anything is computed, and whole or not at all after it."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.data import simulated_example
from jaxink.files.exchange import settle
from tests.ink.analytic_tables import smooth_table

DATA, SAMPLE = map(str, simulated_example())
SURFACE = (
    'index_inside = 1.5\nindex_outside = 1.0\nwavelength_nm = 550\n[facets]\ndensity = "ggx"\nsigma_deg = 9\n'
)


def tree(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture
def run(monkeypatch, coarse):
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    monkeypatch.setattr("jaxink.model.forward.model_sizes", lambda *_: coarse)
    return lambda *arguments: CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture
def nothing_is_computed(monkeypatch):
    def computed(*_, **__):
        raise AssertionError("something was computed")

    for name in ("jaxink.fit", "jaxink.diagnose", "jaxink.predict", "jaxink.read_ink_table"):
        monkeypatch.setattr(name, computed, raising=False)
    monkeypatch.setattr("jaxink.ink.boundary.boundary_table", computed)


FOLDERS = {
    "fit": ("fit", DATA, "--sample", SAMPLE, "--out"),
    "diagnose": ("diagnose", DATA, "--sample", SAMPLE, "--out"),
    "demo": ("demo", "--out"),
    "export": ("export", "table.nc", "--format", "csv", "--out"),
    "boundary": ("boundary", "surface.toml", "--format", "csv", "--out"),
}
PREDICT = ("predict", SAMPLE, DATA, "--out")
NO_FOLDERS = ("link", "file", "file/out", "circle", "closed/out", "closed", "full/out", "x" * 300)
NO_FILES = ("file/out.csv", "folder.csv", "pipe.csv", "closed/out.csv", "full/out.nc", "x" * 300 + ".csv")
REFUSED = [(FOLDERS[command], out) for command in FOLDERS for out in NO_FOLDERS]
REFUSED += [(PREDICT, out) for out in NO_FILES]


@pytest.fixture
def places(tmp_path, monkeypatch):
    """Places where nothing can be written, each for a reason of its own."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "link").symlink_to("absent")
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "file").write_text("")
    (tmp_path / "surface.toml").write_text(SURFACE)
    for name in ("closed", "full", "folder.csv"):
        (tmp_path / name).mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    access, write = os.access, Path.write_bytes

    def closed(path, mode, **options):
        # Root may write everywhere, so that permissions alone would not do.
        return not (mode & os.W_OK and Path(path).name == "closed") and access(path, mode, **options)

    def full(path, content):
        if "full" in path.parts:
            raise OSError(28, "No space left on device")
        return write(path, content)

    monkeypatch.setattr(os, "access", closed)
    monkeypatch.setattr(Path, "write_bytes", full)
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "out"), REFUSED, ids=[f"{r[0][0]} {ascii(r[1])[:20]}" for r in REFUSED]
)
def test_no_place_is_known_before_anything_is_computed(
    arguments, out, run, places, nothing_is_computed, told
):
    before = sorted(places.rglob("*"))
    done = run(*arguments, out)
    assert (done.exit_code, done.stdout) == (5, ""), done.output
    told(done.stderr, "jaxink: ", out[:4])
    assert done.stderr.count("\n") == 1
    assert sorted(places.rglob("*")) == before


def limited(run, *arguments):
    """Run a command that may write files of 20 kB at most, as by `ulimit -f 20`."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20480, hard))
    try:
        return run(*arguments)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("command", ["fit", "predict", "export"])
def test_what_the_disk_refuses_is_one_sentence_and_leaves_the_old_files(
    command, run, tmp_path, monkeypatch, example_result, told
):
    out = tmp_path / "out"
    out.mkdir()
    if command == "fit":
        example_result.save(out)
        monkeypatch.setattr(jaxink, "fit", lambda *_, **__: example_result, raising=False)
        arguments = ("fit", DATA, "--sample", SAMPLE, "--out", out)
    elif command == "predict":
        out = out / "prediction.nc"
        out.write_text("old")
        arguments = ("predict", SAMPLE, DATA, "--out", out)
    else:
        smooth_table().to_netcdf(tmp_path / "table.nc")
        (out / "ink.nc").write_text("old")
        arguments = ("export", tmp_path / "table.nc", "--format", "netcdf", "--out", out)
    before = tree(tmp_path)
    done = limited(run, *arguments)
    assert (done.exit_code, done.stdout) == (5, ""), done.output
    told(done.stderr, f"jaxink: {out}: ", "File too large")
    assert done.stderr.count("\n") == 1
    assert tree(tmp_path) == before


KILLED = """
import os, pathlib, signal, sys

kill_at, moved = sys.argv[1], []
write, rename = pathlib.Path.write_text, os.rename

def written(path, *arguments, **options):
    done = write(path, *arguments, **options)
    if kill_at == "writing":
        os.kill(os.getpid(), signal.SIGKILL)
    return done

def renamed(*paths):
    rename(*paths)
    moved.append(paths)
    if kill_at == "replacing" and len(moved) == 3:
        os.kill(os.getpid(), signal.SIGKILL)

pathlib.Path.write_text, os.rename = written, renamed
sys.argv = ["jaxink", *sys.argv[2:]]
from jaxink.cli import main
main()
"""


@pytest.mark.parametrize("kill_at", ["writing", "replacing"])
def test_a_killed_export_leaves_the_old_files_until_all_are_new_and_the_next_completes_it(
    kill_at, run, tmp_path
):
    table, out = tmp_path / "table.nc", tmp_path / "out"
    smooth_table().to_netcdf(table)
    arguments = ["export", str(table), "--format", "csv", "--out", str(out)]
    assert run(*arguments).exit_code == 0
    new = tree(out)
    for path in out.iterdir():
        path.write_text("old")
    old = tree(out)
    command = [sys.executable, "-c", KILLED, kill_at, *arguments]
    done = subprocess.run(command, timeout=120, check=False, capture_output=True)
    assert done.returncode == -signal.SIGKILL
    if kill_at == "writing":
        assert {name: text for name, text in tree(out).items() if not name.startswith(".")} == old
    else:
        settle(out)
        assert tree(out) == new
    assert run(*arguments).exit_code == 0
    assert tree(out) == new
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out", "table.nc"]


def test_a_fit_is_saved_beside_a_left_over_of_the_same_process_id(run, tmp_path, monkeypatch, example_result):
    monkeypatch.setattr(jaxink, "fit", lambda *_, **__: example_result, raising=False)
    left_over = tmp_path / f".out.jaxink-{os.getpid()}"
    left_over.mkdir()
    (left_over / "result.json").write_text("of another run")
    done = run("fit", DATA, "--sample", SAMPLE, "--out", tmp_path / "out", "--no-figures", "--quiet")
    assert (done.exit_code, done.stderr) == (0, "")
    assert jaxink.load_result(tmp_path / "out").merit == example_result.merit
    assert (left_over / "result.json").read_text() == "of another run"


def test_a_fit_into_a_folder_that_a_killed_one_left_half_replaced(tmp_path, example_result):
    """The folder holds a folder of the user's own, so that its entries are moved one by one."""
    example_result.save(tmp_path / "new")
    out = tmp_path / "out"
    example_result.save(out)
    (out / "mine").mkdir()
    stage = out / ".jaxink-abcdefgh"
    shutil.copytree(tmp_path / "new", stage / "decided")
    for name in ("old", "removed"):
        (stage / name).mkdir()
    (stage / "lock").touch()
    os.rename(out / "result.json", stage / "old" / "result.json")
    assert jaxink.load_result(out / "result.json").merit == example_result.merit
    assert sorted(p.name for p in out.iterdir()) == [
        "mine",
        "parameters.csv",
        "result.json",
        "result.nc",
        "sample.toml",
    ]
