"""Commands where what only POSIX or Linux has is absent, as on Windows."""

import os
import shutil
import subprocess
import sys

import pytest

from jaxink.data import simulated_example

# Locks, limits of resources, owners of files, the memory of a process, and the cores that it may use.
# Libraries beside jaxink have their own ways elsewhere.
WITHOUT = """
import builtins, os, pathlib, sys

for module in ("fcntl", "resource"):
    sys.modules[module] = None
for name in ("geteuid", "sched_getaffinity", "O_NOFOLLOW", "O_NONBLOCK", "link", "chown"):
    if hasattr(os, name):
        delattr(os, name)

def absent(plain):
    def opened(path, *arguments, **options):
        asks = sys._getframe(1).f_globals.get("__name__", "")
        if str(path).startswith("/proc/") and asks.startswith("jaxink"):
            raise FileNotFoundError(2, "No such file or directory", str(path))
        return plain(path, *arguments, **options)
    return opened

builtins.open = absent(open)
pathlib.Path.read_text = absent(pathlib.Path.read_text)
pathlib.Path.read_bytes = absent(pathlib.Path.read_bytes)

from jaxink.cli import main
main()
"""


def run(folder, *arguments):
    """A command as a user types it; in a child process of a batch, everything is there again."""
    environment = os.environ | {"JAXINK_CACHE_DIR": str(folder / "store")}
    command = [sys.executable, "-c", WITHOUT, *map(str, arguments)]
    return subprocess.run(
        command, env=environment, cwd=folder, timeout=300, check=False, capture_output=True, text=True
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("other_system")


@pytest.fixture(scope="module")
def fitted(folder):
    """A result that replaces an older one."""
    data, sample = simulated_example()
    (folder / "result").mkdir()
    (folder / "result" / "notes.txt").write_text("mine")
    options = ("--out", "result", "--accuracy", "0.02", "--quiet", "--no-figures", "--profile", "none")
    for _ in range(2):
        done = run(folder, "fit", data, "--sample", sample, *options)
        assert done.returncode == 0, done.stderr
    return folder / "result"


def test_a_fit_is_written_over_an_older_one(fitted):
    assert (fitted / "notes.txt").read_text() == "mine"
    assert {"result.json", "result.nc", "report.html"} <= {path.name for path in fitted.iterdir()}
    assert not list(fitted.parent.glob(".jaxink-*"))


def test_a_result_is_read_and_predicts(fitted, folder):
    data, _ = simulated_example()
    done = run(folder, "predict", fitted, data, "--out", "predicted.csv")
    assert done.returncode == 0, done.stderr
    assert (folder / "predicted.csv").is_file()


def test_programs_are_stored(fitted, folder):
    assert any((folder / "store").rglob("*"))


def test_a_batch_runs_in_one_process(folder):
    data, sample = simulated_example()
    shutil.copy(data, folder / "sheet.csv")
    plan = f'schema_version = 1\nsample = "{sample}"\nwork = "fit"\n\n[measurements]\nfiles = "sheet.csv"\n'
    (folder / "plan.toml").write_text(f'{plan}\n[fit]\naccuracy = 0.02\nprofile = "none"\n')
    done = run(folder, "batch", "plan.toml", "--out", "batch", "--workers", "0", "--quiet")
    assert done.returncode == 0, done.stderr
    assert (folder / "batch" / "summary.csv").is_file()
