"""Sizes of the discretisation for a sample."""

from collections.abc import Mapping

import equinox as eqx

from jaxink.model.build import StackBuilder
from jaxink.numerics.precision import computing
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.resolution import demand, sizes_for


def model_sizes(
    builder: StackBuilder, plan: ChannelPlan, free_values: Mapping, accuracy: float, layer_method: str
) -> SolverConfig:
    """Sizes of the discretisation that keep the BSDF within an accuracy at every wavelength.

    Parameters
    ----------
    builder
        Of the stacks.
    plan
        Their channels.
    free_values
        Known values by name that replace those of the sample's table.
    accuracy, layer_method
        As of `choose_sizes`.
    """
    with computing():
        found = sizes_for(_demand(builder, plan, builder.values(free_values)), accuracy, layer_method)
    # A fit visits other values than those it starts from, and has to rank them.
    return found.at_least(SolverConfig()) if builder.sample.parameters.free else found


@eqx.filter_jit
def _demand(builder: StackBuilder, plan: ChannelPlan, values):
    return builder.at_each_wavelength(lambda w, here: demand(builder.stack(here, w), plan), values)
