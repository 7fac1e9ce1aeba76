"""Optimisation level of XLA: low for programs that run a few times, high for those that run often."""

import os
from collections.abc import Callable
from functools import cache
from typing import Any

import jax

from jaxink.numerics.stored_programs import keeping

# Levels of optimisation on a CPU. Compared with full optimisation, level 1 halves the compile time and
# lengthens the run time by up to a half; level 0 takes a fifth and three times.
NONE, LITTLE = 0, 1


@cache
def _options(level: int) -> dict[str, Any] | None:
    # A level set by the user takes precedence.
    if jax.default_backend() != "cpu" or "optimization_level" in os.environ.get("XLA_FLAGS", ""):
        return None
    options = {"xla_backend_optimization_level": level}
    # An XLA that knows the second option compiles faster with it; a later one does not have it any more.
    for known in options | {"xla_cpu_use_fusion_emitters": False}, options:
        try:
            jax.jit(lambda x: x, compiler_options=known).lower(0.0).compile()
        except jax.errors.JaxRuntimeError:
            continue
        return known
    return None


def hastily(
    function: Callable, level: int = NONE, key: str | None = None, calls: tuple[Callable, ...] = ()
) -> Callable:
    """`jax.jit` with a low level of optimisation, for a function that runs a few times.

    The result is not for use within other compiled functions. With a key, its traced form is stored; `key`
    and `calls` are as of `keeping`.
    """
    return keeping(function, key, _options(level), calls)


class Tiered:
    """A function compiled quickly at first, and with full optimisation once it has run often.

    Parameters
    ----------
    function
        Not for use within other compiled functions.
    runs
        Number of runs after which full optimisation pays off.
    key, calls
        As of `keeping`: with a key, the traced form of the function is stored.
    level
        Level of optimisation at first.
    """

    def __init__(
        self,
        function: Callable,
        runs: int,
        key: str | None = None,
        calls: tuple[Callable, ...] = (),
        level: int = LITTLE,
    ):
        self._tiers = hastily(function, level, key, calls), keeping(function, key, calls=calls)
        self._left = runs

    def now(self, runs: int = 0) -> Callable:
        """The function as currently compiled; ``runs`` is the number of runs since the last call."""
        self._left -= runs
        return self._tiers[self._left <= 0]
