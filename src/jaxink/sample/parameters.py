"""The flat table of parameters: value, free or fixed, range, unit, tie, prior."""

import ast
import dataclasses
import difflib
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError, require_number, require_one_of

SCALES = ("linear", "log", "one_minus")


@dataclasses.dataclass(frozen=True)
class Prior:
    """Gaussian knowledge of a parameter from elsewhere.

    Parameters
    ----------
    mean, standard_deviation
        In the parameter's own unit.
    """

    mean: float
    standard_deviation: float


@dataclasses.dataclass(frozen=True)
class Parameter:
    """One number of the model.

    Parameters
    ----------
    name
        Dotted name, ``layer.quantity``, or ``layer.quantity@wavelength`` where each wavelength has its own.
    value
        Fixed value, or the start of a fit.
    free
        Whether a fit may change it.
    minimum, maximum
        Range of a free parameter.
    unit
        Unit, empty for a pure number.
    tie
        Expression of other parameters that gives the value, or None.
    prior
        Knowledge from elsewhere, or None.
    scale
        How a fit divides the range between minimum and maximum: ``linear``, ``log`` (equal ratios), or
        ``one_minus`` (equal ratios of the distance to 1). Scattering and 1 - g act as a product: on these
        scales the valley between them is straight, and a fit takes it in a few steps.
    multimodal
        Whether the misfit has many minima along it, as along the radius of a sphere with its resonances: a
        fit then scans the range first.

    Raises
    ------
    InputRefusedError
        If value or range are not numbers, the range is empty, or there is no such scale.
    """

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

    def __post_init__(self):
        # What is tied has no value of its own.
        for quantity in ("value", "minimum", "maximum")[self.tie is not None :]:
            require_number(f"{quantity} of {self.name}", getattr(self, quantity))
        if not self.minimum <= self.maximum:
            raise InputRefusedError(
                f"the range of {self.name}, {self.minimum:g} to {self.maximum:g}, is empty; "
                "minimum must not be above maximum."
            )
        require_one_of(f"scale of {self.name}", self.scale, SCALES)

    @property
    def is_fixed(self) -> bool:
        """Whether neither a fit nor another parameter changes it."""
        return not self.free and self.tie is None


_OPERATORS: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


def _dotted_name(node: ast.AST) -> str | None:
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        stem = _dotted_name(node.value)
        return None if stem is None else f"{stem}.{node.attr}"
    return None


def evaluate_tie(expression: str, values: Mapping[str, Any]) -> Any:
    """Value of an expression of parameters; numbers, names, + - * / ** and brackets only.

    Parameters
    ----------
    expression
        Such as ``2 * ink.radius_nm``.
    values
        Values by name; traced ones are welcome.

    Returns
    -------
    Any
        The value.

    Raises
    ------
    InputRefusedError
        For anything else in the expression, or a name that does not exist.
    """

    def visit(node):
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return node.value
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](visit(node.left), visit(node.right))
        if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](visit(node.operand))
        name = _dotted_name(node)
        if name is None:
            raise InputRefusedError(
                f"the tie '{expression}' may hold numbers, parameter names, + - * / ** and brackets only."
            )
        if name not in values:
            raise InputRefusedError(f"the tie '{expression}' names {name}, {unknown_name(name, values)}")
        return values[name]

    try:
        tree = ast.parse(expression, mode="eval")
    except SyntaxError:
        raise InputRefusedError(f"the tie '{expression}' is not an expression.") from None
    try:
        return visit(tree.body)
    except ZeroDivisionError:
        raise InputRefusedError(
            f"the tie '{expression}' divides by zero with the values of the file."
        ) from None


def unknown_name(name: str, known) -> str:
    """End of a sentence about a name that does not exist, with the nearest that does."""
    near = difflib.get_close_matches(name, list(known), n=1)
    hint = f"; did you mean {near[0]}?" if near else f"; known are: {', '.join(known)}."
    return f"which does not exist{hint}"


class ParameterTable(Mapping[str, Parameter]):
    """Ordered, immutable table of parameters by name.

    Parameters
    ----------
    parameters
        The parameters; names must differ, and ties must not form a circle.

    Raises
    ------
    InputRefusedError
        For a tie that cannot be evaluated.
    """

    def __init__(self, parameters: list[Parameter] | tuple[Parameter, ...]):
        self._by_name = {parameter.name: parameter for parameter in parameters}
        values = self.values_with({})
        for name, parameter in self._by_name.items():
            tied = parameter.tie is not None
            if tied and not parameter.minimum <= values[name] <= parameter.maximum:
                raise InputRefusedError(
                    f"the tie of {name}, '{parameter.tie}', gives {values[name]:g}; it must lie between "
                    f"{parameter.minimum:g} and {parameter.maximum:g}."
                )

    def __getitem__(self, name: str) -> Parameter:
        return self._by_name[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self._by_name)

    def __eq__(self, other) -> bool:
        return isinstance(other, ParameterTable) and tuple(self.values()) == tuple(other.values())

    def __hash__(self) -> int:
        return hash(tuple(self.values()))

    @property
    def free(self) -> tuple[Parameter, ...]:
        """The free parameters, in order."""
        return tuple(p for p in self._by_name.values() if p.free)

    def require_ranges(self) -> None:
        """Refuse a table with a value outside its range; rounding counts as inside.

        Raises
        ------
        InputRefusedError
            Names the first such parameter.
        """
        for p in self._by_name.values():
            inside = p.minimum <= p.value <= p.maximum
            if p.tie is None and not (inside or np.isclose(p.value, (p.minimum, p.maximum), 1e-9, 0).any()):
                raise InputRefusedError(
                    f"{p.name} is {p.value:g}; it must lie between {p.minimum:g} and {p.maximum:g}."
                )

    def values_with(self, free_values: Mapping[str, Any]) -> dict[str, Any]:
        """Values of all parameters, ties evaluated.

        Parameters
        ----------
        free_values
            Values by name that replace those of the table; traced ones are welcome.

        Returns
        -------
        dict[str, Any]
            Value of every parameter.

        Raises
        ------
        InputRefusedError
            For a name that does not exist, or ties that form a circle.
        """
        for name in free_values:
            if name not in self._by_name:
                raise InputRefusedError(f"a value is given for {name}, {unknown_name(name, self)}")
        values = {
            name: free_values.get(name, parameter.value)
            for name, parameter in self._by_name.items()
            if parameter.tie is None
        }
        waiting = {p.name: p.tie for p in self._by_name.values() if p.tie is not None}
        while waiting:
            ready = [name for name, tie in waiting.items() if not _names(tie) & set(waiting)]
            if not ready:
                raise InputRefusedError(f"the ties of {', '.join(waiting)} refer to each other in a circle.")
            for name in ready:
                values[name] = evaluate_tie(waiting.pop(name), values)
        return {name: values[name] for name in self._by_name}

    def replace(self, name: str, **changes: Any) -> "ParameterTable":
        """Table with one parameter changed.

        Parameters
        ----------
        name
            Its name.
        **changes
            Fields of `Parameter` to replace.

        Returns
        -------
        ParameterTable

        Raises
        ------
        InputRefusedError
            For a name that does not exist.
        """
        if name not in self._by_name:
            raise InputRefusedError(f"parameter {name}, {unknown_name(name, self)}")
        return ParameterTable(
            [dataclasses.replace(p, **changes) if p.name == name else p for p in self._by_name.values()]
        )


def _names(expression: str) -> set[str]:
    """All dotted names of an expression, and their stems."""
    try:
        tree = ast.parse(expression, mode="eval")
    except SyntaxError:
        raise InputRefusedError(f"the tie '{expression}' is not an expression.") from None
    return {name for node in ast.walk(tree) if (name := _dotted_name(node)) is not None}
