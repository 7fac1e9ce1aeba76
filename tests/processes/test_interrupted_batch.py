"""Ctrl-C while several workers are at it: their processes end, what is done stays, and the batch goes on."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import jaxink
from tests.samples import GOOD_SAMPLE

PLAN = 'schema_version = 1\nsample = "sample.toml"\n[measurements]\nfiles = "*.csv"\n'
SLOWLY, AT_ONCE = "tests.batches.functions:slowly", "tests.batches.functions:answered"
# Processes that a shell starts in the background ignore Ctrl-C, and so do their children.
HEEDED = "signal.signal(signal.SIGINT, signal.default_int_handler)"
RUN = f"import signal, sys, jaxink; {HEEDED}; jaxink.batch(*sys.argv[1:], workers=2, function={SLOWLY!r})"
N_SHEETS, WAIT_S = 12, 60.0


def processes_that_measure() -> list[str]:
    """Processes of workers whose function is the slow one."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = entry.read_bytes().split(b"\0")
        except OSError:
            # It has ended meanwhile.
            continue
        if SLOWLY.encode() in words:
            found.append(entry.parent.name)
    return found


def until(is_so) -> None:
    end = time.monotonic() + WAIT_S
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="processes are listed in /proc only")
def test_ctrl_c_ends_the_workers_and_loses_nothing(tmp_path):
    (tmp_path / "plan.toml").write_text(PLAN)
    (tmp_path / "sample.toml").write_text(GOOD_SAMPLE)
    for number in range(N_SHEETS):
        (tmp_path / f"sheet_{number}.csv").write_text(str(number))
    plan, out = tmp_path / "plan.toml", tmp_path / "out"
    rows = out / "rows"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    with subprocess.Popen(
        [sys.executable, "-c", RUN, plan, out], env=environment, stderr=subprocess.PIPE, text=True
    ) as process:
        until(lambda: rows.exists() and len(list(rows.glob("*.json"))) >= 2)
        assert len(processes_that_measure()) == 2
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=WAIT_S)
    assert process.returncode != 0
    assert "KeyboardInterrupt" in errors
    until(lambda: not processes_that_measure())
    n_done = len(list(rows.glob("*.json")))
    assert 2 <= n_done < N_SHEETS
    found = jaxink.batch(plan, out, workers=0, function=AT_ONCE)
    assert found.kept == n_done
    assert {row.name: row.parameters[0].value for row in found} == {
        f"sheet_{number}": float(number) for number in range(N_SHEETS)
    }
