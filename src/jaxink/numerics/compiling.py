"""How much work XLA puts into a program: little where it runs a few times, much where it runs often."""

import os
from collections.abc import Callable
from functools import cache
from typing import Any

import jax

# Levels of optimisation on a CPU. Against the thorough one, 1 takes half of the time to compile and up to
# half as much again to run, 0 a fifth and three times.
_NONE, _LITTLE = 0, 1


@cache
def _options(level: int) -> dict[str, Any] | None:
    # A level that the user asks for stands.
    if jax.default_backend() != "cpu" or "optimization_level" in os.environ.get("XLA_FLAGS", ""):
        return None
    options = {"xla_backend_optimization_level": level, "xla_cpu_use_fusion_emitters": False}
    try:
        jax.jit(lambda x: x, compiler_options=options).lower(0.0).compile()
    except jax.errors.JaxRuntimeError:
        # Another XLA, which does not know them.
        return None
    return options


def hastily(function: Callable, level: int = _NONE) -> Callable:
    """`jax.jit` of a function for a few runs: compiled fast, run slowly.

    Parameters
    ----------
    function
        Not for use within other compiled functions.
    level
        Of optimisation.
    """
    return jax.jit(function, compiler_options=_options(level))


class Tiered:
    """A function compiled hastily at first, and thoroughly once it runs often.

    Parameters
    ----------
    function
        Not for use within other compiled functions.
    runs
        After how many the thorough compilation pays.
    """

    def __init__(self, function: Callable, runs: int):
        self._tiers = hastily(function, _LITTLE), jax.jit(function)
        self._left = runs

    def now(self, runs: int = 0) -> Callable:
        """The function as compiled now.

        Parameters
        ----------
        runs
            So many that were made since this was last asked.
        """
        self._left -= runs
        return self._tiers[self._left <= 0]
