"""Rough interfaces of a sample, tabulated beforehand."""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from jaxink.model.build import StackBuilder, index_names
from jaxink.numerics.batches import at_each
from jaxink.numerics.own_derivatives import by_own_inputs
from jaxink.numerics.precision import computing
from jaxink.sample import Parameter, Roughness
from jaxink.solver import ChannelPlan, SolverConfig
from jaxink.surfaces import (
    FINE,
    QUICK,
    AngleTable,
    Density,
    IndexTable,
    MixtureTable,
    Piece,
    RoughInterface,
    RoughSizes,
    mixture_table,
    pieces_of,
    rough_table,
)

Table = AngleTable | IndexTable

# Tables over an index are not made if they would be larger than this.
_LARGEST_MB = 256


def rough_tables(builder: StackBuilder, plan: ChannelPlan, config: SolverConfig) -> tuple[Table | None, ...]:
    """Table of each interface at every wavelength; None if it is smooth, or a refractive index is free."""
    if not all(_is_fixed(builder, name) for name in index_names(builder.sample)):
        return (None,) * len(builder.faces)

    def table(interface):
        densities = _densities(builder, interface)
        if densities is None:
            return None
        face = _Face(builder, plan, config, interface, densities, FINE)
        # Evaluated to numbers even if the model is made inside a function that is being compiled.
        with computing(), jax.ensure_compile_time_eval():
            every = jnp.asarray(builder.wavelengths_nm), builder.values({})
            first, same = _distinct(builder, every[1])
            tables = at_each(face.table, *jax.tree.map(lambda column: column[first], every))
            return jax.tree.map(lambda column: column[same], tables)

    return tuple(map(table, range(len(builder.faces))))


def index_tables(builder: StackBuilder, plan: ChannelPlan, config: SolverConfig) -> tuple[Table | None, ...]:
    """Table of each interface over a refractive index, if a single one is free; else None.

    It takes as long as about a hundred Jacobians without it.
    """
    free = _free_index(builder)
    if free is None:
        return (None,) * len(builder.faces)
    return tuple(_index_table(builder, plan, config, k, free) for k in range(len(builder.faces)))


def tabulated_interface(table: Table, face: Roughness, values: Mapping) -> RoughInterface:
    """A rough interface from its table, at the values of all parameters at one wavelength by name."""
    is_mixture = isinstance(table.at_nodes if isinstance(table, IndexTable) else table, MixtureTable)
    keys = ("sigma_deg", "second_sigma_deg", "second_weight") if is_mixture else ("sigma_deg",)
    at_angles = [values[f"{face.name}.{key}"] for key in keys]
    if not isinstance(table, IndexTable):
        return table.at(*at_angles)
    # Otherwise each variable of a fit would read all of the table.
    index = values[table.index]
    return by_own_inputs(lambda table, index, angles: table.at(index).at(*angles), table, index, at_angles)


class _Face(NamedTuple):
    """A rough face with facets."""

    builder: StackBuilder
    plan: ChannelPlan
    config: SolverConfig
    interface: int
    densities: tuple[Density, ...]
    sizes: RoughSizes

    def table(self, wavelength_nm, values) -> AngleTable:
        """The table over the angles at one wavelength, for fixed indices."""
        stack = self.builder.stack(values, wavelength_nm)
        outer, inner = (stack.indices[side] for side in stack.sides(self.interface))
        n_outer = self.plan.n_outer(stack, self.interface, self.config)
        given = self.plan.grid(stack, self.config), (outer, inner)
        sizes = dataclasses.replace(self.sizes, n_outer=n_outer)
        match self.densities:
            case (one, other):
                return mixture_table(*given, (one, other), self.config.n_orders, sizes)
        return rough_table(*given, self.densities[0], self.config.n_orders, sizes)


def _distinct(
    builder: StackBuilder, values: Mapping
) -> tuple[Int[np.ndarray, " distinct"], Int[np.ndarray, " wavelengths"]]:
    """Wavelengths with different indices, by which alone facets depend on it; which one each is equal to."""
    indices = np.stack([np.asarray(values[name]) for name in index_names(builder.sample)])
    _, first, same = np.unique(indices, axis=1, return_index=True, return_inverse=True)
    return first, same.reshape(-1)


def _is_fixed(builder: StackBuilder, index: str) -> bool:
    parameters = builder.sample.parameters.values()
    return all(p.is_fixed for p in parameters if p.name.startswith(index))


def _densities(builder: StackBuilder, interface: int) -> tuple[Density, ...] | None:
    """Law and range of the angle of each density of facets; None if there is none, or an angle is tied."""
    face, laws = builder.faces[interface], builder.laws[interface]
    if face is None or not laws:
        return None
    densities = []
    for law, key in zip(laws, ("sigma_deg", "second_sigma_deg"), strict=False):
        angle = builder.sample.parameters.get(f"{face.name}.{key}")
        if angle is None or angle.tie is not None:
            return None
        densities.append((law, (angle.minimum, angle.maximum) if angle.free else (angle.value,) * 2))
    return tuple(densities)


def _free_index(builder: StackBuilder) -> Parameter | None:
    """The only parameter that gives a refractive index and may change, if it is the index itself."""
    sample = builder.sample
    names = [name for name in index_names(sample) if not _is_fixed(builder, name)]
    sources = {sample.parameters.source(name) for name in names}
    if len(sources) != 1:
        return None
    parameter = sample.parameters.get(sources.pop())
    at_wavelengths = any(p.name.startswith(f"{name}@") for name in names for p in sample.parameters.values())
    is_index = parameter is not None and parameter.name in names and parameter.free
    return parameter if is_index and not at_wavelengths else None


def _index_table(builder, plan, config, interface, free) -> IndexTable | None:
    densities = _densities(builder, interface)
    if densities is None:
        return None
    with computing(), jax.ensure_compile_time_eval():
        every = builder.values({})
        first, same = _distinct(builder, every)
        pieces = [
            _pieces(builder, plan, free, {name: float(value[k]) for name, value in every.items()})
            for k in first
        ]
        if len({len(own) for own in pieces}) > 1:
            return None
        counts = tuple(max(piece.n_nodes for piece in alike) for alike in zip(*pieces, strict=True))
        face = _Face(builder, plan, config, interface, densities, QUICK)
        at_wavelengths = []
        for k, own in zip(first, pieces, strict=True):
            nodes = np.concatenate([p.nodes(n) for p, n in zip(own, counts, strict=True)])
            tables = []
            for node in nodes:
                values = {name: value[k] for name, value in builder.values({free.name: node}).items()}
                tables.append(face.table(jnp.asarray(builder.wavelengths_nm[k]), values))
                if _megabytes(tables[0]) * len(nodes) * len(same) > _LARGEST_MB:
                    return None
            at_wavelengths.append(jax.tree.map(lambda *nodes: jnp.stack(nodes), *tables))
        low, high = (jnp.asarray([[piece[i] for piece in pieces[k]] for k in same], float) for i in (0, 1))
        tables = jax.tree.map(lambda *waves: jnp.stack(waves)[same], *at_wavelengths)
    return IndexTable(tables, low, high, counts, free.name)


def _pieces(
    builder: StackBuilder, plan: ChannelPlan, free: Parameter, values: Mapping[str, float]
) -> tuple[Piece, ...]:
    names = index_names(builder.sample)
    scatters = [False, *(layer.scatters for layer in builder.sample.layers), False]
    own = [medium for medium, name in enumerate(names) if not _is_fixed(builder, name)]
    others = [(values[names[m]], scatters[m]) for m in plan.block_media if m not in own]
    return pieces_of((free.minimum, free.maximum), any(scatters[m] for m in own), others)


def _megabytes(table: AngleTable) -> float:
    return sum(values.nbytes for values in jax.tree.leaves(table)) / 1e6
