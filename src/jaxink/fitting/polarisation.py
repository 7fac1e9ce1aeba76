"""The error of the scalar theory beside a fit."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxink.effects import AugmentedModel
from jaxink.effects.waves import Polarisation
from jaxink.fitting.merit import rms
from jaxink.fitting.objective import Objective
from jaxink.fitting.outcome import Search
from jaxink.fitting.programs import split
from jaxink.fitting.result import NeglectedPolarisation
from jaxink.model.forward import ForwardModel
from jaxink.model.polarised import why_not_polarised
from jaxink.numerics.compiling import hastily
from jaxink.numerics.fingerprint import fingerprint
from jaxink.numerics.weak_cache import WeakCache
from jaxink.sample import Sample


def neglected_polarisation(
    sample: Sample, objective: Objective, best: Search
) -> NeglectedPolarisation | None:
    """What polarisation would change at the solution; None if it is unknown or part of the model."""
    model = objective.model
    if not isinstance(model, ForwardModel | AugmentedModel):
        return None
    if why_not_polarised(sample) or Polarisation.name in (effect.name for effect in sample.effects):
        return None
    arrays, *static = split(objective)
    excess = _program(*static)(arrays, jnp.asarray(best.unit))
    relative = np.asarray(excess) / best.predicted
    return NeglectedPolarisation(rms(relative), float(np.max(np.abs(relative))))


@WeakCache
def _program(treedef, leaves):
    static = jax.tree.unflatten(treedef, leaves)

    def excess(arrays, unit):
        objective = eqx.combine(arrays, static)
        return objective.model.polarised_excess(objective.given(objective.scale.to_physical(unit)))

    key = fingerprint(static)
    return hastily(excess, key=key and fingerprint(key, "polarised excess"))
