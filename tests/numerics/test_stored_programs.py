import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.numerics.compiling import stored_jit


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("JAXINK_CACHE_DIR", str(tmp_path))
    return tmp_path


class Counted:
    """A function with linear algebra that counts how often it is traced."""

    def __init__(self):
        self.traces = 0

    def __call__(self, tree, shift):
        self.traces += 1
        values, vectors = jnp.linalg.eigh(tree["matrix"])
        return jnp.linalg.solve(tree["matrix"], tree["rhs"]) + shift, values, jnp.abs(vectors)


def arguments(n=4):
    matrix = jnp.eye(n) * 3 + jnp.ones((n, n)) / n
    return {"matrix": matrix, "rhs": jnp.arange(n, dtype=float)}, jnp.asarray(0.5)


def test_a_stored_program_is_not_traced_again_and_gives_the_same():
    first, second = Counted(), Counted()
    expected = first(*arguments())
    for function, traces in ((first, 2), (second, 0)):
        found = stored_jit(function, "key")(*arguments())
        assert function.traces == traces
        for a, b in zip(found, expected, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-14)


def test_other_keys_shapes_and_precisions_are_other_programs():
    counted = Counted()
    stored_jit(counted, "key")(*arguments())
    stored_jit(counted, "other")(*arguments())
    stored_jit(counted, "key")(*arguments(5))
    assert counted.traces == 3
    with jax.enable_x64(False):
        tree, shift = jax.tree.map(lambda x: x.astype("float32"), arguments())
        result = stored_jit(counted, "key")(tree, shift)
    assert counted.traces == 4
    assert result[0].dtype == "float32"


def test_two_threads_that_need_one_program_make_it_once():
    counted, both_here = Counted(), threading.Barrier(2)
    program = stored_jit(counted, "shared")

    def work(_):
        both_here.wait()
        return program(*arguments())

    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(work, range(2))
    assert counted.traces == 1
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_without_a_key_nothing_is_stored(folder):
    stored_jit(Counted(), None)(*arguments())
    assert not (folder / "traced").exists()


def test_a_single_array_stays_one():
    assert stored_jit(lambda x: x + 1, "key")(jnp.zeros(3)).shape == (3,)


@pytest.mark.parametrize("content", [b"", b"no program", None])
def test_a_foreign_file_is_thrown_away(folder, content):
    stored_jit(Counted(), "key")(*arguments())
    (file,) = (folder / "traced").iterdir()
    other = file.read_bytes()[:-10] if content is None else content
    file.write_bytes(other)
    counted = Counted()
    stored_jit(counted, "key")(*arguments())
    assert counted.traces == 1
    assert file.read_bytes() != other


def test_a_program_of_other_shapes_under_this_name_is_not_run(folder):
    stored_jit(Counted(), "key")(*arguments())
    (file,) = (folder / "traced").iterdir()
    stored_jit(Counted(), "key")(*arguments(5))
    (other,) = set((folder / "traced").iterdir()) - {file}
    file.write_bytes(other.read_bytes())
    counted = Counted()
    stored_jit(counted, "key")(*arguments())
    assert counted.traces == 1


def test_exchanged_programs_are_not_run(folder):
    functions = {"doubled": lambda x: 2 * x, "tripled": lambda x: 3 * x}
    for name, function in functions.items():
        stored_jit(function, name)(jnp.ones(3))
    one, two = (folder / "traced").iterdir()
    content = one.read_bytes()
    one.write_bytes(two.read_bytes())
    two.write_bytes(content)
    for name, factor in (("doubled", 2.0), ("tripled", 3.0)):
        np.testing.assert_array_equal(stored_jit(functions[name], name)(jnp.ones(3)), factor)


def test_under_a_transformation_nothing_is_stored(folder):
    found = jax.vmap(stored_jit(lambda x: 2 * x, "key"))(jnp.arange(3.0))
    np.testing.assert_array_equal(found, [0, 2, 4])
    assert not (folder / "traced").exists()


FRESH = """
import jax, jax.numpy as jnp
from jaxink.numerics.compiling import stored_jit

def function(matrix):
    print("traced")
    return jnp.linalg.eigvalsh(matrix), jnp.linalg.inv(matrix)

with jax.enable_x64(True):
    print(float(stored_jit(function, "key")(jnp.eye(3) * 2)[0].sum()))
"""


def test_a_fresh_process_runs_stored_linear_algebra(folder):
    """Without LAPACK prepared, the second process would end in a segmentation fault."""
    for expected in ("traced\n6.0\n", "6.0\n", "6.0\n"):
        done = subprocess.run(
            [sys.executable, "-c", FRESH],
            env=os.environ | {"JAXINK_CACHE_DIR": str(folder)},
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert (done.returncode, done.stdout) == (0, expected), done.stderr[-500:]
