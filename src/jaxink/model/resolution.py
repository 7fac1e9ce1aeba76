"""Resolution of the solver for a sample."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp

from jaxink.model.build import StackBuilder
from jaxink.numerics.batches import at_each
from jaxink.numerics.precision import computing
from jaxink.solver import ChannelPlan, SolverConfig, demand, require_accuracy, require_resolvable, sizes_for


def model_sizes(
    builder: StackBuilder, plan: ChannelPlan, free_values: Mapping, accuracy: float, layer_method: str
) -> SolverConfig:
    """Resolution that keeps the BSDF within an accuracy at every wavelength.

    Parameters
    ----------
    builder, plan
        Builder of the stacks, and their channels.
    free_values
        Known values by name, in place of those of the sample's table.
    accuracy, layer_method
        See `choose_sizes`.

    Raises
    ------
    InputRefusedError
        If a phase function of the sample's table has too narrow a backward peak; what a search meets on its
        way is not refused.
    """
    require_accuracy(accuracy)
    # Samples that differ in their values only share the program, and its copy in memory.
    structure = builder.without_values(tuple(builder.sample.parameters))
    with computing():
        needed = _demand(structure, plan, builder.values(free_values))
        if not free_values:
            require_resolvable(needed, accuracy)
        found = sizes_for(needed, accuracy, layer_method)
    # A fit has to rank values other than those it starts from.
    return found.at_least(SolverConfig()) if builder.sample.parameters.free else found


@eqx.filter_jit
def _demand(builder: StackBuilder, plan: ChannelPlan, values):
    def at_wavelength(wavelength_nm, here):
        return demand(builder.stack(here, wavelength_nm), plan)

    return at_each(at_wavelength, jnp.asarray(builder.wavelengths_nm), values)
