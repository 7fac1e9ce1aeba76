"""Optimisation level of XLA: low for programs that run a few times, high for those that run often.

Compiled functions whose traced form is kept between processes.

Tracing and lowering a forward model take longer than running it a hundred times. Its StableHLO, once stored,
replaces both; JAX then finds the compiled program by it.

Programs in memory, of which those used least recently are dropped first.

A compiled program takes tens of megabytes, and hundreds of the memory mappings of which a Linux process may
have 65530. Each of JAX's own functions that is called outside of them, such as an addition, is a program of
over a megabyte, too, for every shape of its arguments; those are dropped from time to time.
"""

import ctypes
import os
import sys
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import suppress
from functools import cache
from typing import Any, Protocol, runtime_checkable

import jax
import jaxlib
from jax import export

from jaxink.numerics.fingerprint import fingerprint, source_fingerprint
from jaxink.numerics.program_store import bound_store, read_program, store_folder, write_program

# Levels of optimisation on a CPU. Compared with full optimisation, level 1 halves the compile time and
# lengthens the run time by up to a half; level 0 takes a fifth and three times.
NONE, LITTLE = 0, 1
# A diagnosis loads about sixteen.
_MOST = 24
# As many programs are dropped before JAX's own functions are, about once in a diagnosis.
_DROPS = 12


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


def jit_unoptimised(
    function: Callable, level: int = NONE, key: str | None = None, calls: tuple[Callable, ...] = ()
) -> Callable:
    """`jax.jit` with a low level of optimisation, for a function that runs a few times.

    The result is not for use within other compiled functions. With a key, its traced form is stored; `key`
    and `calls` are as in `stored_jit`.
    """
    return stored_jit(function, key, _options(level), calls)


class Tiered:
    """A function compiled quickly at first, and with full optimisation once it has run often.

    Parameters
    ----------
    function
        Not for use within other compiled functions.
    runs
        Number of runs after which full optimisation pays off.
    key, calls
        See `stored_jit`: with a key, the traced form of the function is stored.
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
        self._tiers = jit_unoptimised(function, level, key, calls), stored_jit(function, key, calls=calls)
        self._left = runs

    def now(self, runs: int = 0) -> Callable:
        """The function as currently compiled; ``runs`` is the number of runs since the last call."""
        self._left -= runs
        return self._tiers[self._left <= 0]


def stored_jit(
    function: Callable,
    key: str | None,
    options: dict[str, Any] | None = None,
    calls: tuple[Callable, ...] = (),
) -> Callable:
    """`jax.jit` of a function of arrays, with its traced form stored; not within other compiled functions.

    Under a transformation, such as `jax.vmap`, it is a plain `jax.jit`.

    Parameters
    ----------
    function
        Takes trees of arrays, and returns an array or a tuple of arrays.
    key
        Fingerprint of everything but the arrays that the function depends on; None for a plain `jax.jit`.
    options
        Compiler options.
    calls
        Functions made by `jax.jit` that it calls; what JAX remembers of their tracing is forgotten with it.
    """
    if key is None:
        return jax.jit(function, compiler_options=options)
    return _Kept(function, key, options, calls)


class _Kept:
    def __init__(
        self, function: Callable, key: str, options: dict[str, Any] | None, calls: tuple[Callable, ...]
    ):
        self._function, self._key, self._options, self._calls = function, key, options, calls
        self._compiled: dict[tuple, Callable] = {}
        self._making = threading.RLock()
        self._plain = jax.jit(function, compiler_options=options)

    def __call__(self, *args):
        leaves, tree = jax.tree.flatten(args)
        if any(isinstance(leaf, jax.core.Tracer) for leaf in leaves):
            return self._plain(*args)
        shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
        program = self._compiled.get(shapes)
        if program is None:
            # Another thread may be making it just now.
            with self._making:
                program = self._compiled.get(shapes)
                if program is None:
                    program = self._compiled[shapes] = self._load(leaves) or self._trace(leaves, tree)
        LOADED.use(self, shapes)
        found = program(*leaves)
        return found[0] if len(found) == 1 else tuple(found)

    def drop(self, shapes: tuple) -> None:
        """Forget a program, which is loaded again when it is called, and JAX's memory of tracing it."""
        self._compiled.pop(shapes, None)
        jitted: tuple[Any, ...] = (self._plain, *self._calls)
        for function in jitted:
            function.clear_cache()

    def _name(self, leaves) -> str:
        about = [(leaf.shape, leaf.dtype.str, getattr(leaf, "weak_type", False)) for leaf in leaves]
        return str(fingerprint(self._key, about, *_surroundings()))

    def _load(self, leaves) -> Callable | None:
        """The program from the store, if it is there and fits."""
        data = read_program(self._name(leaves))
        if data is None:
            return None
        _prepare_linear_algebra()
        try:
            exported = export.deserialize(bytearray(data))
            expected = [(leaf.shape, leaf.dtype) for leaf in leaves]
            if [(aval.shape, aval.dtype) for aval in exported.in_avals] != expected:
                return None
            return self._program(exported.call, leaves)
        except Exception:  # noqa: BLE001 - whatever a file from elsewhere causes, tracing anew is right
            return None

    def _trace(self, leaves, tree) -> Callable:
        """The program, traced and stored."""

        def flat(*leaves):
            return jax.tree.leaves(self._function(*jax.tree.unflatten(tree, leaves)))

        if store_folder() is None:
            return self._program(flat, leaves)
        try:
            exported = export.export(jax.jit(flat))(*leaves)
            data = bytes(exported.serialize())
        except (NotImplementedError, ValueError):
            # It calls something that has no lasting form.
            return self._program(flat, leaves)
        _bound_once()
        write_program(self._name(leaves), data)
        # The program that the next process will load, so that it finds it compiled. JAX remembers what it
        # has exported together with all that was traced for it, but not what it has read.
        return self._program(export.deserialize(bytearray(data)).call, leaves)

    def _program(self, function: Callable, leaves) -> Callable:
        """A function compiled ahead of time: neither its trace nor its lowered form is kept."""
        return jax.jit(function, compiler_options=self._options).lower(*leaves).compile()


@cache
def _versions() -> tuple[str, ...]:
    return jax.__version__, jaxlib.__version__, source_fingerprint()


def _surroundings() -> tuple:
    """What a traced program depends on besides its key and its arguments."""
    config: Any = jax.config
    return (
        *_versions(),
        jax.default_backend(),
        config.jax_enable_x64,
        str(config.jax_default_matmul_precision),
        str(config.jax_numpy_dtype_promotion),
    )


@cache
def _bound_once() -> None:
    bound_store()


@cache
def _prepare_linear_algebra() -> None:
    """Lower a call of LAPACK: a process that runs a stored program with one before would crash."""
    with jax.enable_x64(True):
        matrix = jax.ShapeDtypeStruct((1, 1), "float64")
        jax.jit(jax.lax.linalg.cholesky).lower(matrix)


@runtime_checkable
class Owner(Protocol):
    """What holds programs."""

    def drop(self, name: Hashable) -> None:
        """Forget a program; it is loaded again when it is needed."""


class LoadedPrograms:
    """Programs in the order of their last use.

    Parameters
    ----------
    most
        Number beyond which those used least recently are dropped.
    drops
        Number of programs dropped after which JAX's own functions are dropped as well.
    """

    def __init__(self, most: int = _MOST, drops: int = _DROPS):
        self._most, self._drops, self._dropped = most, drops, 0
        self._used: OrderedDict[tuple, weakref.ref[Owner]] = OrderedDict()
        self._lock = threading.Lock()

    def use(self, owner: Owner, name: Hashable) -> None:
        """Take note of the use of a program that an object owns."""
        with self._lock:
            self._used[id(owner), name] = weakref.ref(owner)
            self._used.move_to_end((id(owner), name))
            is_full = len(self._used) > self._most
        if is_full and self.drop_oldest():
            self._dropped += 1
            if self._dropped % self._drops == 0:
                _drop_small_programs()
            _return_freed_memory()

    def drop_oldest(self) -> bool:
        """Drop the program used least recently; return whether there was one."""
        with self._lock:
            if not self._used:
                return False
            (_, name), reference = self._used.popitem(last=False)
        owner = reference()
        if owner is not None:
            owner.drop(name)
        return True


LOADED = LoadedPrograms()


def _drop_small_programs() -> None:
    """Drop the programs of JAX's own functions, for all shapes; a user's compiled functions keep theirs.

    JAX compiles them again, or loads them from the store, which takes milliseconds each. They are sought
    where JAX has them. A list of all objects (`gc.get_objects`) would hold tuples that other threads are
    making, which is a SystemError there.
    """
    with suppress(ImportError, AttributeError):
        # One function for each primitive that is called outside any program.
        from jax._src.dispatch import xla_primitive_callable

        xla_primitive_callable.cache_clear()
    jitted: Any = type(jax.jit(abs))
    for name, module in list(sys.modules.items()):
        if name.split(".")[0] == "jax":
            for thing in list(getattr(module, "__dict__", {}).values()):
                for function in (thing, *_parts(thing)):
                    if type(function) is jitted:
                        function.clear_cache()


def _parts(thing: Any) -> Iterator[Any]:
    """What a ufunc of JAX is made of: functions in a dictionary in its own."""
    for part in list(getattr(thing, "__dict__", {}).values()):
        if type(part) is dict:
            yield from list(part.values())


def _return_freed_memory() -> None:
    """Return to the system what the C library keeps of freed memory, if it is the one that can."""
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
