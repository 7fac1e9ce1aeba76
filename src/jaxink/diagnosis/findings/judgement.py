"""The verdict: a code, the effects, and one sentence."""

import dataclasses
from typing import TYPE_CHECKING

from jaxink.diagnosis.findings.consistency import LEFT, TOLERANCE, Consistency
from jaxink.diagnosis.findings.diagnosis import CandidateRow, Step, Summary, Verdict
from jaxink.diagnosis.findings.location import Location
from jaxink.diagnosis.statistics.structure import StructureResult

if TYPE_CHECKING:
    from jaxink.diagnosis.findings.further_measurements import Further

CODES = (
    "no_misfit",
    "explained",
    "explained_by_one_of",
    "partly_explained",
    "unexplained_structure",
    "instrument",
    "not_testable",
)


def is_met(summary: Summary, structure: StructureResult) -> bool:
    """Whether a residual is noise, or so small that the stated noise cannot tell.

    Parameters
    ----------
    summary
        Its size.
    structure
        Its order.
    """
    figures = summary.fitted
    if figures.probability is None:
        return True
    within = figures.reduced_chi_square < TOLERANCE**2
    return within or (figures.probability >= LEFT and not _is_ordered(structure))


def _is_ordered(structure: StructureResult) -> bool:
    return min((s.p_value for s in structure.statistics if s.name != "chi_square"), default=1.0) < LEFT


def judge(
    steps: list[Step],
    before: Summary,
    after: Summary,
    structure: StructureResult,
    location: Location,
    candidates: tuple[CandidateRow, ...],
    further: "tuple[Further, ...]" = (),
    consistency: tuple[Consistency, ...] = (),
    undetermined: tuple[str, ...] = (),
) -> Verdict:
    """Code, effects and sentence.

    Parameters
    ----------
    steps
        What was added.
    before, after
        Figures of merit.
    structure
        What is left after.
    location
        Where.
    candidates
        Of the first screen.
    further
        Measurements that would tell an ambiguous class apart, the most telling first.
    consistency
        Of the readings with each other.
    undetermined
        Parameters that the misfit leaves open.
    """
    verdict = _judged(steps, before, after, structure, location, candidates, further)
    if verdict.code == "not_testable":
        return verdict
    sentence = verdict.sentence
    if undetermined:
        sentence += f" With this misfit the data do not determine {', '.join(undetermined)}."
    broken = [c.sentence for c in consistency if c.is_broken]
    if broken:
        sentence += f" The data differ among themselves: {'; '.join(broken)}."
    return dataclasses.replace(verdict, sentence=sentence)


def _judged(steps, before, after, structure, location, candidates, further) -> Verdict:
    if before.fitted.degrees_of_freedom <= 0:
        return Verdict(
            "not_testable", (), "There are no more points than free parameters, so nothing can be missed."
        )
    met = is_met(after, structure)
    if not steps:
        return _nothing_added(met, before, structure, location, candidates)
    names = [step.effect for step in steps]
    others = list(dict.fromkeys(n for step in steps for n in step.members if n not in names))
    ambiguous = any(len(step.members) > 1 for step in steps)
    instrument = all(step.form.group == "instrument" for step in steps)
    what = " and ".join(_named(step) for step in steps)
    change = (
        f"reduced chi-square falls from {before.fitted.reduced_chi_square:.4g} to "
        f"{after.fitted.reduced_chi_square:.4g}, of held-out scans from "
        f"{before.held_out.reduced_chi_square:.4g} to {after.held_out.reduced_chi_square:.4g}"
    )
    if not met:
        sentence = f"Partly explained: {what}; {change}; what remains: {location.sentence}."
        return Verdict("partly_explained", tuple(names + others), sentence)
    if ambiguous:
        sentence = f"Explained by {what}; {change}.{_separate(further)}"
        return Verdict("explained_by_one_of", tuple(names + others), sentence)
    code = "instrument" if instrument else "explained"
    return Verdict(code, tuple(names), f"Explained: {what}; {change}.")


def _separate(further) -> str:
    if not further:
        return ""
    one, other = further[0].effects
    best = further[0]
    if not best.tells:
        return f" No incidence or plane of view that was tried would tell {one} from {other}."
    return (
        f" {best.measurement[0].upper()}{best.measurement[1:]} would tell {one} from {other} (chi-square "
        f"{best.chi_square:.3g})."
    )


def _named(step: Step) -> str:
    error = "" if step.standard_error is None else f" +- {step.standard_error:.2g}"
    unit = f" {step.unit}" if step.unit else ""
    text = f"{step.form.statement} ({step.effect}, {step.strength:.4g}{error}{unit})"
    if len(step.members) > 1:
        text += f", or one of {', '.join(step.members[1:])}, which these data do not tell from it"
    return text


def _nothing_added(met, before, structure, location, candidates) -> Verdict:
    reduced = before.fitted.reduced_chi_square
    if not met:
        return Verdict(
            "unexplained_structure",
            (),
            f"Structure remains (reduced chi-square {reduced:.4g}) that none of {len(candidates)} effects "
            f"tried explains: {location.sentence}.",
        )
    hard = [c.effect for c in candidates if c.status != "testable"]
    more = f"; hardly testable with these data: {', '.join(hard)}" if hard else ""
    if _is_ordered(structure):
        more = f", with an order that no effect explains: {location.sentence}{more}"
    return Verdict(
        "no_misfit",
        (),
        f"No misfit: the declared model leaves noise (reduced chi-square {reduced:.4g}){more}.",
    )
