"""Further kinds of particles in a layer, and tables of sizes."""

import dataclasses
from collections import Counter
from typing import Any

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.sample import schema
from jaxink.sample.entries import is_number, require_equally_many
from jaxink.sample.parameters import ParameterTable

RadiusTable = tuple[tuple[float, ...], tuple[float, ...]]


@dataclasses.dataclass(frozen=True)
class Population:
    """A further kind of Mie particles in a layer; its parameters are named ``layer.name.quantity``.

    Parameters
    ----------
    name
        Second part of the names of its parameters.
    radius_table
        Tabulated radii in nm and their relative numbers, or None.
    """

    __repr__ = brief_repr

    name: str
    radius_table: RadiusTable | None = None


def population_tables(table: dict[str, Any], layer: str, taken) -> list[dict[str, Any]]:
    """Tables of the further populations of a layer, with valid names that are not keys of the layer."""
    tables, where = table.get("populations", []), f"layer '{layer}'"
    if not isinstance(tables, list) or not all(isinstance(t, dict) for t in tables):
        raise InputRefusedError(
            f"{where}: populations must be [[layers.populations]] tables, one for each further kind of "
            "particles."
        )
    names = Counter(str(inner.get("name")) for inner in tables)
    for position, inner in enumerate(tables):
        name = inner.get("name")
        if not isinstance(name, str) or not name.isidentifier():
            raise InputRefusedError(
                f"{where}: population {position + 1} has name = {name!r}; it needs a name of letters, digits "
                'and underscores, such as name = "filler".'
            )
        if names[name] > 1:
            raise InputRefusedError(f"{where}: two populations are named '{name}'; their names must differ.")
        if name in taken:
            raise InputRefusedError(
                f"{where}: a population is named '{name}', which is a key of the layer; choose another name."
            )
    return tables


def radius_table(table: dict[str, Any], where: str) -> RadiusTable | None:
    """Radii in nm and relative numbers of one kind of particles, or None without a table of sizes."""
    radii, weights = (table.get(key) for key in schema.RADIUS_TABLE)
    if radii is None and weights is None:
        return None
    if radii is None or weights is None:
        raise InputRefusedError(f"{where} has one of radii_nm and number_weights; give both, or radius_nm.")
    for key in ("radius_nm", *schema.SIZE_DISTRIBUTION):
        if key in table:
            raise InputRefusedError(f"{where} has both radii_nm and {key}; remove one of them.")
    lowest, highest = schema.MIE["radius_nm"].lowest, schema.MIE["radius_nm"].highest
    for key, column, least in (("radii_nm", radii, lowest), ("number_weights", weights, 0.0)):
        most = highest if key == "radii_nm" else float("inf")
        if not isinstance(column, list) or not all(is_number(v) and least <= v <= most for v in column):
            raise InputRefusedError(
                f"{where}: {key} must be a list of numbers between {least:g} and {most:g}."
            )
    require_equally_many(where, radii_nm=radii, number_weights=weights)
    if not 1 <= len(radii) <= schema.MOST_TABULATED_RADII or not any(weights):
        raise InputRefusedError(
            f"{where}: radii_nm must have 1 to {schema.MOST_TABULATED_RADII} radii, at least one with a "
            "value in number_weights above 0."
        )
    return tuple(map(float, radii)), tuple(map(float, weights))


def check_volume(layer: str, particles: list[str], table: ParameterTable) -> None:
    """Reject particles that could together exceed the densest packing of spheres, at the start or in a fit.

    ``particles`` are the prefixes of the parameter names of each kind.
    """
    start, most = table.values_with({}), schema.MIE["volume_fraction"].highest
    total = 0.0
    for name in particles:
        given = [p for p in table.values() if p.name.split("@")[0] == f"{name}.volume_fraction"]
        total += max(p.maximum if p.free else start[p.name] for p in given)
    if len(particles) > 1 and total > most:
        raise InputRefusedError(
            f"layer '{layer}': the volume fractions of all particles may add up to {total:g}, but spheres "
            f"fill at most {most:g}; reduce volume_fraction or its max."
        )
