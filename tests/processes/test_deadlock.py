"""No computation hangs, in fresh processes, on one core and on two.

The deadlock of jaxlib 0.10.0 ... 0.11.0 is a race: one green run proves little, hence the repeats. With
jaxlib 0.10.2 and JAXINK_TEST_ANY_JAXLIB=1, on 2 cores, `programs.py threads` hung 4 times of 4, `devices` 3
times of 4. A plain Jacobian, whose derivatives are products without LAPACK, hung 0 times of 4.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from jaxink.errors import UnsafeVersionError
from jaxink.numerics import precision

PROGRAMS = Path(__file__).with_name("programs.py")
PROCESSES = 2
# A process that does not hang needs a few seconds, the first of its kind half a minute to compile.
TIMEOUT_S = 150


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """The processes share compiled programs, so that only the first of each kind compiles."""
    cache = str(tmp_path_factory.mktemp("compiled"))
    return {
        # As users run it, not with the settings of the tests for the compiler and for LAPACK.
        **{k: v for k, v in os.environ.items() if k not in ("XLA_FLAGS", "OPENBLAS_NUM_THREADS")},
        "JAX_COMPILATION_CACHE_DIR": cache,
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0.2",
        "TF_CPP_MIN_LOG_LEVEL": "3",
    }


def start(program: str, cores: set[int], environment: dict[str, str]) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, str(PROGRAMS), program, ",".join(map(str, sorted(cores)))],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system cannot pin a process to a core")
@pytest.mark.parametrize("n_cores", [1, 2])
@pytest.mark.parametrize("program", ["fit", "threads", "devices"])
@pytest.mark.slow
def test_fresh_processes_end(program, n_cores, environment):
    available = sorted(os.sched_getaffinity(0))
    if len(available) < n_cores:
        pytest.skip(f"only {len(available)} core is available")
    # As many at once as there are groups of cores, the first alone so that it fills the cache.
    groups = [set(available[i : i + n_cores]) for i in range(0, len(available) - n_cores + 1, n_cores)]
    waiting, hung = list(range(PROCESSES)), 0
    first = True
    while waiting:
        batch = groups[:1] if first else groups[: len(waiting)]
        first, waiting = False, waiting[len(batch) :]
        for process in [start(program, cores, environment) for cores in batch]:
            try:
                output, problem = process.communicate(timeout=TIMEOUT_S)
                assert process.returncode == 0, problem[-2000:]
                assert output == "done\n"
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                hung += 1
    assert hung == 0, f"{hung} of {PROCESSES} processes hung"


@pytest.mark.parametrize(
    ("version", "is_prone"),
    [
        ("0.8.3", False),
        ("0.9.2", False),
        ("0.10.0", True),
        ("0.10.2", True),
        ("0.11.0", True),
        ("0.11.1", False),
        ("0.12.0.1", False),
    ],
)
def test_unsafe_versions_are_known(version, is_prone):
    assert precision.is_deadlock_prone(version) is is_prone


def test_unsafe_version_is_refused_with_the_command_that_helps(monkeypatch, refused):
    monkeypatch.setattr(precision.jaxlib, "__version__", "0.10.2")
    with refused("jax>=0.9.2,!=0.10.*,!=0.11.0", kind=UnsafeVersionError):
        precision.require_safe_jaxlib()
