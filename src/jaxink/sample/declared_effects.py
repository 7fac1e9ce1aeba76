"""Effects that a sample file declares in tables ``[effects.NAME]``; what they do is known further up."""

import dataclasses
from collections.abc import Collection
from typing import Any

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.sample.effect_schema import EFFECTS, ELSEWHERE
from jaxink.sample.entries import bounded, only, table_of
from jaxink.sample.hints import unknown_key
from jaxink.sample.parameter_reading import ParameterReader
from jaxink.sample.schema import Quantity

FormValue = str | int | float | bool | None


@dataclasses.dataclass(frozen=True)
class DeclaredEffect:
    """An effect that is part of a sample's description; its numbers are in the parameter table.

    Parameters
    ----------
    name
        Of the effect, first part of the names of its parameters.
    form
        In which form it is present: key and value, without keys that have their defaults.
    kind
        Class of an effect of a user's own, as passed by the caller; None for one of the catalogue. Files
        only ever contain the name.
    """

    __repr__ = brief_repr

    name: str
    form: tuple[tuple[str, FormValue], ...] = ()
    kind: Any = None


def own_kinds(effects: Collection[Any]) -> dict[str, Any]:
    """Classes of effects of a user's own, by name."""
    kinds = {}
    for kind in effects:
        name = getattr(kind, "name", None)
        if not isinstance(kind, type) or not isinstance(name, str):
            raise InputRefusedError(
                f"effects contains {kind!r}; it must contain classes of effects, which have a name."
            )
        kinds[name] = kind
    return kinds


def read_effects(
    document: dict[str, Any], numbers: ParameterReader, layers: Collection[str], own: dict[str, Any]
) -> tuple[DeclaredEffect, ...]:
    """The declared effects of a file; their numbers become parameters.

    Parameters
    ----------
    document
        The file.
    numbers
        Collects the parameters.
    layers
        Names of the layers.
    own
        Classes of effects of a user's own, by name.
    """
    found = []
    for name, table in table_of(document, "effects").items():
        where = f"[effects.{name}]"
        if not isinstance(table, dict):
            raise InputRefusedError(f"effects.{name} must be a table: write {where} and its keys below.")
        if name in layers:
            raise InputRefusedError(f"a layer is named '{name}', like the effect {where}; rename the layer.")
        effect = _own_effect(name, table, own[name]) if name in own else _known_effect(name, table, layers)
        quantities = _quantities(effect)
        only(table, (*quantities, *_form_keys(effect)), where)
        _require_simple(name, table, quantities)
        numbers.read(name, quantities, table)
        found.append(effect)
    return tuple(found)


def _known_effect(name: str, table: dict[str, Any], layers: Collection[str]) -> DeclaredEffect:
    if name in ELSEWHERE:
        raise InputRefusedError(f"[effects.{name}] is declared elsewhere in the file: by {ELSEWHERE[name]}.")
    if name not in EFFECTS:
        raise InputRefusedError(
            f"[effects] has the key '{name}', {unknown_key(name, EFFECTS)} For an effect of your own, pass "
            "its class in the argument effects."
        )
    form = []
    for key, kind in EFFECTS[name].form.items():
        if key in table:
            form.append((key, _form_value(f"effects.{name}.{key}", table[key], kind, layers)))
        elif isinstance(kind, Quantity) and kind.otherwise == "required":
            unit = f" in {kind.unit}" if kind.unit else ""
            raise InputRefusedError(f"effects.{name}.{key} is missing; write {key} = <number{unit}>.")
    return DeclaredEffect(name, tuple(form))


def _form_value(name: str, given: Any, kind: Any, layers: Collection[str]) -> FormValue:
    if isinstance(kind, Quantity):
        return bounded(given, kind, name)
    if kind.values == "integer":
        if not isinstance(given, int) or isinstance(given, bool) or not 0 <= given <= len(layers):
            raise InputRefusedError(f"{name} is {given!r}; it must be an integer from 0 to {len(layers)}.")
        return given
    if given not in layers:
        raise InputRefusedError(f"{name} is {given!r}; it must be one of the layers: {', '.join(layers)}.")
    return given


def _own_effect(name: str, table: dict[str, Any], kind: Any) -> DeclaredEffect:
    empty = DeclaredEffect(name, (), kind)
    return dataclasses.replace(empty, form=tuple((k, table[k]) for k in _form_keys(empty) if k in table))


def _form_keys(effect: DeclaredEffect) -> tuple[str, ...]:
    """Keys of an effect's form."""
    if effect.kind is None:
        return tuple(EFFECTS[effect.name].form)
    return tuple(field.name for field in dataclasses.fields(effect.kind) if field.init)


def _quantities(effect: DeclaredEffect) -> dict[str, Quantity]:
    """Quantities of an effect's numbers by key."""
    if effect.kind is None:
        return EFFECTS[effect.name].numbers
    try:
        terms = effect.kind(**dict(effect.form)).terms
    except TypeError as problem:
        raise InputRefusedError(f"[effects.{effect.name}] does not describe the effect: {problem}.") from None
    for term in terms:
        if not term.name.startswith(f"{effect.name}."):
            raise InputRefusedError(
                f"the effect '{effect.name}' has the parameter {term.name}; to be declared in a sample file, "
                f"its parameters must be named {effect.name}.<key>."
            )
    return {
        t.name.split(".", 1)[1]: Quantity(
            t.unit, t.minimum, t.maximum, None if i == 0 else t.value, t.scale, t.multimodal, meaning=""
        )
        for i, t in enumerate(terms)
    }


_BY_WAVELENGTH = {"per_wavelength", "shape", "smoothness", "dispersion", "law"}


def _require_simple(name: str, table: dict[str, Any], quantities: dict[str, Quantity]) -> None:
    """Reject numbers by wavelength where an effect has one value for all."""
    for key in quantities.keys() & table.keys():
        excluded = _BY_WAVELENGTH - ({"per_wavelength"} if quantities[key].spectral else set())
        if isinstance(table[key], dict) and excluded & table[key].keys():
            raise InputRefusedError(
                f"effects.{name}.{key} depends on the wavelength; an effect has one value for all of them."
            )
