"""Rough interfaces of a sample, tabulated beforehand if at most the angle of their facets is free."""

import jax
import jax.numpy as jnp

from jaxink.model.build import StackBuilder
from jaxink.model.media import index_names
from jaxink.numerics.batches import at_each
from jaxink.numerics.precision import computing
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import ChannelPlan
from jaxink.surfaces.slopes import DENSITIES
from jaxink.surfaces.table import RoughTable, rough_table


def rough_tables(
    builder: StackBuilder, plan: ChannelPlan, config: SolverConfig
) -> tuple[RoughTable | None, ...]:
    """Table of each interface at every wavelength; None if it is smooth or cannot be tabulated."""
    return tuple(_rough_table(builder, plan, config, k) for k in range(len(builder.faces)))


def _rough_table(builder, plan, config, interface) -> RoughTable | None:
    face, parameters = builder.faces[interface], builder.sample.parameters
    if face is None or face.density not in DENSITIES or face.second_density is not None:
        return None
    if any(not p.is_fixed and p.name.startswith(index_names(builder.sample)) for p in parameters.values()):
        return None
    sigma = parameters.get(f"{face.name}.sigma_deg")
    if sigma is None or sigma.tie is not None:
        return None
    span = (sigma.minimum, sigma.maximum) if sigma.free else (sigma.value, sigma.value)

    def at_wavelength(wavelength_nm, values):
        stack = builder.stack(values, wavelength_nm)
        outer, inner = (stack.indices[side] for side in stack.sides(interface))
        n_outer = plan.n_outer(stack, interface, config)
        return rough_table(
            plan.grid(stack, config), (outer, inner), face.density, span, config.n_orders, n_outer
        )

    # Evaluated to numbers even if the model is made inside a function that is being compiled.
    with computing(), jax.ensure_compile_time_eval():
        return at_each(at_wavelength, jnp.asarray(builder.wavelengths_nm), builder.values({}))
