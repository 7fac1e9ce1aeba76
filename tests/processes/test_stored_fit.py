"""A fit with stored programs, in fresh processes: never another number, whatever happens to the store."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

FIT = """
import jaxink
from jaxink.data import simulated_example

options = jaxink.FitOptions(config=jaxink.SolverConfig(4, 3, 8, 2), profile="none")
result = jaxink.fit(*simulated_example(), options)
print(repr([float(p.value) for p in result.parameters.free]), result.merit.chi_square)
"""


def started(store: Path) -> subprocess.Popen:
    left_out = ("JAX_COMPILATION_CACHE_DIR", "TF_CPP_MIN_LOG_LEVEL")
    chosen = {k: v for k, v in os.environ.items() if k not in left_out}
    return subprocess.Popen(
        [sys.executable, "-c", FIT],
        env=chosen | {"JAXINK_CACHE_DIR": str(store)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def said(process: subprocess.Popen) -> str:
    out, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors[-500:]
    # XLA would tell at length of every program that it loads.
    assert "cpu_aot_loader" not in errors
    return out


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("store")


@pytest.fixture(scope="module")
def expected(store):
    # Two processes that write the same programs at the same time.
    first, second = (said(process) for process in [started(store), started(store)])
    assert first == second
    return first


def files(store, part):
    found = [path for path in (store / part).iterdir() if path.is_file()]
    assert found
    return found


@pytest.mark.parametrize("damage", ["none", "killed", "truncated", "emptied", "foreign"])
def test_the_store_never_changes_a_number(damage, store, expected):
    if damage == "killed":
        lost = files(store, "compiled")
        for path in lost:
            path.unlink()
        process = started(store)
        # Killed as soon as it has begun to write, and before it has written everything.
        while not any((store / "compiled").iterdir()) and process.poll() is None:
            time.sleep(0.002)
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        assert sum(path.is_file() for path in (store / "compiled").iterdir()) < len(lost)
    for part in ("traced", "compiled") if damage not in ("none", "killed") else ():
        for path in files(store, part):
            content = path.read_bytes()
            new = {"truncated": content[: len(content) // 2], "emptied": b"", "foreign": b"not a program"}
            path.write_bytes(new[damage])
    assert said(started(store)) == expected
