"""Compiled functions whose traced form is kept between processes.

Tracing and lowering a forward model take longer than running it a hundred times. Its StableHLO, once stored,
replaces both; JAX then finds the compiled program by it.
"""

import threading
from collections.abc import Callable
from functools import cache
from typing import Any

import jax
import jaxlib
from jax import export

from jaxink.numerics.fingerprint import fingerprint, source_fingerprint
from jaxink.numerics.loaded_programs import LOADED
from jaxink.numerics.program_store import bound_store, read_program, store_folder, write_program


def keeping(
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
