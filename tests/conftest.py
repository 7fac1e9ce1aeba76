import os
from importlib.metadata import version

# What users call enters 64 bits by itself: the tests and the processes that they start show that it does.
os.environ.pop("JAX_ENABLE_X64", None)
# Not "raise": columns meet rows, and matrices azimuthal orders, by NumPy's rule and on purpose, in at least
# 33 places of 15 modules. The annotations, all of which are checked here, refuse shapes that are not meant.
os.environ.setdefault("JAX_NUMPY_RANK_PROMOTION", "allow")
# Most of the time goes into compiling programs that run once: most of that goes into making them fast.
FLAGS = ["--xla_backend_optimization_level=0"]
# Another XLA may not know it, and ends the process.
if version("jaxlib").startswith("0.9."):
    FLAGS.append("--xla_cpu_use_fusion_emitters=false")
    # A program in parts is compiled by several cores at once, at a fifth more processor time in all.
    FLAGS.append("--xla_cpu_parallel_codegen_split_count=1")
os.environ.setdefault("XLA_FLAGS", " ".join(FLAGS))
# The solver's matrices are small: on a busy machine OpenBLAS's threads wait for each other, up to twenty
# times as long as the solve takes. Fits and predictions limit them; here tests call the solver themselves.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import shutil  # noqa: E402
import tempfile  # noqa: E402
from contextlib import nullcontext  # noqa: E402
from pathlib import Path  # noqa: E402

import pytest  # noqa: E402

pytest_plugins = ["tests.sentences"]

# All processes of a run share what they compile, and nothing from before it.
_OWN_STORE = None
if "PYTEST_XDIST_WORKER" not in os.environ:
    os.environ["JAXINK_CACHE_DIR"] = _OWN_STORE = tempfile.mkdtemp(prefix="jaxink-tests-")

TESTS = Path(__file__).resolve().parent
# Where tests call the solver's differentiable functions themselves, as a program does that has switched 64
# bits on. All other tests run in JAX's own 32 bits, as a user's program does.
IN_64_BITS = (
    *("model", "numerics", "optics", "particles", "physics", "reference", "solver", "surfaces"),
    *(
        f"fitting/test_{name}.py"
        for name in (
            "bounded",
            "levenberg_marquardt",
            "log_density",
            "objective",
            "readings_objective",
            "scaling",
        )
    ),
)

# Of 65,530 that Linux allows a process; twice as many take over 3 GiB in each process.
MOST_MAPPINGS = 8_000

SHARED = Path(os.environ.get("JAXINK_DATA") or TESTS.parents[1] / "shared" / "data")


def pytest_unconfigure():
    if _OWN_STORE is not None:
        shutil.rmtree(_OWN_STORE, ignore_errors=True)


def _precision_of(path):
    if not any(path.is_relative_to(TESTS / place) for place in IN_64_BITS):
        return nullcontext()
    import jax

    return jax.enable_x64(True)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Constants of a test file are made in the precision of its tests."""
    with _precision_of(collector.path) if isinstance(collector, pytest.Module) else nullcontext():
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """A test and its fixtures, of whatever scope, run in the precision of their room."""
    with _precision_of(item.path):
        return (yield)


@pytest.fixture(scope="session")
def shared_data():
    """Folder of the measured and reference data, which is not part of the repository."""
    if not SHARED.is_dir():
        pytest.skip(f"the folder of measured and reference data is absent: {SHARED}; set JAXINK_DATA")
    return SHARED


@pytest.fixture(scope="module", autouse=True)
def memory_for_programs():
    """Each program that tests compile themselves is kept by JAX, and a process may not have too many."""
    yield
    from jaxink.numerics.precision import release_programs

    release_programs(most_mappings=MOST_MAPPINGS)


@pytest.fixture(scope="session")
def coarse():
    """A coarse discretisation, for tests that need a fit but not its accuracy."""
    from jaxink import SolverConfig

    return SolverConfig(nodes_escaping=6, nodes_trapped=4, n_moments=12, n_orders=3)


@pytest.fixture(scope="session")
def example_result(coarse):
    """Fit of the embedded simulated measurement."""
    import jaxink
    from jaxink.data import simulated_example

    return jaxink.fit(*simulated_example(), jaxink.FitOptions(config=coarse))
