"""Quantities against the wavelength in vacuum: indices by formula or table, coefficients by a law.

The formulae accept numbers, arrays and traced values alike, and are differentiable.
"""

import dataclasses
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.sample import schema
from jaxink.sample.entries import (
    choice,
    is_list_of_numbers,
    missing,
    only,
    parameter_entry,
    parameter_of,
    require_equally_many,
)
from jaxink.sample.parameters import Parameter, ParameterTable
from jaxink.sample.schema import Quantity


@dataclasses.dataclass(frozen=True)
class Dispersion:
    """A quantity as a function of wavelength; its coefficients are parameters ``name.coefficient``.

    Parameters
    ----------
    name
        Name of the quantity, such as ``ink.refractive_index``.
    formula
        A key of `schema.DISPERSIONS`, or of `schema.LAWS`.
    lowest, highest
        Range of the quantity.
    wavelength_nm, value
        The table, by ascending wavelength, if there is one.
    """

    __repr__ = brief_repr

    name: str
    formula: str
    lowest: float
    highest: float
    wavelength_nm: tuple[float, ...] = ()
    value: tuple[float, ...] = ()

    @property
    def coefficients(self) -> dict[str, Quantity]:
        """Those of the formula, by their keys."""
        return (schema.DISPERSIONS | schema.LAWS)[self.formula]

    def at(self, values: Mapping[str, Any], wavelength_nm: float) -> Any:
        """The quantity at a vacuum wavelength (not traced), from parameter values (possibly traced)."""
        get = {key: values[f"{self.name}.{key}"] for key in self.coefficients}
        if self.formula == "power":
            return power_law(wavelength_nm, get["at_reference"], get["reference_nm"], get["exponent"])
        if self.formula == "exponential":
            return exponential_law(wavelength_nm, get["at_reference"], get["reference_nm"], get["decay_nm"])
        if self.formula == "cauchy":
            return cauchy_index(wavelength_nm, get["a"], get["b_um2"], get["c_um4"])
        if self.formula == "sellmeier":
            return sellmeier_index(
                wavelength_nm,
                (get["b1"], get["b2"], get["b3"]),
                (get["c1_um2"], get["c2_um2"], get["c3_um2"]),
            )
        return tabulated_index(wavelength_nm, self.wavelength_nm, self.value) + get["offset"]

    def check(self, table: ParameterTable, wavelengths_nm: tuple[float, ...]) -> None:
        """Reject a formula with an invalid value at some wavelength, at the start or within a fit."""
        names = [f"{self.name}.{key}" for key in self.coefficients]
        free = [table[name] for name in names if table[name].free]
        for wavelength in wavelengths_nm:
            if self.formula == "table" and not self.wavelength_nm[0] <= wavelength <= self.wavelength_nm[-1]:
                raise InputRefusedError(
                    f"{self.name} is given from {self.wavelength_nm[0]:g} to {self.wavelength_nm[-1]:g} nm, "
                    f"but is needed at {wavelength:g} nm; extend the table to all wavelengths in use."
                )
            if self.formula == "sellmeier":
                self._check_resonances(table, wavelength)
            # The formulas are monotonic in each coefficient: their extremes are at the ends of the ranges.
            for ends in itertools.product(*((p.minimum, p.maximum) for p in free)):
                corner = {p.name: end for p, end in zip(free, ends, strict=True)}
                self._check_range(table.values_with(corner), wavelength, names)

    def _check_resonances(self, table: ParameterTable, wavelength: float) -> None:
        """Reject a resonance at the wavelength, or one that a fit could move across it."""
        start, square = table.values_with({}), (wavelength / 1000) ** 2
        for key in ("c1_um2", "c2_um2", "c3_um2"):
            name = f"{self.name}.{key}"
            parameter = table[name]
            ends = (parameter.minimum, parameter.maximum) if parameter.free else (start[name], start[name])
            if ends[0] <= square <= ends[1]:
                raise InputRefusedError(
                    f"{name} may become {square:g} um^2, which puts a resonance at the wavelength "
                    f"{wavelength:g} nm; keep its value and range on one side of that."
                )

    def _check_range(self, values, wavelength, names):
        value = self.at(values, wavelength)
        if isinstance(value, complex) or not self.lowest <= value <= self.highest:
            said = "no real index" if isinstance(value, complex) else f"{value:g}"
            given = ", ".join(f"{name.rsplit('.', 1)[1]} = {values[name]:g}" for name in names)
            raise InputRefusedError(
                f"{self.name} gives {said} at {wavelength:g} nm with {given}; it must lie between "
                f"{self.lowest:g} and {self.highest:g}; change the coefficients or narrow their ranges."
            )


def read_dispersion(
    name: str, given: dict[str, Any], quantity: Quantity
) -> tuple[Dispersion, list[Parameter]]:
    """Formula and coefficients of the quantity ``name`` from its table in the file."""
    if "law" in given:
        if not quantity.has_law:
            raise InputRefusedError(
                f"{name} has a law, which only scattering and absorption coefficients of layers, and "
                "absorption indices of particles, may have; give a number, or one for each wavelength with "
                "per_wavelength."
            )
        kind, what, formulas = "law", "value", schema.LAWS
    else:
        if not quantity.dispersive:
            instead = "law = " + " or ".join(f'"{law}"' for law in schema.LAWS) if quantity.has_law else ""
            raise InputRefusedError(
                f"{name} has a dispersion, which only refractive indices may have; give a number, "
                f"{instead and instead + ', '}or one for each wavelength with per_wavelength."
            )
        kind, what, formulas = "dispersion", "index", schema.DISPERSIONS
    formula = choice(given, kind, tuple(formulas), name)
    coefficients = {
        k: dataclasses.replace(q, unit=quantity.unit) if k == "at_reference" else q
        for k, q in formulas[formula].items()
    }
    columns = schema.DISPERSION_TABLE if formula == "table" else {}
    only(given, (kind, *columns, *coefficients), name)
    parameters = []
    for key, coefficient in coefficients.items():
        each, value = f"{name}.{key}", given.get(key, coefficient.default)
        if value is None:
            raise missing(each, key, coefficient)
        entry = parameter_entry(value, each, coefficient)
        by_wavelength = next((k for k in ("per_wavelength", "shape", "smoothness") if k in entry), None)
        if by_wavelength is not None:
            raise InputRefusedError(
                f"{each} has {by_wavelength}, but the {kind} already gives the {what} at each wavelength; "
                "remove it."
            )
        if key == "reference_nm" and entry.get("free"):
            raise InputRefusedError(
                f"{each} is free, but moving the reference does nothing that at_reference does not; fix it."
            )
        parameters.append(parameter_of(each, entry, coefficient))
    wavelengths, values = _columns(name, given) if columns else ((), ())
    return Dispersion(name, formula, quantity.lowest, quantity.highest, wavelengths, values), parameters


def _columns(name: str, given: dict[str, Any]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Wavelengths and indices of a table."""
    wavelengths, values = (given.get(key, []) for key in schema.DISPERSION_TABLE)
    for key, column in zip(schema.DISPERSION_TABLE, (wavelengths, values), strict=True):
        if not is_list_of_numbers(column, 2):
            raise InputRefusedError(f"{name}: {key} must be a list of at least two numbers.")
    require_equally_many(name, wavelength_nm=wavelengths, value=values)
    if wavelengths[0] <= 0 or any(b <= a for a, b in itertools.pairwise(wavelengths)):
        raise InputRefusedError(f"{name}: wavelength_nm must be positive and in ascending order.")
    return tuple(map(float, wavelengths)), tuple(map(float, values))


def power_law(wavelength_nm, at_reference, reference_nm, exponent):
    """Power of the wavelength, v (wavelength / reference)^-b, as of scattering by particles of many sizes.

    Parameters
    ----------
    wavelength_nm, reference_nm
        Wavelengths in vacuum.
    at_reference
        v, the value at the reference.
    exponent
        b.
    """
    return at_reference * (reference_nm / wavelength_nm) ** exponent


def exponential_law(wavelength_nm, at_reference, reference_nm, decay_nm):
    """Exponential of the wavelength, v exp((reference - wavelength) / d), as at the edge of a band.

    Parameters
    ----------
    wavelength_nm, reference_nm
        Wavelengths in vacuum.
    at_reference
        v, the value at the reference.
    decay_nm
        d, the distance over which the value falls by e.
    """
    return at_reference * math.e ** ((reference_nm - wavelength_nm) / decay_nm)


def cauchy_index(wavelength_nm, a, b_um2=0.0, c_um4=0.0):
    """Cauchy's formula, n = a + b / wavelength^2 + c / wavelength^4.

    Parameters
    ----------
    wavelength_nm
        Wavelength in vacuum.
    a, b_um2, c_um4
        Coefficients, for wavelengths in micrometres.
    """
    inverse_square = (1000 / wavelength_nm) ** 2
    return a + inverse_square * (b_um2 + c_um4 * inverse_square)


def sellmeier_index(wavelength_nm, strengths: Iterable, resonances_um2: Iterable):
    """Sellmeier's formula, n^2 = 1 + sum of B wavelength^2 / (wavelength^2 - C).

    Parameters
    ----------
    wavelength_nm
        Wavelength in vacuum, away from every resonance.
    strengths, resonances_um2
        B and C of each resonance, for wavelengths in micrometres.
    """
    square = (wavelength_nm / 1000) ** 2
    terms = (b * square / (square - c) for b, c in zip(strengths, resonances_um2, strict=True))
    return (1 + sum(terms)) ** 0.5


def tabulated_index(wavelength_nm: float, table_wavelength_nm: Sequence, table_index: Sequence) -> float:
    """Refractive index from a table, linear in 1 / wavelength^2 like Cauchy's formula with two terms.

    Parameters
    ----------
    wavelength_nm
        Wavelength in vacuum, a known number.
    table_wavelength_nm, table_index
        The table, by ascending wavelength.

    Raises
    ------
    InputRefusedError
        If the wavelength is outside the table.
    """
    lowest, highest = min(table_wavelength_nm), max(table_wavelength_nm)
    if not lowest <= wavelength_nm <= highest:
        raise InputRefusedError(
            f"an index table extends from {lowest:g} to {highest:g} nm, but {wavelength_nm:g} nm is needed; "
            "give a table that covers every wavelength."
        )
    # Interpolation needs ascending abscissae, hence descending wavelengths.
    inverse = [1 / w**2 for w in reversed(table_wavelength_nm)]
    return float(np.interp(1 / wavelength_nm**2, inverse, list(reversed(table_index))))
