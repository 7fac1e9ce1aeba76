"""Parameters after a fit: values, standard errors, covariance; as a table, as a file, in a notebook."""

import csv
import dataclasses
import io
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.display.card import Card, CardTable
from jaxink.display.named_rows import NamedRows
from jaxink.files.result_folder import PARAMETER_COLUMNS
from jaxink.files.spreadsheet import cell
from jaxink.fitting.figures_of_merit import Merit
from jaxink.fitting.minima import Minima
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.relative_deviation import Deviation
from jaxink.fitting.verdict import FitVerdict
from jaxink.measurement import GonioData
from jaxink.numerics.digits import interval, percent, plain, relative_error, rounded, with_uncertainty

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
    over_minima
        Range of the values at all minima that the data do not exclude, see `FitResult.minima`; None if this
        is the only one.
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
    over_minima: tuple[float, float] | None = None

    __repr__ = brief_repr

    @property
    def over_minima_words(self) -> str:
        """The range over the minima; empty if there is one minimum."""
        return "" if self.over_minima is None else interval(*self.over_minima)


def value_head(errors_hold: bool) -> str:
    """Head of a column of values with their standard errors."""
    return "value(s.e.)" if errors_hold else "value(meaningless s.e.)"


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

    def table(self, errors_hold: bool = True) -> CardTable:
        """Free parameters with their standard errors in units of the last digits, then the others.

        Parameters
        ----------
        errors_hold
            Whether the standard errors say how far the values may be off; if not, the heads say so.
        """
        heads = ["parameter", value_head(errors_hold), "unit"]
        heads += ["rel. s.e." if errors_hold else "rel. meaningless s.e."]
        # Beside the standard errors, which know of one minimum only.
        several = any(p.over_minima for p in self.values())
        heads += [*(["over minima"] if several else []), "start", "minimum", "maximum", "remark"]
        rows = []
        for p in sorted(self.values(), key=lambda row: not row.free):
            if p.free:
                texts = [with_uncertainty(p.value, p.standard_error), p.unit]
                texts += [relative_error(p.value, p.standard_error)]
                texts += [p.over_minima_words] if several else []
                rows.append([p.name, *texts, *map(plain, (p.start, p.minimum, p.maximum)), p.flag])
            else:
                remark = f"tied: {p.tie}" if p.tie else "fixed"
                blank = [""] * (len(heads) - 4)
                rows.append([p.name, plain(p.value), p.unit, *blank, remark])
        return CardTable(heads, rows, (0, 2, len(heads) - 1))


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

    @classmethod
    def of(
        cls, parameters: FittedParameters, names: Sequence[str], correlations: Float[np.ndarray, "all all"]
    ) -> "FittedCovariance":
        """The covariance of parameters with these correlations, without those that have no standard error."""
        errors = [parameters[name].standard_error for name in names]
        known = [i for i, error in enumerate(errors) if error is not None]
        deviation = np.array([errors[i] for i in known], float)
        matrix = correlations[np.ix_(known, known)] * np.outer(deviation, deviation)
        return cls(tuple(names[i] for i in known), matrix)

    def to_frame(self) -> "pandas.DataFrame":
        """The matrix as a pandas DataFrame, with names along both axes."""
        import pandas

        return pandas.DataFrame(self.matrix, index=list(self.names), columns=list(self.names))

    def _repr_html_(self) -> str:
        rows = [[n, *(f"{v:.4g}" for v in row)] for n, row in zip(self.names, self.matrix, strict=True)]
        return CardTable(["", *self.names], rows).html()


# Note beside a standard error of a model that does not fit, or of a search that did not end in a minimum.
_MEANINGLESS = "the standard error is meaningless, see the verdict"


def parameter_text(parameters: FittedParameters, errors_hold: bool = True) -> str:
    """Text of the file: all digits of the numbers, blank where there is none.

    Parameters
    ----------
    parameters
        All parameters.
    errors_hold
        Whether the standard errors say how far the values may be off; if not, the note of each says so.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(PARAMETER_COLUMNS)
    table.writerows([cell(value) for value in _row(p, errors_hold)] for p in parameters.values())
    return text.getvalue()


def _row(p: FittedParameter, errors_hold: bool) -> list[object]:
    name, _, wavelength_nm = p.name.partition("@")
    state = "free" if p.free else "fixed" if p.tie is None else "tied"
    numbers = [_number(value) for value in (p.value, p.standard_error, p.minimum, p.maximum)]
    return [name, wavelength_nm, *numbers[:2], p.unit, *numbers[2:], state, "; ".join(_notes(p, errors_hold))]


def _number(value: float | None) -> str:
    return repr(float(value)) if value is not None and math.isfinite(value) else ""


def _notes(p: FittedParameter, errors_hold: bool) -> list[str]:
    notes = [p.flag] if p.flag else []
    if p.standard_error is not None and not errors_hold:
        notes.append(_MEANINGLESS)
    if p.tie is not None:
        notes.append(f"tied: {p.tie}")
    if p.interval is not None:
        notes.append(f"{p.interval[0]!r} to {p.interval[1]!r} by profile likelihood")
    return notes


def fit_card(
    data: GonioData,
    outcome: Outcome,
    what: str,
    parameters: FittedParameters,
    merit: Merit,
    deviation: Deviation | None,
    verdict: FitVerdict,
    minima: Minima | None,
    remarks: Sequence[str],
) -> Card:
    """Card of a fit.

    Parameters
    ----------
    data, outcome, parameters, merit, deviation, verdict, minima
        As in the result.
    what
        Method and objective.
    remarks
        Sentences at the end.
    """
    title = f"Fit of {data.source or 'a measurement'}: {misfit_words(merit, deviation)}"
    used = f"{merit.points} of {len(data)} points used, {sum(scan.used > 0 for scan in data.scans)} scans"
    ended = f"{what[0].upper()}{what[1:].replace('_', '-')} {outcome.value}."
    table = parameters.table(verdict.standard_errors_hold)
    tables, said = [table, merit_table(merit, deviation)], tuple(remarks)
    if minima is not None and minima.is_told:
        tables, said = [*tables, minima.table()], (minima.sentence, *said)
    return Card(title, (verdict.sentence, ended, f"{used}."), tables, said)


def misfit_words(merit: Merit, deviation: Deviation | None) -> str:
    """The figure of merit by which a fit is judged."""
    if merit.reduced_chi_square is None:
        return f"rms of measured / model - 1 {percent(deviation and deviation.rms, missing='undefined')}"
    return f"reduced chi-square {merit.reduced_chi_square:.4g}"


def merit_table(merit: Merit, deviation: Deviation | None) -> CardTable:
    """Figures of merit."""
    rows = [
        ["chi-square", rounded(merit.chi_square, 5)],
        ["degrees of freedom", "" if merit.degrees_of_freedom is None else str(merit.degrees_of_freedom)],
        ["reduced chi-square", rounded(merit.reduced_chi_square, 4)],
        ["p", rounded(merit.probability)],
        ["absolute RMSD of pi f", rounded(merit.rmsd_absolute_pi, 4)],
        ["relative RMSD", percent(merit.rmsd_relative)],
        ["rms of measured / model - 1", percent(deviation and deviation.rms)],
    ]
    return CardTable(["figure of merit", "value"], [row for row in rows if row[1]])
