"""Reading the light, instrument, noise and masks of a sample file."""

import itertools
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample import measurement_schema as schema
from jaxink.sample.description import Noise
from jaxink.sample.entries import (
    bounded,
    choice,
    is_list_of_numbers,
    is_number,
    only,
    table_of,
    true_or_false,
)
from jaxink.sample.parameter_reading import ParameterReader
from jaxink.sample.schema import Quantity

Illumination = tuple[tuple[float, ...], tuple[float, ...]]


def read_wavelengths(document: dict[str, Any]) -> tuple[float, ...]:
    """Wavelengths of the file in nm, ascending; empty if there are none."""
    given = document.get("wavelength_nm", [])
    given = given if isinstance(given, list) else [given]
    lowest, highest = schema.WAVELENGTH_NM.lowest, schema.WAVELENGTH_NM.highest
    if not all(is_number(w) and lowest <= w <= highest for w in given):
        raise InputRefusedError(
            f"wavelength_nm is {given}; it must be a number or a list of numbers between {lowest:g} and "
            f"{highest:g}, in nanometres."
        )
    # Names of parameters distinguish wavelengths by six digits.
    if len({f"{w:g}" for w in given}) != len(given):
        raise InputRefusedError(f"wavelength_nm is {given}; the wavelengths must differ within six digits.")
    return tuple(sorted(float(w) for w in given))


def read_instrument(document: dict[str, Any], numbers: ParameterReader) -> dict[str, Any]:
    """Fields of `Sample` that describe the instrument and its light.

    Diameters that are given as tables, to be free or tied, become parameters.
    """
    table = table_of(document, "instrument")
    only(table, schema.INSTRUMENT | schema.LIGHT_ENTRIES, "[instrument]")
    diameters = {key: schema.INSTRUMENT[key] for key in schema.DIAMETERS if isinstance(table.get(key), dict)}
    numbers.read("instrument", diameters, table)
    # Models take the parameters; the field only says that there is a diameter.
    settings = _numbers(table | dict.fromkeys(diameters, 1.0), schema.INSTRUMENT, "instrument")
    mode = table.get("detector_mode")
    if mode is not None:
        choice(table, "detector_mode", schema.DETECTOR_MODES, "[instrument]")
    illumination = _illumination(table.get("illumination"))
    if (settings["beam_diameter_mm"] is None) != (settings["detector_diameter_mm"] is None):
        raise InputRefusedError(
            "[instrument] has only one of beam_diameter_mm and detector_diameter_mm; give both, or neither "
            "if the detector collects all light."
        )
    return settings | {"detector_mode": mode, "illumination": illumination}


def _illumination(given: Any) -> Illumination | None:
    if given is None:
        return None
    if not isinstance(given, dict) or set(given) != set(schema.ILLUMINATION):
        raise InputRefusedError("instrument.illumination must be { wavelength_nm = [...], power = [...] }.")
    waves, power = (given[key] for key in schema.ILLUMINATION)
    lists = is_list_of_numbers(waves, 2) and is_list_of_numbers(power) and len(waves) == len(power)
    if not lists or min(*waves, *power) < 0:
        raise InputRefusedError(
            "instrument.illumination: wavelength_nm and power must be two equally long lists of at least two "
            "numbers, none negative."
        )
    if any(b <= a for a, b in itertools.pairwise(waves)):
        raise InputRefusedError("instrument.illumination: wavelength_nm must be in ascending order.")
    return tuple(map(float, waves)), tuple(map(float, power))


def read_noise(document: dict[str, Any]) -> Noise:
    """Declared noise."""
    table = table_of(document, "noise")
    only(table, schema.NOISE | schema.NOISE_ENTRIES, "[noise]")
    use = true_or_false(table, "use_file_sigma", True, "noise.use_file_sigma")
    return Noise(**_numbers(table, schema.NOISE, "noise"), use_file_sigma=use)


def read_masks(document: dict[str, Any]) -> tuple[tuple[str, float], ...]:
    """Limits of the masks by key."""
    table = table_of(document, "masks")
    only(table, schema.MASKS, "[masks]")
    return tuple(_numbers(table, schema.MASKS, "masks").items())


def _numbers(table: dict[str, Any], quantities: dict[str, Quantity], where: str) -> dict[str, Any]:
    """Plain numbers; None if the key is absent and has no default."""
    given = {key: table.get(key, quantity.default) for key, quantity in quantities.items()}
    return {
        key: None if value is None else bounded(value, quantities[key], f"{where}.{key}")
        for key, value in given.items()
    }
