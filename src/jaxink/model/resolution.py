"""Sizes of the discretisation for a sample."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp

from jaxink.model.build import StackBuilder
from jaxink.numerics.batches import at_each
from jaxink.numerics.precision import computing
from jaxink.solver.accuracy import require_accuracy
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.resolution import demand, sizes_for


def model_sizes(
    builder: StackBuilder, plan: ChannelPlan, free_values: Mapping, accuracy: float, layer_method: str
) -> SolverConfig:
    """Sizes of the discretisation that keep the BSDF within an accuracy at every wavelength.

    Parameters
    ----------
    builder, plan
        Of the stacks, and their channels.
    free_values
        Known values by name that replace those of the sample's table.
    accuracy, layer_method
        As of `choose_sizes`.
    """
    require_accuracy(accuracy)
    with computing():
        found = sizes_for(_demand(builder, plan, builder.values(free_values)), accuracy, layer_method)
    # A fit visits other values than those it starts from, and has to rank them.
    return found.at_least(SolverConfig()) if builder.sample.parameters.free else found


@eqx.filter_jit
def _demand(builder: StackBuilder, plan: ChannelPlan, values):
    def at_wavelength(wavelength_nm, here):
        return demand(builder.stack(here, wavelength_nm), plan)

    return at_each(at_wavelength, jnp.asarray(builder.wavelengths_nm), values)
