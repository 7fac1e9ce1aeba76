"""Ties: expressions of numbers, parameter names, + - * / ** and brackets, of limited size."""

import ast
import functools
import math
import operator
import re
from collections.abc import Callable, Collection, Mapping
from numbers import Complex, Real
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample.hints import unknown_key

_MOST_CHARACTERS = 1000
_MOST_OPERATIONS = 100
_LARGEST_EXPONENT = 100

_NUMBER = r"(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])"
_WORD = r"[^\W\d]\w*(?!\w)"
_STEM = rf"{_WORD}(?:\s*\.\s*{_WORD})*"
# A value at one wavelength, as in ink.scattering_per_mm@550.
_AT = r"@(\d+(?:\.\d+)?)(?![\w.])"
_NAME = rf"{_STEM}(?:{_AT})?"
# Anything else is rejected before Python's parser sees it, because that warns about some of it.
_LANGUAGE = re.compile(rf"(?:\s|[-+*/()]|{_NUMBER}|{_NAME})*")
_NUMBER_OR_NAME = re.compile(rf"{_NUMBER}|(?P<stem>{_STEM})(?P<at>{_AT})?")
# To Python, @ is an operator; within a dotted name it becomes one more word.
_AT_WORD = re.compile(r"at_(\d+)(?:_(\d+))?")


class _UnfitError(Exception):
    """An invalid tie; the message continues a sentence that begins with the tie."""


def evaluate_tie(expression: str, values: Mapping[str, Any]) -> Any:
    """Value of an expression such as ``2 * ink.radius_nm``: a finite real number, unless it is traced.

    Parameters
    ----------
    expression
        Numbers, parameter names, + - * / ** and brackets only. The name of a value at one wavelength ends
        with it, as in ``ink.scattering_per_mm@550``.
    values
        Values by name, possibly traced.

    Raises
    ------
    InputRefusedError
        If the expression contains anything else, is too long, names an unknown parameter, or its value is not
        a finite real number.
    """
    try:
        return _value(_parsed(expression), values)
    except _UnfitError as problem:
        text = str(problem)
    except ZeroDivisionError:
        text = "divides by zero at the values of the file."
    except OverflowError:
        text = _NOT_FINITE
    raise InputRefusedError(f"the tie '{expression}' {text}") from None


def names_in(expression: str) -> set[str]:
    """All dotted names of an expression for `evaluate_tie`, and their stems."""
    try:
        tree = _parsed(expression)
    except _UnfitError as problem:
        raise InputRefusedError(f"the tie '{expression}' {problem}") from None
    return {name for node in ast.walk(tree) if (name := _dotted_name(node)) is not None}


def whole_names(expression: str) -> set[str]:
    """Dotted names of an expression without their stems, and without the wavelength of a value at one."""
    found = (match["stem"] for match in _NUMBER_OR_NAME.finditer(expression))
    return {"".join(stem.split()) for stem in found if stem is not None}


def at_wavelength(expression: str, wavelength_nm: float, names: Collection[str]) -> str:
    """The expression with the values at a wavelength of those parameters that have them.

    Parameters
    ----------
    expression
        A tie of a value at this wavelength.
    wavelength_nm
        The wavelength.
    names
        Names of all parameters.
    """
    at = f"@{wavelength_nm:g}"

    def named(found: re.Match) -> str:
        stem = found["stem"]
        if stem is None or found["at"] is not None or "".join(stem.split()) + at not in names:
            return found[0]
        return "".join(stem.split()) + at

    return _NUMBER_OR_NAME.sub(named, expression)


_NOT_FINITE = "does not give a finite real number at the values of the file."
_FOREIGN = "may contain only numbers, parameter names, + - * / ** and brackets."


@functools.lru_cache(maxsize=1024)
def _parsed(expression: str) -> ast.expr:
    if len(expression) > _MOST_CHARACTERS:
        raise _UnfitError(f"has {len(expression)} characters; at most {_MOST_CHARACTERS} are allowed.")
    if not _LANGUAGE.fullmatch(expression):
        raise _UnfitError(_FOREIGN)
    try:
        tree = ast.parse(re.sub(_AT, _as_word, expression.strip()), mode="eval").body
    except (SyntaxError, RecursionError, MemoryError):
        raise _UnfitError("is not a valid expression.") from None
    n_operations = sum(isinstance(node, ast.BinOp | ast.UnaryOp) for node in ast.walk(tree))
    if n_operations > _MOST_OPERATIONS:
        raise _UnfitError(f"has {n_operations} operations; at most {_MOST_OPERATIONS} are allowed.")
    return tree


def _value(node: ast.expr, values: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        value = node.value
    elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        value = _OPERATORS[type(node.op)](_value(node.left, values), _value(node.right, values))
    elif isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        value = _OPERATORS[type(node.op)](_value(node.operand, values))
    else:
        name = _dotted_name(node)
        if name is None:
            raise _UnfitError(_FOREIGN)
        if name not in values:
            raise _UnfitError(f"names {name}, {unknown_key(name, values)}")
        value = values[name]
    if not isinstance(value, Complex):
        return value
    # Python floats raise errors, whereas NumPy's warn and integers grow without limit.
    if not isinstance(value, Real) or not math.isfinite(value := float(value)):
        raise _UnfitError(_NOT_FINITE)
    return value


def _power(base: Any, exponent: Any) -> Any:
    if isinstance(exponent, float):
        if abs(exponent) > _LARGEST_EXPONENT:
            raise _UnfitError(
                f"has the exponent {exponent:g}; it must be between -{_LARGEST_EXPONENT} and "
                f"{_LARGEST_EXPONENT}."
            )
        # Integer powers of traced values are products, which are differentiable at 0 and below.
        if exponent.is_integer() and not isinstance(base, float):
            exponent = int(exponent)
    return base**exponent


_OPERATORS: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: _power,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


def _dotted_name(node: ast.AST) -> str | None:
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        stem = _dotted_name(node.value)
        if stem is None:
            return None
        at = _AT_WORD.fullmatch(node.attr)
        return f"{stem}.{node.attr}" if at is None else f"{stem}@{'.'.join(filter(None, at.groups()))}"
    return None


def _as_word(at: re.Match) -> str:
    return f".at_{at[1].replace('.', '_')}"
