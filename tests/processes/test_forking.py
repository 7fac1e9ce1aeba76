"""What computes in a process that was forked off: refused where it would hang, and fine where it does not."""

import multiprocessing
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork"
)

PROGRAM = """
import concurrent.futures, multiprocessing, os, sys
import numpy as np
import jaxink
from jaxink.data import simulated_example

def predicted():
    data, sample = simulated_example()
    data = jaxink.read(data).select(theta_i_deg=15.0, side="T")
    return jaxink.predict(sample, data, jaxink.SolverConfig(6, 4, 4, 1)).sum()

def fitted():
    return jaxink.fit(*simulated_example())

def told(work):
    try:
        return str(work())
    except jaxink.JaxinkError as problem:
        return f"{type(problem).__name__}: {problem}"

def in_child(work, method="fork"):
    context = multiprocessing.get_context(method)
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        return pool.submit(told, work).result()

if __name__ == "__main__":
    # What is refused computes nothing.
    told(lambda: jaxink.predict("none.toml", "none.csv"))
    before, own = in_child(predicted), told(predicted)
    print(before == own)
    print(in_child(predicted))
    print(in_child(fitted))
    print(in_child(predicted, "spawn") == own)
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        print(told(predicted), flush=True)
        os._exit(0)
    os.waitpid(child, 0)
    print(told(predicted) == own)
    print(os.getpid())
"""


def test_a_fork_of_a_process_that_computed_is_refused(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "program.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    *lines, home = done.stdout.splitlines()

    def is_refused(line):
        return line.startswith("ForkedProcessError: ") and f" process {home}," in line

    assert [is_refused(line) or line for line in lines] == [
        *("True", True, True, "True"),
        *(True, "True"),
    ]
    assert all(method in lines[1] for method in ('"spawn"', '"forkserver"'))
