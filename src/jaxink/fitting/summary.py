"""What a fit result says of itself in a notebook."""

import dataclasses
from collections.abc import Sequence

from jaxink.display.card import Card, CardTable
from jaxink.fitting.deviation import Deviation
from jaxink.fitting.fitted_parameters import FittedParameters
from jaxink.fitting.merit import Merit
from jaxink.fitting.minima import Minima
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.verdict import FitVerdict
from jaxink.measurement import GonioData
from jaxink.numerics.digits import percent, rounded


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
    table = parameters.table()
    if not verdict.standard_errors_hold:
        heads = [head.replace("s.e.", "meaningless s.e.") for head in table.heads]
        table = dataclasses.replace(table, heads=heads)
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
