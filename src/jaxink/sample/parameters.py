"""The table of parameters: value, free or fixed, range, unit, tie, prior."""

import dataclasses
import graphlib
import math
import operator
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.display.card import CardTable
from jaxink.display.named_rows import NamedRows
from jaxink.errors import InputRefusedError, require_by_name, require_kind, require_number, require_one_of
from jaxink.sample.hints import unknown_key
from jaxink.sample.ties import evaluate_tie, names_in

SCALES = ("linear", "log", "one_minus")


@dataclasses.dataclass(frozen=True)
class Prior:
    """Independent, Gaussian knowledge of a parameter.

    Parameters
    ----------
    mean, standard_deviation
        In the unit of the parameter.
    """

    mean: float
    standard_deviation: float


@dataclasses.dataclass(frozen=True)
class Smoothness:
    """Knowledge of how fast a quantity changes with wavelength: a random walk.

    Values at two neighbouring wavelengths differ by a normally distributed number with the standard deviation
    ``change * sqrt(distance / over_nm)``.

    Parameters
    ----------
    change
        In the unit of the parameter.
    over_nm
        Distance of wavelengths to which it refers, nm.
    """

    change: float
    over_nm: float


@dataclasses.dataclass(frozen=True, eq=False)
class Parameter:
    """One number of the model.

    Parameters
    ----------
    name
        Dotted name, ``layer.quantity``, or ``layer.quantity@wavelength`` if it depends on the wavelength.
    value
        Fixed value, or start of a fit.
    free
        Whether a fit may change it.
    minimum, maximum
        Range of a free parameter.
    unit
        Unit, empty for a pure number.
    tie
        Expression of other parameters that determines the value, or None.
    prior
        Independent knowledge, or None.
    scale
        How a fit divides the range between minimum and maximum: ``linear``, ``log`` (equal ratios), or
        ``one_minus`` (equal ratios of the distance to 1). Scattering and 1 - g act as a product; on these
        scales the valley of the misfit is straight, and a fit follows it in a few steps.
    multimodal
        Whether the misfit may have many minima along it, as along the radius of a sphere with resonances; a
        fit then scans the range first.
    shape
        Of a mean over the wavelengths of the file: the ratios of the values at them, in ascending order; else
        empty. The values themselves are parameters ``name@wavelength`` that are tied to it.
    smoothness
        Of a value at one wavelength: how far it may be from those at the neighbouring ones, or None.

    Raises
    ------
    InputRefusedError
        If value or range are not numbers, the tie is not a string, the range is empty, or the scale unknown.
    """

    __repr__ = brief_repr

    name: str
    value: float
    free: bool = False
    minimum: float = -math.inf
    maximum: float = math.inf
    unit: str = ""
    tie: str | None = None
    prior: Prior | None = None
    scale: str = "linear"
    multimodal: bool = False
    shape: tuple[float, ...] = ()
    smoothness: Smoothness | None = None

    def __post_init__(self):
        if self.tie is not None:
            require_kind(f"tie of {self.name}", self.tie, str)
        # The value of a tied parameter is not used.
        for quantity in ("value", "minimum", "maximum")[self.tie is not None :]:
            require_number(f"{quantity} of {self.name}", getattr(self, quantity))
        if not self.minimum <= self.maximum:
            raise InputRefusedError(
                f"the range of {self.name} is {self.minimum:g} to {self.maximum:g}; minimum must not exceed "
                "maximum."
            )
        require_one_of(f"scale of {self.name}", self.scale, SCALES)

    def __eq__(self, other: object) -> bool:
        """Whether all is the same, except for the value of a tied parameter, which is not a number."""
        return self._identity == other._identity if isinstance(other, Parameter) else NotImplemented

    def __hash__(self) -> int:
        """By all except for the value of a tied parameter."""
        return hash(self._identity)

    @property
    def _identity(self) -> tuple:
        return None if self.tie is not None else self.value, _ALL_BUT_VALUE(self)

    @property
    def is_fixed(self) -> bool:
        """Whether it is neither free nor tied."""
        return not self.free and self.tie is None


_ALL_BUT_VALUE = operator.attrgetter(*(f.name for f in dataclasses.fields(Parameter) if f.name != "value"))


class ParameterTable(NamedRows[Parameter]):
    """Ordered, immutable table of parameters by name.

    Parameters
    ----------
    parameters
        The parameters; names must differ, and ties must not be circular.

    Raises
    ------
    InputRefusedError
        If a tie cannot be evaluated, or ties are circular.
    """

    def __init__(self, parameters: list[Parameter] | tuple[Parameter, ...]):
        super().__init__({parameter.name: parameter for parameter in parameters})
        self._order_of_ties = _order_of_ties({p.name: p.tie for p in parameters if p.tie is not None})
        values = self.values_with({})
        for name, parameter in self._by_name.items():
            tied = parameter.tie is not None
            if tied and not parameter.minimum <= values[name] <= parameter.maximum:
                raise InputRefusedError(
                    f"the tie of {name}, '{parameter.tie}', gives {values[name]:g}; it must be between "
                    f"{parameter.minimum:g} and {parameter.maximum:g}."
                )

    def __eq__(self, other) -> bool:
        return isinstance(other, ParameterTable) and tuple(self.values()) == tuple(other.values())

    def __hash__(self) -> int:
        return hash(tuple(self.values()))

    @property
    def free(self) -> tuple[Parameter, ...]:
        """The free parameters, in order."""
        return tuple(p for p in self._by_name.values() if p.free)

    def table(self) -> CardTable:
        """Value, unit, range if free, and tie or prior."""
        rows = []
        for p in self.values():
            ends = (f"{p.minimum:g}", f"{p.maximum:g}") if p.free else ("", "")
            remark = "" if p.free else "fixed" if p.tie is None else f"tied: {p.tie}"
            if p.prior is not None:
                remark = f"prior {p.prior.mean:g} +- {p.prior.standard_deviation:g}"
            value = p.value if p.tie is None else self.values_with({})[p.name]
            rows.append([p.name, f"{value:.6g}", p.unit, "free" if p.free else "", *ends, remark])
        heads = ["parameter", "value", "unit", "free", "minimum", "maximum", "remark"]
        return CardTable(heads, rows, (0, 2, 3, 6))

    def require_ranges(self) -> None:
        """Reject a table with a value outside its range by more than rounding."""
        for p in self._by_name.values():
            inside = p.minimum <= p.value <= p.maximum
            if p.tie is None and not (inside or np.isclose(p.value, (p.minimum, p.maximum), 1e-9, 0).any()):
                raise InputRefusedError(
                    f"{p.name} is {p.value:g}; it must lie between {p.minimum:g} and {p.maximum:g}."
                )

    @property
    def untied(self) -> dict[str, float]:
        """Value by name of each parameter without a tie: those from which all others follow."""
        return {name: p.value for name, p in self._by_name.items() if p.tie is None}

    def values_with(self, free_values: Mapping[str, Any]) -> dict[str, Any]:
        """Values of all parameters, with ties evaluated.

        Parameters
        ----------
        free_values
            Values by name, possibly traced, that replace those of the table.

        Raises
        ------
        InputRefusedError
            If the values are not given by name, a name does not exist, or a tie does not give a number.
        """
        shown = {p.name: p.value for p in self.free or self.values()}
        require_by_name("what gives the values", free_values, shown)
        for name in free_values:
            if name not in self._by_name:
                raise InputRefusedError(f"a value is given for {name}, {unknown_key(name, self)}")
        values = {
            name: free_values.get(name, parameter.value)
            for name, parameter in self._by_name.items()
            if parameter.tie is None
        }
        for name in self._order_of_ties:
            values[name] = _told(name, evaluate_tie, self._by_name[name].tie, values)
        return {name: values[name] for name in self._by_name}

    def tied_to(self, name: str) -> frozenset[str]:
        """Names of the parameters that the tie of a parameter uses; none if it has no tie."""
        tie = self[name].tie
        return frozenset() if tie is None else frozenset(names_in(tie) & self._by_name.keys())

    def source(self, name: str) -> str:
        """Name of the parameter that one equals by its tie or a chain of ties; its own name without a tie."""
        tie = self[name].tie if name in self else None
        return name if tie is None or tie not in self else self.source(tie)

    def without_values(self, names: Collection[str]) -> "ParameterTable":
        """The table without the values of some parameters, and without ranges; no parameter is free.

        These values are infinite, so that none is used by mistake, but for those that ties need. They are 1,
        or their own if a tie has no value at 1.

        Parameters
        ----------
        names
            Parameters whose values will always be given.
        """
        needed = {name for p in self.values() if p.tie is not None for name in names_in(p.tie)}

        def table(ones):
            def value(p):
                if p.name not in names or (p.name in needed and not ones):
                    return p.value
                return 1.0 if p.name in needed else math.inf

            return ParameterTable([Parameter(p.name, value(p), tie=p.tie) for p in self.values()])

        try:
            return table(ones=True)
        except InputRefusedError:
            return table(ones=False)

    def at(self, values: Mapping[str, float]) -> "ParameterTable":
        """Table with other values of some parameters, whatever their ranges."""
        for name in values:
            if name not in self._by_name:
                raise InputRefusedError(f"parameter {name}, {unknown_key(name, self)}")
        return ParameterTable(
            [
                dataclasses.replace(p, value=values[p.name]) if p.name in values else p
                for p in self._by_name.values()
            ]
        )

    def replace(self, name: str, **changes: Any) -> "ParameterTable":
        """Table with some fields of one `Parameter` replaced."""
        if name not in self._by_name:
            raise InputRefusedError(f"parameter {name}, {unknown_key(name, self)}")
        return ParameterTable(
            [dataclasses.replace(p, **changes) if p.name == name else p for p in self._by_name.values()]
        )


def _order_of_ties(ties: Mapping[str, str]) -> tuple[str, ...]:
    """Names of the tied parameters, each after those that its tie uses."""
    needed = {name: _told(name, names_in, tie) & ties.keys() for name, tie in ties.items()}
    try:
        return tuple(graphlib.TopologicalSorter(needed).static_order())
    except graphlib.CycleError as problem:
        circle = ", ".join(dict.fromkeys(problem.args[1]))
        raise InputRefusedError(f"the ties of {circle} are circular; remove one of them.") from None


def _told(name: str, function: Callable, *arguments: Any) -> Any:
    """Result of a function of a tie; error messages also name the parameter."""
    try:
        return function(*arguments)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{name}: {problem}") from None
