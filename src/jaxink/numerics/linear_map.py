"""A linear map that is computed in one way and differentiated in another.

The fastest way to a derivative may itself have none: where eigenvalues meet, the eigenvectors that it uses
are not differentiable, though what it computes is. JAX would differentiate it all the same when derivatives
are nested. As a primitive of its own, the map keeps its fast form until a derivative by the point is asked
for, which is taken of a smooth form. That holds for forward and reverse mode, batches and any order.
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array


def linear_map(
    fast: Callable, smooth: Callable, point: tuple[Array, ...], change: tuple[Array, ...]
) -> tuple[Array, ...]:
    """Apply a linear map that depends on a point.

    Parameters
    ----------
    fast, smooth
        Functions of ``*point, *change`` to a tuple of arrays, equal in value and linear in the change. They
        have no closure. ``smooth`` can be differentiated by the point, any number of times.
    point
        What the map depends on.
    change
        What it is applied to.
    """
    return tuple(_map.bind(*point, *change, fast=fast, smooth=smooth, n_point=len(point)))


@dataclasses.dataclass(frozen=True)
class _Batched:
    """A map over batches."""

    of: Callable
    axes: tuple[int | None, ...]

    def __call__(self, *arguments):
        return jax.vmap(self.of, self.axes)(*arguments)


@dataclasses.dataclass(frozen=True)
class _Transposed:
    """A transposed map, from changes of the results to those of the arguments at some positions."""

    of: Callable
    n_point: int
    positions: tuple[int, ...]
    shapes: tuple[jax.ShapeDtypeStruct, ...]

    def __call__(self, *arguments):
        point, results = arguments[: self.n_point], arguments[self.n_point :]

        def along(*moving):
            change = [jax.numpy.zeros(shape.shape, shape.dtype) for shape in self.shapes]
            for position, value in zip(self.positions, moving, strict=True):
                change[position] = value
            return tuple(self.of(*point, *change))

        return jax.linear_transpose(along, *(self.shapes[i] for i in self.positions))(results)


_map = Primitive("jaxink_linear_map")
_map.multiple_results = True


def _apply(*arguments, fast, **_):
    return fast(*arguments)


@_map.def_impl
def _apply_at_once(*arguments, fast, **_):
    return jax.jit(fast)(*arguments)


@_map.def_abstract_eval
def _shapes(*avals, fast, **_):
    arguments = (jax.ShapeDtypeStruct(aval.shape, aval.dtype) for aval in avals)
    return [jax.core.ShapedArray(found.shape, found.dtype) for found in jax.eval_shape(fast, *arguments)]


def _differentiate(primals, tangents, *, fast, smooth, n_point):
    parameters: dict[str, Any] = {"fast": fast, "smooth": smooth, "n_point": n_point}
    point, change = primals[:n_point], primals[n_point:]
    parts = []
    if any(type(tangent) is not ad.Zero for tangent in tangents[n_point:]):
        moved = (ad.instantiate_zeros(tangent) for tangent in tangents[n_point:])
        parts.append(_map.bind(*point, *moved, **parameters))
    positions = [i for i in range(n_point) if type(tangents[i]) is not ad.Zero]
    if positions:

        def at(*moved):
            there = list(point)
            for i, value in zip(positions, moved, strict=True):
                there[i] = value
            return list(smooth(*there, *change))

        parts.append(jax.jvp(at, [point[i] for i in positions], [tangents[i] for i in positions])[1])
    return _map.bind(*primals, **parameters), [
        sum(terms[1:], start=terms[0]) for terms in zip(*parts, strict=True)
    ]


def _transpose(cotangents, *arguments, fast, smooth, n_point):
    point, change = arguments[:n_point], arguments[n_point:]
    positions = tuple(i for i, value in enumerate(change) if ad.is_undefined_primal(value))
    avals = [value.aval if ad.is_undefined_primal(value) else jax.typeof(value) for value in change]
    about = n_point, positions, tuple(jax.ShapeDtypeStruct(aval.shape, aval.dtype) for aval in avals)
    found = _map.bind(
        *point,
        *map(ad.instantiate_zeros, cotangents),
        fast=_Transposed(fast, *about),
        smooth=_Transposed(smooth, *about),
        n_point=n_point,
    )
    results: list[Any] = [None] * len(arguments)
    for position, value in zip(positions, found, strict=True):
        results[n_point + position] = value
    return results


def _batch(arguments, axes, *, fast, smooth, n_point):
    fast, smooth = (_Batched(function, tuple(axes)) for function in (fast, smooth))
    found = _map.bind(*arguments, fast=fast, smooth=smooth, n_point=n_point)
    return found, [0] * len(found)


ad.primitive_jvps[_map] = _differentiate
ad.primitive_transposes[_map] = _transpose
batching.primitive_batchers[_map] = _batch
mlir.register_lowering(_map, mlir.lower_fun(_apply, multiple_results=True))
