"""A program gives the same numbers however much work went into compiling it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.numerics.compiling import Tiered, _options, jit_unoptimised


def decay(a, x):
    return jnp.linalg.solve(a + jnp.diag(jnp.exp(-x)), jnp.sin(x)) ** 2


@pytest.fixture
def problem(monkeypatch):
    # The tests' own setting would stand.
    monkeypatch.delenv("XLA_FLAGS")
    _options.cache_clear()
    rng = np.random.default_rng(5)
    with jax.enable_x64(True):
        yield jnp.asarray(rng.random((12, 12))), jnp.asarray(rng.random(12))
    _options.cache_clear()


@pytest.mark.parametrize("level", [0, 1])
def test_a_hasty_program_computes_the_same(problem, level):
    hasty = jit_unoptimised(decay, level)(*problem)
    np.testing.assert_allclose(hasty, jax.jit(decay)(*problem), rtol=1e-12)


@pytest.mark.parametrize("level", [0, 1])
def test_the_level_is_known_to_every_xla(problem, level):
    assert _options(level)["xla_backend_optimization_level"] == level


def test_a_level_that_the_user_asks_for_stands(problem, monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_backend_optimization_level=2")
    assert _options(0) is None


def test_a_function_is_compiled_thoroughly_once_it_has_run_often(problem):
    tiered = Tiered(decay, 3)
    first = tiered.now()
    assert tiered.now(2) is first
    later = tiered.now(1)
    assert later is not first
    assert tiered.now(100) is later
    np.testing.assert_allclose(first(*problem), later(*problem), rtol=1e-12)
