"""Effects that a model may lack, each a change of the model from above; physics knows nothing of them."""

from jaxink.effects.augmented import AugmentedModel, extend
from jaxink.effects.catalogue import CATALOGUE, CATALOGUE_VERSION, Listed, effects_for
from jaxink.effects.effect import Case, Effect
from jaxink.effects.scene import Field, Scene

__all__ = [
    "CATALOGUE",
    "CATALOGUE_VERSION",
    "AugmentedModel",
    "Case",
    "Effect",
    "Field",
    "Listed",
    "Scene",
    "effects_for",
    "extend",
]
