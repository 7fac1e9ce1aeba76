"""Programs in memory are dropped by age, and come back when they are called."""

import gc
import threading
import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.numerics import compiling
from jaxink.numerics.compiling import LoadedPrograms, stored_jit
from jaxink.numerics.precision import release_programs


class Shelf:
    def __init__(self):
        self.dropped = []

    def drop(self, name):
        self.dropped.append(name)


def test_the_program_used_least_recently_is_dropped_first():
    loaded, shelf = LoadedPrograms(most=3), Shelf()
    for name in ("a", "b", "c", "a", "d", "e"):
        loaded.use(shelf, name)
    assert shelf.dropped == ["b", "c"]
    while loaded.drop_oldest():
        pass
    assert shelf.dropped == ["b", "c", "a", "d", "e"]


def test_nothing_is_kept_alive_by_the_order():
    loaded = LoadedPrograms(most=3)
    loaded.use(Shelf(), "a")
    gc.collect()
    assert not [thing for thing in gc.get_objects() if isinstance(thing, Shelf)]
    assert loaded.drop_oldest()
    assert not loaded.drop_oldest()


@pytest.fixture
def counted(tmp_path, monkeypatch):
    monkeypatch.setenv("JAXINK_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiling, "LOADED", LoadedPrograms(most=2))
    traces = []

    def doubled(x):
        traces.append(x.shape)
        return 2 * x

    return stored_jit(doubled, "doubled"), traces


def test_a_dropped_program_is_loaded_again_without_being_traced(counted):
    doubled, traces = counted
    for size in (1, 2, 3, 1, 3):
        np.testing.assert_array_equal(doubled(jnp.arange(float(size))), 2.0 * np.arange(size))
        assert len(doubled._compiled) <= 2
    assert traces == [(1,), (2,), (3,)]


def test_small_programs_of_unlike_work_do_not_pile_up(tmp_path, monkeypatch):
    """Each shape makes a program of every one of JAX's functions that is called outside compiled ones."""
    monkeypatch.setenv("JAXINK_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiling, "LOADED", LoadedPrograms(most=2, drops=3))
    program, traces = stored_jit(lambda x: 2 * x, "doubled"), []

    def of_the_user(x):
        traces.append(x)
        return x + 1

    own = jax.jit(of_the_user)
    jax.clear_caches()
    own(1.0)
    alive = []
    for size in range(1, 31):
        x = jnp.arange(float(size))
        np.testing.assert_array_equal(program(x), 2.0 * np.arange(size))
        np.testing.assert_array_equal(jnp.cumsum(x * x - jnp.sin(x) > 0)[-1:], [size - 1])
        alive.append(len(jax.devices()[0].client.live_executables()))
    assert max(alive[15:]) <= max(alive[:15])
    # A user's function is not compiled again.
    own(2.0)
    assert len(traces) == 1


def test_dropping_small_programs_disturbs_no_other_thread():
    """A tuple that grows while something else holds it, such as a list of all objects, is a SystemError."""
    stop, failed = threading.Event(), []

    def grow():
        try:
            while not stop.is_set():
                tuple(time.sleep(0) or i for i in range(50))
        except SystemError as problem:
            failed.append(problem)

    thread = threading.Thread(target=grow)
    thread.start()
    for _ in range(20):
        compiling._drop_small_programs()
    stop.set()
    thread.join()
    assert not failed


def test_too_many_mappings_drop_programs_by_age(counted, monkeypatch):
    doubled, _ = counted
    for size in (1, 2):
        doubled(jnp.ones(size))
    numbers = iter([100, 40])
    monkeypatch.setattr("jaxink.numerics.precision.LOADED", compiling.LOADED)
    monkeypatch.setattr("jaxink.numerics.precision._mappings", lambda: next(numbers))
    assert not release_programs(most_mappings=50)
    assert [shapes[0][0] for shapes in doubled._compiled] == [(2,)]
