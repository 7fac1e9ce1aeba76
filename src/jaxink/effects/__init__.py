"""Effects that a model may lack, applied from outside: the physical model does not know them."""

from jaxink.effects.augmented import (
    AugmentedModel,
    as_declared,
    carriers,
    extend,
    forward_model,
    model_at,
    tabulated,
    undivided,
)
from jaxink.effects.case import Case
from jaxink.effects.catalogue import CATALOGUE, CATALOGUE_VERSION, Listed, effects_for
from jaxink.effects.constants import DeclaredConstant
from jaxink.effects.declared import declare, declared_effects, settled, with_values
from jaxink.effects.geometry import Pinholes
from jaxink.effects.kinds import (
    AddedLight,
    AreaWithOtherSample,
    AreaWithOtherValues,
    DividingEffect,
    Effect,
    EmittingEffect,
    FinerDiscretisation,
    Inapplicable,
    ReadingEffect,
    SampleEffect,
    ScalingEffect,
    UnevenSurface,
)
from jaxink.effects.of_readings import AugmentedReadings, readings_model
from jaxink.effects.scene import Field, Scene, Surroundings
from jaxink.effects.validity import invalidity, own_error
from jaxink.effects.waves import Polarisation
from jaxink.effects.wording import in_numbers

__all__ = [
    "CATALOGUE",
    "CATALOGUE_VERSION",
    "AddedLight",
    "AreaWithOtherSample",
    "AreaWithOtherValues",
    "AugmentedModel",
    "AugmentedReadings",
    "Case",
    "DeclaredConstant",
    "DividingEffect",
    "Effect",
    "EmittingEffect",
    "Field",
    "FinerDiscretisation",
    "Inapplicable",
    "Listed",
    "Pinholes",
    "Polarisation",
    "ReadingEffect",
    "SampleEffect",
    "ScalingEffect",
    "Scene",
    "Surroundings",
    "UnevenSurface",
    "as_declared",
    "carriers",
    "declare",
    "declared_effects",
    "effects_for",
    "extend",
    "forward_model",
    "in_numbers",
    "invalidity",
    "model_at",
    "own_error",
    "readings_model",
    "settled",
    "tabulated",
    "undivided",
    "with_values",
]
