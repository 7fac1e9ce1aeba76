"""Kinds of effects: an effect is of one kind, and nothing is overridden twice."""

import inspect

import numpy as np
import pytest

from jaxink.effects import (
    CATALOGUE,
    AddedLight,
    AreaWithOtherSample,
    AreaWithOtherValues,
    Effect,
    EmittingEffect,
    FinerDiscretisation,
    ReadingEffect,
    SampleEffect,
    Scene,
    Surroundings,
    UnevenSurface,
)
from jaxink.effects.instrument import AngleOffset, Gain, IncidenceAngle

KINDS = (
    AddedLight,
    SampleEffect,
    AreaWithOtherSample,
    AreaWithOtherValues,
    ReadingEffect,
    UnevenSurface,
    EmittingEffect,
    FinerDiscretisation,
)
# Methods of an effect that may be replaced, once.
DEFAULTS = {
    "forms",
    "settings",
    "carrier",
    "is_screened",
    "changes_structure",
    "of_sample",
    "form",
    "settled",
}


def descendants(kind):
    """Classes of the library that derive from one."""
    for one in kind.__subclasses__():
        if one.__module__.startswith("jaxink."):
            yield one
            yield from descendants(one)


CLASSES = sorted({Effect, *descendants(Effect)}, key=lambda c: c.__qualname__)


@pytest.mark.parametrize("cls", CLASSES, ids=lambda c: c.__qualname__)
def test_no_method_is_overridden_twice(cls):
    for name in vars(cls):
        if name.startswith("__") or name.startswith("_abc"):
            continue
        inherited = [vars(parent)[name] for parent in cls.__mro__[1:] if name in vars(parent)]
        methods = [m for m in inherited if callable(m) or isinstance(m, property | classmethod)]
        written = [m for m in methods if not getattr(m, "__isabstractmethod__", False)]
        assert len(written) <= (name in DEFAULTS), name


@pytest.mark.parametrize("cls", CLASSES, ids=lambda c: c.__qualname__)
def test_a_class_is_complete_or_a_base(cls):
    # A name makes it an effect that a catalogue can hold.
    is_leaf = not any(issubclass(one, cls) for one in CLASSES if one is not cls)
    assert hasattr(cls, "name") == is_leaf
    if is_leaf:
        assert not inspect.isabstract(cls)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_every_effect_is_of_one_kind(effect):
    assert sum(issubclass(effect, kind) for kind in KINDS) == 1
    assert effect.group in {
        "instrument",
        "surface",
        "volume",
        "geometry",
        "constant",
        "wave optics",
        "numerics",
    }


def test_a_model_computes_what_its_readings_look_at():
    n = 4
    scene = Scene.of(
        np.full(n, 20.0),
        np.array([0.0, 30.0, 60.0, 70.0]),
        np.full(n, 180.0),
        np.full(n, 550.0),
        np.zeros(n, bool),
        np.arange(n),
    )
    # All points lie in one plane, whose grid has 90 angles.
    sizes = {Surroundings.NOTHING: n, Surroundings.PLANES: n + 90, Surroundings.INCIDENCES: 3 * n}
    for surroundings, size in sizes.items():
        assert len(scene.all_directions(surroundings)[0]) == size
    both = Surroundings.PLANES | Surroundings.INCIDENCES
    assert len(scene.all_directions(both)[0]) == 3 * n + 90
    assert (Gain.looks_at, AngleOffset.looks_at, IncidenceAngle.looks_at) == tuple(sizes)
