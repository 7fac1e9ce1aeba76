"""Weights of residuals: which points of a measurement count how many times in a fit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.sample import measurement_schema as schema
from jaxink.sample.entries import bounded, is_list_of_numbers, only

# Angles and wavelengths of files are printed with fewer digits.
_SAME = 1e-6


@dataclass(frozen=True)
class ResidualWeight:
    """A factor of the squared residuals of some points; None chooses all.

    Parameters
    ----------
    weight
        The factor.
    theta_i_deg
        Incidence of the points, deg.
    side
        ``R`` or ``T``.
    theta_o_deg, wavelength_nm
        Lowest and highest polar angle of view, deg, and wavelength, nm, both included.
    column
        Extra column of the measurement with a further factor for each point.
    """

    __repr__ = brief_repr

    weight: float
    theta_i_deg: float | None = None
    side: str | None = None
    theta_o_deg: tuple[float, float] | None = None
    wavelength_nm: tuple[float, float] | None = None
    column: str | None = None

    @property
    def differs_within_scans(self) -> bool:
        """Whether points of one scan may have different weights."""
        return self.theta_o_deg is not None or self.column is not None

    def chosen(
        self,
        theta_i_deg: Float[np.ndarray, " points"],
        theta_o_deg: Float[np.ndarray, " points"],
        wavelength_nm: Float[np.ndarray, " points"],
        is_transmission: Bool[np.ndarray, " points"],
    ) -> Bool[np.ndarray, " points"]:
        """The points that the factor is for."""
        found = np.ones(len(theta_i_deg), bool)
        if self.theta_i_deg is not None:
            found &= np.abs(theta_i_deg - self.theta_i_deg) < _SAME
        if self.side is not None:
            found &= is_transmission == (self.side == "T")
        for values, limits in ((theta_o_deg, self.theta_o_deg), (wavelength_nm, self.wavelength_nm)):
            if limits is not None:
                found &= (values >= limits[0] - _SAME) & (values <= limits[1] + _SAME)
        return found


def read_weights(document: dict[str, Any]) -> tuple[ResidualWeight, ...]:
    """The weights of a sample file."""
    tables = document.get("weights", [])
    if not isinstance(tables, list) or not all(isinstance(t, dict) for t in tables):
        raise InputRefusedError("weights must be a list of [[weights]] tables.")
    return tuple(_read(table) for table in tables)


def with_named_fields(plain: Any) -> Any:
    """Plain data of a sample whose weights have their names; earlier versions listed three values of each."""
    if not isinstance(plain, Mapping) or not isinstance(plain.get("weights"), list):
        return plain
    fields = ("theta_i_deg", "side", "weight")
    named = [
        dict(zip(fields, one, strict=True)) if isinstance(one, list) and len(one) == len(fields) else one
        for one in plain["weights"]
    ]
    return {**plain, "weights": named}


def _read(table: dict[str, Any]) -> ResidualWeight:
    only(table, schema.WEIGHTS | schema.WEIGHTS_ENTRIES, "[[weights]]")
    side, angle, column = (table.get(key) for key in ("side", "theta_i_deg", "column"))
    if side not in (None, *schema.SIDES):
        raise InputRefusedError(f'weights.side is {side!r}; it must be "R" or "T".')
    if angle is not None:
        angle = bounded(angle, schema.WEIGHTS["theta_i_deg"], "weights.theta_i_deg")
    if column is not None and not (isinstance(column, str) and column):
        raise InputRefusedError(f"weights.column is {column!r}; it must be the name of a column in quotes.")
    weight = table.get("weight", None if column is None else 1)
    return ResidualWeight(
        bounded(weight, schema.WEIGHTS["weight"], "weights.weight"),
        angle,
        side,
        _limits(table, "theta_o_deg"),
        _limits(table, "wavelength_nm"),
        column,
    )


def _limits(table: dict[str, Any], key: str) -> tuple[float, float] | None:
    given = table.get(key)
    if given is None:
        return None
    if not is_list_of_numbers(given, 2) or len(given) != 2 or not 0 <= given[0] <= given[1]:
        raise InputRefusedError(
            f"weights.{key} is {given!r}; it must be a list of two numbers, the lowest and the highest."
        )
    return float(given[0]), float(given[1])
