"""Conversion between a sample and plain data for result files."""

import dataclasses
import math
from collections.abc import Callable, Collection
from typing import Any, TypedDict

from jaxink.errors import InputRefusedError
from jaxink.files.decoding import Rules, decode
from jaxink.files.encoding import plain as as_plain
from jaxink.sample.declared_effects import DeclaredEffect, FormValue, own_kinds
from jaxink.sample.description import Sample
from jaxink.sample.parameters import Parameter, ParameterTable
from jaxink.sample.residual_weight import with_named_fields
from jaxink.sample.soundness import require_sound

# A tied parameter has no value, and a range may be unbounded.
NULLS = {"value": math.nan, "minimum": -math.inf, "maximum": math.inf}


class _EffectEntry(TypedDict):
    name: str
    form: dict[str, FormValue]


def sample_to_dict(sample: Sample) -> dict[str, Any]:
    """Plain data of a sample: strings, numbers, lists and None only; infinite ranges are None.

    Effects of a user's own are kept by their name.
    """
    effects = [{"name": effect.name, "form": dict(effect.form)} for effect in sample.effects]
    plain = as_plain(dataclasses.replace(sample, effects=()))
    return plain | {"parameters": as_plain(tuple(sample.parameters.values())), "effects": as_plain(effects)}


def sample_from_dict(plain: Any, key: str = "sample", effects: Collection[Any] = ()) -> Sample:
    """Sample from the data of `sample_to_dict`; invalid data are rejected, with ``key`` as their name.

    Parameters
    ----------
    plain, key
        The data and their name.
    effects
        Classes of effects of a user's own that the sample may declare.
    """
    sample = decode(Sample, with_named_fields(plain), key, _rules(own_kinds(effects)))
    try:
        require_sound(sample)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{key}: {problem}") from None
    return sample


def _rules(own: dict[str, Any]) -> Rules:
    def effect(entry: _EffectEntry) -> DeclaredEffect:
        return DeclaredEffect(entry["name"], tuple(entry["form"].items()), own.get(entry["name"]))

    made: dict[type, tuple[Any, Callable[[Any], Any]]] = {
        ParameterTable: (tuple[Parameter, ...], ParameterTable),
        DeclaredEffect: (_EffectEntry, effect),
    }
    return Rules(NULLS, made)
