"""The judgement on what was found and what is left: a verdict with its sentence."""

import dataclasses

from jaxink.diagnosis.findings.candidates import CandidateRow
from jaxink.diagnosis.findings.consistency import Consistency
from jaxink.diagnosis.findings.further_measurements import Further
from jaxink.diagnosis.findings.location import Location
from jaxink.diagnosis.findings.summary import Summary
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.search.step import Step
from jaxink.diagnosis.statistics.candidate import Testability
from jaxink.diagnosis.statistics.structure import StructureResult


@dataclasses.dataclass(frozen=True)
class Evidence:
    """What a verdict rests on.

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

    steps: tuple[Step, ...]
    before: Summary
    after: Summary
    structure: StructureResult
    location: Location
    candidates: tuple[CandidateRow, ...]
    further: tuple[Further, ...] = ()
    consistency: tuple[Consistency, ...] = ()
    undetermined: tuple[str, ...] = ()


def is_met(summary: Summary, structure: StructureResult, policy: SearchPolicy = DEFAULT_POLICY) -> bool:
    """Whether a residual is noise, or so small that the stated noise cannot tell.

    Parameters
    ----------
    summary
        Its size.
    structure
        Its order.
    policy
        What counts as noise.
    """
    figures = summary.fitted
    if figures.probability is None:
        return True
    within = figures.reduced_chi_square < policy.sigma_tolerance**2
    return within or (figures.probability >= policy.noise_p and not _is_ordered(structure, policy))


def _is_ordered(structure: StructureResult, policy: SearchPolicy) -> bool:
    order = (s.p_value for s in structure.statistics if s.name != "chi_square")
    return min(order, default=1.0) < policy.noise_p


def judge(evidence: Evidence, policy: SearchPolicy = DEFAULT_POLICY) -> Verdict:
    """Code, effects and sentence.

    Parameters
    ----------
    evidence
        What was found.
    policy
        What counts as noise, and what tells effects apart.
    """
    verdict = _judged(evidence, policy)
    if verdict.code is VerdictCode.NOT_TESTABLE:
        return verdict
    sentence = verdict.sentence
    if evidence.undetermined:
        sentence += f" With this misfit the data do not determine {', '.join(evidence.undetermined)}."
    broken = [c.sentence for c in evidence.consistency if c.is_broken]
    if broken:
        sentence += f" The data differ among themselves: {'; '.join(broken)}."
    return dataclasses.replace(verdict, sentence=sentence)


def _judged(evidence: Evidence, policy: SearchPolicy) -> Verdict:
    steps, before, after = evidence.steps, evidence.before, evidence.after
    if before.fitted.degrees_of_freedom <= 0:
        return Verdict(
            VerdictCode.NOT_TESTABLE,
            (),
            "There are no more points than free parameters, so nothing can be missed.",
        )
    met = is_met(after, evidence.structure, policy)
    if not steps:
        return _nothing_added(met, evidence, policy)
    names = [step.effect for step in steps]
    others = list(dict.fromkeys(n for step in steps for n in step.members if n not in names))
    what = " and ".join(_named(step) for step in steps)
    change = (
        f"reduced chi-square falls from {before.fitted.reduced_chi_square:.4g} to "
        f"{after.fitted.reduced_chi_square:.4g}, of held-out scans from "
        f"{before.held_out.reduced_chi_square:.4g} to {after.held_out.reduced_chi_square:.4g}"
    )
    if not met:
        sentence = f"Partly explained: {what}; {change}; what remains: {evidence.location.sentence}."
        return Verdict(VerdictCode.PARTLY_EXPLAINED, tuple(names + others), sentence)
    if any(len(step.members) > 1 for step in steps):
        sentence = f"Explained by {what}; {change}.{_separate(evidence.further, policy)}"
        return Verdict(VerdictCode.EXPLAINED_BY_ONE_OF, tuple(names + others), sentence)
    is_instrument = all(step.form.group == "instrument" for step in steps)
    code = VerdictCode.INSTRUMENT if is_instrument else VerdictCode.EXPLAINED
    return Verdict(code, tuple(names), f"Explained: {what}; {change}.")


def _separate(further: tuple[Further, ...], policy: SearchPolicy) -> str:
    if not further:
        return ""
    best = further[0]
    one, other = best.effects
    if best.chi_square < policy.telling_chi_square:
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


def _nothing_added(met: bool, evidence: Evidence, policy: SearchPolicy) -> Verdict:
    reduced, place = evidence.before.fitted.reduced_chi_square, evidence.location.sentence
    if not met:
        return Verdict(
            VerdictCode.UNEXPLAINED_STRUCTURE,
            (),
            f"Structure remains (reduced chi-square {reduced:.4g}) that none of {len(evidence.candidates)} "
            f"effects tried explains: {place}.",
        )
    hard = [c.effect for c in evidence.candidates if c.status != Testability.TESTABLE]
    more = f"; hardly testable with these data: {', '.join(hard)}" if hard else ""
    if _is_ordered(evidence.structure, policy):
        more = f", with an order that no effect explains: {place}{more}"
    return Verdict(
        VerdictCode.NO_MISFIT,
        (),
        f"No misfit: the declared model leaves noise (reduced chi-square {reduced:.4g}){more}.",
    )
