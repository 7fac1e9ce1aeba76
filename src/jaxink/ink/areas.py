"""The ink of a sample that declares effects: areas that differ, and what is not part of the ink."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxink.effects import (
    AreaWithOtherSample,
    AreaWithOtherValues,
    DividingEffect,
    Effect,
    Pinholes,
    SampleEffect,
    as_declared,
    declared_effects,
    extend,
    undivided,
    with_values,
)
from jaxink.ink.ink_layers import InkLayers
from jaxink.sample import Sample

Values = Mapping[str, Any]
# Groups of readings that are no properties of the sample; the angle of incidence is a constant.
_OF_THE_MEASUREMENT = ("instrument", "numerics", "constant")


def _all_of_it(values: Values) -> float:
    del values
    return 1.0


def _nothing(values: Values) -> dict[str, Any]:
    del values
    return {}


@dataclasses.dataclass(frozen=True)
class Area:
    """A part of the sample.

    Parameters
    ----------
    ink
        The ink there; None: there is no ink.
    share
        Share of what earlier areas leave, from the values of all parameters; 1 for the first.
    changed
        Values that differ there, from the values of all parameters.
    """

    ink: InkLayers | None
    share: Callable[[Values], Any] = _all_of_it
    changed: Callable[[Values], dict[str, Any]] = _nothing


@dataclasses.dataclass(frozen=True)
class Areas:
    """The areas of a sample; the others take their shares from the first, one after the other.

    Parameters
    ----------
    sample
        As declared.
    parts
        The areas.
    left_out
        Declared effects that are properties of the sample, but that no table of an ink contains.
    of_the_measurement
        Declared effects that are none.
    """

    sample: Sample
    parts: tuple[Area, ...]
    left_out: tuple[str, ...]
    of_the_measurement: tuple[str, ...]

    @property
    def start(self) -> dict[str, Any]:
        """Values of all parameters."""
        return self.values({})

    def values(self, free: Values) -> dict[str, Any]:
        """Values of all parameters with some of them replaced, possibly traced."""
        return self.sample.parameters.values_with(free)

    def weights_with_slopes(self, names: tuple[str, ...]) -> Float[np.ndarray, "rows areas"]:
        """Weights, then in further rows their derivatives by parameters."""
        start = self.start

        def of(x):
            return jnp.stack([jnp.asarray(w, float) for w in self.weights(dict(zip(names, x, strict=True)))])

        point = jnp.array([float(start[name]) for name in names])
        return np.concatenate([np.asarray(of(point))[None], np.asarray(jax.jacfwd(of)(point)).T])

    def weights(self, free: Values) -> list[Any]:
        """Share of the whole area that each part has."""
        values = self.values(free)
        weights: list[Any] = []
        for part in self.parts:
            share = part.share(values)
            weights = [weight * (1 - share) for weight in weights] + [share]
        return weights


def areas_of(ink: InkLayers) -> Areas:
    """The areas of an ink whose sample may declare effects."""
    sample = ink.sample
    effects = declared_effects(sample)
    changes = _kept(effects, SampleEffect)
    whole = dataclasses.replace(extend(sample, changes), effects=())
    parts = [Area(_in(ink, whole))]
    start = sample.parameters.values_with({})
    for effect in _kept(effects, AreaWithOtherValues):
        for k, (_, there) in enumerate(effect.mixture(start)):
            other = dataclasses.replace(whole, parameters=with_values(whole.parameters, there))
            parts.append(Area(_in(ink, other), _mixed(effect, k, 0), _mixed(effect, k, 1)))
    not_divided = extend(sample, undivided(changes))
    for effect in effects:
        if isinstance(effect, AreaWithOtherSample):
            other = extend(as_declared(sample, effect.other(not_divided)), _kept(changes, DividingEffect))
            parts.append(Area(_in(ink, dataclasses.replace(other, effects=())), _strength(effect)))
        elif isinstance(effect, Pinholes):
            parts.append(Area(None, _strength(effect)))
    return Areas(sample, tuple(parts), *apart_from_the_ink(sample))


def apart_from_the_ink(sample: Sample) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Declared effects that no table of an ink contains: properties of the sample, and of the measurement."""
    within = (SampleEffect, AreaWithOtherValues, AreaWithOtherSample, Pinholes)
    rest = [effect for effect in declared_effects(sample) if not isinstance(effect, within)]
    return (
        tuple(e.name for e in rest if e.group not in _OF_THE_MEASUREMENT),
        tuple(e.name for e in rest if e.group in _OF_THE_MEASUREMENT),
    )


def _mixed(effect: AreaWithOtherValues, area: int, entry: int) -> Callable[[Values], Any]:
    """Share (entry 0) or changed values (1) of an area of an effect."""
    return lambda values: effect.mixture(values)[area][entry]


def _strength(effect: Effect) -> Callable[[Values], Any]:
    return lambda values: values[effect.strength.name]


def _kept(effects: tuple[Effect, ...], kind: Any) -> tuple[Any, ...]:
    return tuple(effect for effect in effects if isinstance(effect, kind))


def _in(ink: InkLayers, sample: Sample) -> InkLayers:
    """The ink in an extended sample: its layers, their parts, and what effects put beside them."""
    declared = {layer.name for layer in ink.sample.layers}
    names = [layer.name for layer in sample.layers]
    of_ink = [k for k, name in enumerate(names) if name in ink.names]
    of_ink += [k for k, name in enumerate(names) if name not in declared and _is_part(name, ink.names)]
    first, last = min(of_ink), max(of_ink)
    while first > 0 and names[first - 1] not in declared:
        first -= 1
    while last + 1 < len(names) and names[last + 1] not in declared:
        last += 1
    return dataclasses.replace(ink, sample=sample, first=first, last=last)


def _is_part(name: str, inks: tuple[str, ...]) -> bool:
    return any(name in (f"{ink}_upper", f"{ink}_lower") for ink in inks)
