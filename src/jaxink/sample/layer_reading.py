"""Reading the layers of a sample file; lengths are in millimetres or micrometres."""

import math
from decimal import Decimal
from pathlib import Path
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample import schema
from jaxink.sample.description import Layer
from jaxink.sample.entries import choice, is_list_of_numbers, only, require_equally_many
from jaxink.sample.ink_mixtures import with_mixture
from jaxink.sample.parameter_reading import ParameterReader
from jaxink.sample.populations import Population, population_tables, radius_table
from jaxink.sample.roughness import read_roughness
from jaxink.sample.schema import Quantity

# The other key, and the power of ten from its unit to that of the parameter.
_OTHER = {"thickness_mm": ("thickness_um", -3), "thickness_um": ("thickness_mm", 3)}


def layer_tables(document: dict[str, Any]) -> list[dict[str, Any]]:
    """The tables of the layers."""
    tables = document.get("layers")
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise InputRefusedError(
            "there are no layers; write a [[layers]] table for each, in the order in which light meets them."
        )
    return tables


def read_layer(
    position: int, table: dict[str, Any], folder: Path, numbers: ParameterReader, inks: tuple[str, ...] = ()
) -> Layer:
    """One layer; its numbers become parameters.

    Parameters
    ----------
    position
        Position of the layer, from 0.
    table
        The layer's table in the file.
    folder
        Folder of files that the table names.
    numbers
        Collects the parameters.
    inks
        Names of the inks that it may be mixed from.
    """
    name = table.get("name")
    if not isinstance(name, str) or not name.isidentifier():
        raise InputRefusedError(
            f"layer {position + 1} has name = {name!r}; it needs a name of letters, digits and "
            'underscores, such as name = "ink".'
        )
    kind = choice(table, "kind", ("clear", "scattering"), f"layer '{name}'")
    table = with_own_thickness(table, name, "thickness_mm" if kind == "clear" else "thickness_um")
    roughness = tuple(
        read_roughness(name, face, table[face], folder, numbers) for face in schema.FACES if face in table
    )
    if kind == "clear":
        only(table, ("name", "kind", *schema.FACES, *schema.CLEAR_LAYER), f"layer '{name}'")
        numbers.read(name, schema.CLEAR_LAYER, table)
        return Layer(name, kind, roughness=roughness)
    table, mixture = with_mixture(name, table, inks, numbers)
    phase = choice(table, "phase_function", tuple(schema.PHASE_FUNCTIONS), f"layer '{name}'")
    read = _mie_layer if phase == "mie" else _layer_with_coefficients
    opaque = table.get("thickness_um") == schema.OPAQUE
    thickness = {k: q for k, q in schema.SCATTERING_LAYER.items() if not (opaque and k == "thickness_um")}
    fields = read(name, table, thickness, numbers)
    return Layer(name, kind, phase, opaque, roughness=roughness, mixture=mixture, **fields)


def _mie_layer(
    name: str, table: dict[str, Any], thickness: dict[str, Quantity], numbers: ParameterReader
) -> dict[str, Any]:
    """Fields of a layer with Mie particles."""
    where = f"layer '{name}'"
    radii = radius_table(table, where)
    given = {k: q for k, q in schema.MIE_LAYER.items() if k in table}
    quantities = particle_quantities(thickness | schema.MIE | given, table)
    optional = schema.RADIUS_TABLE | schema.SIZE_DISTRIBUTION | schema.MIE_LAYER | schema.POPULATIONS
    keys = schema.LAYER_ENTRIES | schema.SCATTERING_LAYER | quantities | optional
    only(table, keys, where)
    numbers.read(name, quantities, table)
    populations = []
    for inner in population_tables(table, name, keys):
        stem = f"{name}.{inner['name']}"
        where = f"population '{stem}'"
        only(inner, ("name", *schema.MIE, *schema.SIZE_DISTRIBUTION, *schema.RADIUS_TABLE), where)
        populations.append(Population(inner["name"], radius_table(inner, where)))
        numbers.read(stem, particle_quantities(schema.MIE, inner), inner)
    return {"radius_table": radii, "populations": tuple(populations)}


def particle_quantities(quantities: dict[str, Quantity], table: dict[str, Any]) -> dict[str, Quantity]:
    """Quantities of one kind of particles, depending on the keys of the size distribution in the file."""
    distribution = {k: q for k, q in schema.SIZE_DISTRIBUTION.items() if k in table}
    both = quantities | distribution
    return {k: q for k, q in both.items() if k != "radius_nm" or "radii_nm" not in table}


def _layer_with_coefficients(
    name: str, table: dict[str, Any], thickness: dict[str, Quantity], numbers: ParameterReader
) -> dict[str, Any]:
    """Fields of a layer whose coefficients are given in the file."""
    where, opaque = f"layer '{name}'", "thickness_um" not in thickness
    for key in schema.COEFFICIENTS:
        if opaque and key in table:
            raise InputRefusedError(
                f"{where} is opaque and has {key}; give single_scattering_albedo = scattering / (scattering "
                "+ absorption) instead, because only the ratio matters."
            )
    phase = table["phase_function"]
    quantities = (
        thickness | (schema.ALBEDO if opaque else schema.COEFFICIENTS) | schema.PHASE_FUNCTIONS[phase]
    )
    columns = schema.PHASE_TABLE if phase == "tabulated" else {}
    only(table, schema.LAYER_ENTRIES | schema.SCATTERING_LAYER | quantities | columns, where)
    numbers.read(name, quantities, table)
    return {"phase_table": _phase_table(table, where)} if columns else {}


def _phase_table(table: dict[str, Any], where: str) -> tuple[str, tuple[float, ...], tuple[float, ...]]:
    by_angle, by_moments = "phase_value" in table, "moments" in table
    if by_angle == by_moments:
        raise InputRefusedError(
            f"{where} has a tabulated phase function; give either moments = [1, ...], or angle_deg and "
            "phase_value."
        )
    columns: list[Any] = [table.get(k) for k in (("angle_deg", "phase_value") if by_angle else ("moments",))]
    for column in columns:
        if not is_list_of_numbers(column):
            raise InputRefusedError(f"{where}: the table of the phase function must contain numbers only.")
    if by_moments:
        return "moments", (), tuple(map(float, columns[0]))
    require_equally_many(where, angle_deg=columns[0], phase_value=columns[1])
    return "angle_deg", tuple(map(float, columns[0])), tuple(map(float, columns[1]))


def with_own_thickness(table: dict[str, Any], layer: str, own: str) -> dict[str, Any]:
    """The table of a layer with the thickness in the unit of its parameter: value, range and prior.

    Parameters
    ----------
    table
        The layer's table in the file.
    layer
        Its name.
    own
        Key of the parameter: ``thickness_mm`` of a clear layer, ``thickness_um`` of a scattering one.

    Raises
    ------
    InputRefusedError
        If both keys are present, or the other one has a tie or a unit that is not its own.
    """
    other, power = _OTHER[own]
    if other not in table:
        return table
    if own in table:
        raise InputRefusedError(f"layer '{layer}' has both {own} and {other}; remove one of them.")
    given = table[other]
    unit, own_unit = other.rpartition("_")[2], own.rpartition("_")[2]
    if isinstance(given, dict):
        if "tie" in given:
            raise InputRefusedError(
                f"{layer}.{other} has a tie, but the parameter is {layer}.{own}, in {own_unit}; write "
                f'{own} = {{ tie = "..." }} with an expression in this unit.'
            )
        if given.get("unit", unit) != unit:
            raise InputRefusedError(
                f"{layer}.{other} has unit = {given['unit']!r}; the unit must be {unit}, as in its name."
            )
        given = {key: value for key, value in given.items() if key != "unit"}
    return {key: value for key, value in table.items() if key != other} | {own: _scaled(given, power)}


def _scaled(given: Any, power: int) -> Any:
    """Numbers times a power of ten, also in lists and tables; anything else is left to the checks."""
    if isinstance(given, dict):
        return {key: _scaled(value, power) for key, value in given.items()}
    if isinstance(given, list):
        return [_scaled(value, power) for value in given]
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        return given
    # In decimals: 0.07 mm are 70 um, not 70.00000000000001.
    return float(Decimal(str(given)).scaleb(power))
