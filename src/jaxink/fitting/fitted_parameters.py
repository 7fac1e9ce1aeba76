"""Parameters after a fit: values, standard errors and their covariance."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.display.card import CardTable
from jaxink.display.named_rows import NamedRows
from jaxink.numerics.digits import plain, relative_error, with_uncertainty

if TYPE_CHECKING:
    import pandas


@dataclasses.dataclass(frozen=True)
class FittedParameter:
    """One parameter after the fit.

    Parameters
    ----------
    name, unit
        As in the sample.
    value
        Fitted value.
    standard_error
        One standard error; None if unknown, see ``flag``.
    start, minimum, maximum
        Start value and range.
    free
        Whether it was fitted.
    tie
        Expression of a tied parameter, or None.
    flag
        Empty, or: ``at lower bound``, ``at upper bound``, ``not determined``, ``open below``, ``open above``.
    interval
        Where chi-square increases by less than 1 with all others refitted; None if not computed.
    """

    name: str
    unit: str
    value: float
    standard_error: float | None
    start: float
    minimum: float
    maximum: float
    free: bool
    tie: str | None = None
    flag: str = ""
    interval: tuple[float, float] | None = None

    __repr__ = brief_repr


class FittedParameters(NamedRows[FittedParameter]):
    """All parameters of a fit, in the order of the sample."""

    @classmethod
    def of(cls, rows: tuple[FittedParameter, ...]) -> "FittedParameters":
        """The table of some parameters."""
        return cls({row.name: row for row in rows})

    @property
    def free(self) -> tuple[FittedParameter, ...]:
        """The fitted parameters, in order."""
        return tuple(row for row in self.values() if row.free)

    def table(self) -> CardTable:
        """Free parameters with their standard errors in units of the last digits, then the others."""
        heads = ["parameter", "value(s.e.)", "unit", "rel. s.e.", "start", "minimum", "maximum", "remark"]
        rows = []
        for p in sorted(self.values(), key=lambda row: not row.free):
            if p.free:
                texts = [with_uncertainty(p.value, p.standard_error), p.unit]
                texts += [relative_error(p.value, p.standard_error)]
                rows.append([p.name, *texts, *map(plain, (p.start, p.minimum, p.maximum)), p.flag])
            else:
                remark = f"tied: {p.tie}" if p.tie else "fixed"
                rows.append([p.name, plain(p.value), p.unit, "", "", "", "", remark])
        return CardTable(heads, rows, (0, 2, 7))


@dataclasses.dataclass(frozen=True)
class FittedCovariance:
    """Covariance of the fitted parameters that have a standard error.

    Parameters
    ----------
    names
        The parameters.
    matrix
        In the units of the parameters, shape ``(parameters, parameters)``.
    """

    names: tuple[str, ...]
    matrix: Float[np.ndarray, "parameters parameters"]

    __repr__ = brief_repr

    def to_frame(self) -> "pandas.DataFrame":
        """The matrix as a pandas DataFrame, with names along both axes."""
        import pandas

        return pandas.DataFrame(self.matrix, index=list(self.names), columns=list(self.names))

    def _repr_html_(self) -> str:
        rows = [[n, *(f"{v:.4g}" for v in row)] for n, row in zip(self.names, self.matrix, strict=True)]
        return CardTable(["", *self.names], rows).html()
