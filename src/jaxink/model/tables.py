"""Rough interfaces of a sample, tabulated beforehand if no refractive index is free."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp

from jaxink.model.build import StackBuilder
from jaxink.model.media import index_names
from jaxink.numerics.batches import at_each
from jaxink.numerics.precision import computing
from jaxink.sample import Roughness
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import ChannelPlan
from jaxink.surfaces.interface import RoughInterface
from jaxink.surfaces.table import MixtureTable, RoughTable, mixture_table, rough_table

Table = RoughTable[RoughInterface] | MixtureTable


def rough_tables(builder: StackBuilder, plan: ChannelPlan, config: SolverConfig) -> tuple[Table | None, ...]:
    """Table of each interface at every wavelength; None if it is smooth or cannot be tabulated."""
    return tuple(_rough_table(builder, plan, config, k) for k in range(len(builder.faces)))


def tabulated_interface(table: Table, face: Roughness, values: Mapping) -> RoughInterface:
    """A rough interface from its table, at the values of all parameters at one wavelength by name."""
    angle, second, weight = (
        f"{face.name}.{key}" for key in ("sigma_deg", "second_sigma_deg", "second_weight")
    )
    if isinstance(table, MixtureTable):
        return table.at(values[angle], values[second], values[weight])
    return table.at(values[angle])


def _rough_table(builder, plan, config, interface) -> Table | None:
    face, parameters = builder.faces[interface], builder.sample.parameters
    if face is None or not builder.laws[interface]:
        return None
    if any(not p.is_fixed and p.name.startswith(index_names(builder.sample)) for p in parameters.values()):
        return None
    laws = builder.laws[interface]
    keys = ("sigma_deg", "second_sigma_deg")[: len(laws)]
    angles = [parameters.get(f"{face.name}.{key}") for key in keys]
    if any(angle is None or angle.tie is not None for angle in angles):
        return None
    spans = [(a.minimum, a.maximum) if a.free else (a.value, a.value) for a in angles]
    densities = tuple(zip(laws, spans, strict=True))

    def at_wavelength(wavelength_nm, values):
        stack = builder.stack(values, wavelength_nm)
        outer, inner = (stack.indices[side] for side in stack.sides(interface))
        n_outer = plan.n_outer(stack, interface, config)
        given = plan.grid(stack, config), (outer, inner)
        if len(densities) == 2:
            return mixture_table(*given, densities, config.n_orders, n_outer)
        return rough_table(*given, densities[0], config.n_orders, n_outer)

    # Evaluated to numbers even if the model is made inside a function that is being compiled.
    with computing(), jax.ensure_compile_time_eval():
        return at_each(at_wavelength, jnp.asarray(builder.wavelengths_nm), builder.values({}))
