"""Inks by name, and layers that are mixed from them."""

from collections.abc import Iterable
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample import schema
from jaxink.sample.description import Sample
from jaxink.sample.entries import only, table_of
from jaxink.sample.hints import unknown_key
from jaxink.sample.mixture_shares import ROUNDING, require_at_most_whole
from jaxink.sample.parameter_reading import ParameterReader

# What a mixture gives to its layer.
MIXED = ("mixture", *schema.COEFFICIENTS, *schema.ALBEDO)
# More would make a tie longer than ties may be.
_MOST = 10
# Words that other parameters begin with.
_TAKEN = ("surroundings", "backing", "instrument")


def read_inks(
    document: dict[str, Any], layers: list[dict[str, Any]], numbers: ParameterReader
) -> tuple[str, ...]:
    """Names of the inks of a sample file; the coefficients of those in a mixture become parameters.

    Parameters
    ----------
    document
        The tables of the file.
    layers
        Tables of the layers, whose names are taken, with their mixtures.
    numbers
        Collects the parameters.
    """
    inks = table_of(document, "inks")
    mixtures = [layer["mixture"] for layer in layers if isinstance(layer.get("mixture"), dict)]
    used = {ink for mixture in mixtures for ink in mixture}
    taken = {*_TAKEN, *(str(layer.get("name")) for layer in layers), *table_of(document, "effects")}
    for name, table in inks.items():
        where = f"[inks.{name}]"
        if not isinstance(table, dict):
            raise InputRefusedError(f"inks.{name} must be a table: write {where} and its keys below.")
        if not name.isidentifier():
            raise InputRefusedError(
                f"{where}: the name of an ink consists of letters, digits and underscores, such as "
                "[inks.cyan]."
            )
        if name in taken:
            raise InputRefusedError(
                f"{where}: '{name}' is already the name of a layer or of another table, from which its "
                "parameters could not be told apart; choose another name."
            )
        only(table, schema.INKS, where)
        if name in used:
            numbers.read(name, schema.INKS, table)
    return tuple(inks)


def with_mixture(
    name: str, table: dict[str, Any], inks: tuple[str, ...], numbers: ParameterReader
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The table of a layer with its coefficients tied to those of the inks it is mixed from, and their names.

    The coefficients of inks that are mixed add up in proportion to their shares.

    Parameters
    ----------
    name
        Of the layer.
    table
        Of the layer.
    inks
        Names of the inks of the file.
    numbers
        Collects the shares.
    """
    if "mixture" not in table:
        return table, ()
    where, mixture = f"layer '{name}'", table["mixture"]
    if not isinstance(mixture, dict) or not mixture:
        raise InputRefusedError(
            f"{where}: mixture must be a table of shares, such as mixture = {{ cyan = 0.5, white = 0.5 }}."
        )
    if table.get("phase_function") == "mie":
        raise InputRefusedError(
            f"{where} has a mixture and Mie particles; a mixture gives coefficients, so choose another "
            "phase_function, or describe the pigments by [[layers.populations]]."
        )
    if len(mixture) > _MOST:
        raise InputRefusedError(f"{where} is mixed from {len(mixture)} inks; at most {_MOST} are possible.")
    for ink in mixture:
        if ink not in inks:
            raise InputRefusedError(
                f"{where}: mixture has the ink '{ink}', {unknown_key(ink, inks)}"
                if inks
                else f"{where}: mixture has the ink '{ink}', but the file has no inks; write [inks.{ink}]."
            )
    for key in (*schema.COEFFICIENTS, *schema.ALBEDO):
        if key in table:
            raise InputRefusedError(f"{where} has both mixture and {key}, which follows from it; remove one.")
    _check_shares(name, mixture)
    numbers.read(f"{name}.mixture", dict.fromkeys(mixture, schema.SHARE), mixture)
    sums = {
        key: " + ".join(f"{name}.mixture.{ink} * {ink}.{key}" for ink in mixture)
        for key in schema.COEFFICIENTS
    }
    if table.get("thickness_um") == schema.OPAQUE:
        scattering, absorption = sums.values()
        sums = {key: f"1 / (1 + ({absorption}) / ({scattering}))" for key in schema.ALBEDO}
    is_spectral = any(
        numbers.is_by_wavelength(f"{ink}.{key}") for ink in mixture for key in schema.COEFFICIENTS
    )
    spectral = {"per_wavelength": True} if is_spectral else {}
    ties = {key: {"tie": tie} | spectral for key, tie in sums.items()}
    return {key: value for key, value in table.items() if key != "mixture"} | ties, tuple(mixture)


def require_no_unused(declared: Iterable[str], samples: Iterable[Sample]) -> None:
    """Reject an ink of which no layer is mixed."""
    used = {ink for sample in samples for ink in sample.inks}
    for ink in declared:
        if ink not in used:
            raise InputRefusedError(
                f"[inks.{ink}] is in no mixture; add it to that of a layer, such as "
                f"mixture = {{ {ink} = 0.5 }}, or remove it."
            )


def _check_shares(name: str, mixture: dict[str, Any]) -> None:
    fixed = {ink: share for ink, share in mixture.items() if type(share) in (int, float)}
    for ink, share in fixed.items():
        if share > 1 + ROUNDING:
            raise InputRefusedError(
                f"{name}.mixture.{ink} is {share:g}; it must lie between 0 and 1: shares are parts of the "
                "volume, so divide per cent by 100."
            )
    require_at_most_whole(name, fixed)
