"""From evidence to verdict and sentence."""

import dataclasses

import numpy as np

from jaxink.diagnosis.findings.candidates import CandidateRow
from jaxink.diagnosis.findings.consistency import Consistency
from jaxink.diagnosis.findings.further_measurements import FurtherMeasurement
from jaxink.diagnosis.findings.location import Location
from jaxink.diagnosis.findings.summary import Summary
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.search.deadline import TimeLimit
from jaxink.diagnosis.search.step import Step
from jaxink.diagnosis.statistics.candidate import Testability
from jaxink.diagnosis.statistics.structure import StructureResult
from jaxink.fitting import level_in_doubt
from jaxink.measurement import NoiseLevel
from jaxink.numerics.failures import Failure
from jaxink.residual import ResidualShape

# Tests for structure in words, by the names of their statistics; the last is that of a `ResidualShape`.
TESTS = {
    "chi_square": "chi-square",
    "runs": "runs of one sign",
    "ljung_box": "correlation along scans (Ljung-Box)",
    "neighbours": "correlation between neighbouring directions",
    "incidence": "correlation between incidences",
    "wavelength": "correlation between wavelengths",
    "modes": "broad modes (F test)",
}
# A sentence gives the names of so many effects, and the number of more.
_MOST_NAMES = 3


@dataclasses.dataclass(frozen=True)
class Evidence:
    """The evidence for a verdict: `structure` and `shape` of the final residual, all else as in `Diagnosis`.

    `imitations` says of steps why they do not mean what their effect says, `as_well_without_a_name` which
    description without a cause the data do not distinguish from them; `time_limit` is None if there was none;
    `failures` are parts of the diagnosis that failed; `level` is that of an estimated noise; `tolerated` is
    what the known error of the model may add to the reduced chi-square.
    """

    steps: tuple[Step, ...]
    before: Summary
    after: Summary
    structure: StructureResult
    location: Location
    candidates: tuple[CandidateRow, ...]
    further: tuple[FurtherMeasurement, ...] = ()
    consistency: tuple[Consistency, ...] = ()
    undetermined: tuple[str, ...] = ()
    imitations: dict[str, str] = dataclasses.field(default_factory=dict)
    as_well_without_a_name: str = ""
    shape: ResidualShape | None = None
    time_limit: TimeLimit | None = None
    failures: tuple[Failure, ...] = ()
    level: NoiseLevel | None = None
    tolerated: float = 0.0

    @property
    def is_within_own_error(self) -> bool:
        """Whether the model has a known error that may explain what is left."""
        reduced = self.after.fitted.reduced_chi_square
        return reduced is not None and 0 < reduced - 1 <= self.tolerated


def fits_noise(
    summary: Summary,
    structure: StructureResult,
    policy: SearchPolicy = DEFAULT_POLICY,
    shape: ResidualShape | None = None,
) -> bool:
    """Whether a residual is consistent with noise, or below the accuracy of the noise."""
    figures = summary.fitted
    # Without degrees of freedom there is neither.
    if figures.probability is None or figures.reduced_chi_square is None:
        return True
    within = figures.reduced_chi_square < policy.sigma_tolerance**2
    return within or (figures.probability >= policy.noise_p and not is_ordered(structure, policy, shape))


def is_ordered(
    structure: StructureResult, policy: SearchPolicy = DEFAULT_POLICY, shape: ResidualShape | None = None
) -> bool:
    """Whether a residual has an order, whatever the level of the noise."""
    order = (s.p_value for s in structure.statistics if s.name != "chi_square")
    smooth = 1.0 if shape is None else shape.p_value
    return min(smooth, *order, 1.0) < policy.noise_p


def tightened_by_repeats(
    consistency: tuple[Consistency, ...], policy: SearchPolicy = DEFAULT_POLICY
) -> SearchPolicy:
    """The policy, with a smaller tolerance of the noise where pairs of readings tell its level better.

    N pairs tell a standard deviation to 1 / sqrt(2 N); two of these standard errors are tolerated. Pairs that
    scatter more than the noise in use do not raise the tolerance.
    """
    tolerances = [
        max(pairs.relative / pairs.expected, 1.0) * (1 + 2 / np.sqrt(2 * pairs.pairs))
        for pairs in consistency
    ]
    return dataclasses.replace(policy, sigma_tolerance=min([policy.sigma_tolerance, *tolerances]))


def _met(evidence: Evidence, policy: SearchPolicy) -> bool:
    known = evidence.is_within_own_error
    return known or fits_noise(evidence.after, evidence.structure, policy, evidence.shape)


def _ordered(evidence: Evidence, policy: SearchPolicy) -> bool:
    known = evidence.is_within_own_error
    return not known and is_ordered(evidence.structure, policy, evidence.shape)


def judge(evidence: Evidence, policy: SearchPolicy = DEFAULT_POLICY) -> Verdict:
    """Code, effects and sentence."""
    verdict = _judged(evidence, policy)
    if verdict.code is VerdictCode.NOT_TESTABLE:
        return verdict
    limit = evidence.time_limit
    if limit is not None and limit.is_decisive:
        verdict = _unfinished(verdict, evidence, policy)
    sentence = verdict.sentence
    if limit is not None and limit.not_done:
        left_out = "; ".join(omission.described(_MOST_NAMES) for omission in limit.not_done)
        sentence += f" Not done within the time limit of {limit.limit_s:g} s: {left_out}."
    if evidence.failures:
        sentence += f" {_failed(evidence.failures)}"
    if evidence.level is not None:
        sentence += f" {_level(evidence.level, evidence, policy)}"
    if evidence.undetermined:
        sentence += f" Given this misfit, the data do not determine {', '.join(evidence.undetermined)}."
    broken = [c.sentence for c in evidence.consistency if c.exceeds_noise]
    if broken:
        # Pairs are compared as they were read: what was found of the instrument may be why they differ.
        corrected = any(step.form.group == "instrument" for step in evidence.steps)
        said = "Before this correction, the data were" if corrected else "The data are"
        sentence += f" {said} inconsistent: {'; '.join(broken)}."
    return dataclasses.replace(verdict, sentence=sentence)


def _level(level: NoiseLevel, evidence: Evidence, policy: SearchPolicy) -> str:
    """That the noise is estimated, and whether the verdict rests on how well."""
    figures, said = evidence.after.fitted, f"The noise is estimated, {level.text}."
    doubt = level_in_doubt(figures.chi_square, figures.degrees_of_freedom, level)
    if doubt and _met(evidence, policy):
        return f"{said} {doubt}"
    return said


def _failed(failures: tuple[Failure, ...]) -> str:
    """Parts that failed; of many, only the first ones and the number of the others."""
    rest = len(failures) - _MOST_NAMES
    more = f" {rest} more parts failed; the report lists them." if rest > 0 else ""
    return " ".join(failure.sentence for failure in failures[:_MOST_NAMES]) + more


def _unfinished(verdict: Verdict, evidence: Evidence, policy: SearchPolicy) -> Verdict:
    """What can be said although tests are missing that the verdict would rest on."""
    if evidence.steps:
        sentence = f"Unfinished within the time limit. So far: {verdict.sentence}"
        return Verdict(VerdictCode.UNFINISHED, verdict.effects, sentence)
    reduced, place = evidence.before.fitted.reduced_chi_square, _place(evidence, policy)
    if _met(evidence, policy):
        found = f"The residual is consistent with noise (reduced chi-square {reduced:.4g})"
    else:
        found = f"The residual has structure (reduced chi-square {reduced:.4g}): {place}"
    best = next((c for c in evidence.candidates if c.refit_delta_chi_square), None)
    leading = f"; largest decrease in chi-square by a refit so far: {best.effect}" if best else ""
    sentence = f"Unfinished within the time limit. {found}. No effect has passed all tests so far{leading}."
    return Verdict(VerdictCode.UNFINISHED, (), sentence)


def _judged(evidence: Evidence, policy: SearchPolicy) -> Verdict:
    steps, before, after = evidence.steps, evidence.before, evidence.after
    place = _place(evidence, policy)
    if before.fitted.degrees_of_freedom <= 0:
        return Verdict(
            VerdictCode.NOT_TESTABLE,
            (),
            "There are not more points than free parameters, so the fit leaves nothing to test.",
        )
    met = _met(evidence, policy)
    if not steps:
        return _nothing_added(met, evidence, policy)
    names = [step.effect for step in steps]
    others = list(dict.fromkeys(n for step in steps for n in step.members if n not in names))
    what = " and ".join(_named(step) for step in steps)
    if evidence.imitations:
        reasons = "; ".join(f"{name}: {why}" for name, why in evidence.imitations.items())
        what += f" [an imitation of another cause - {reasons}]"
    change = (
        f"reduced chi-square decreases from {before.fitted.reduced_chi_square:.4g} to "
        f"{after.fitted.reduced_chi_square:.4g}"
    )
    if before.held_out is not None and after.held_out is not None:
        unseen = before.held_out.reduced_chi_square, after.held_out.reduced_chi_square
        change += f" (held-out scans: from {unseen[0]:.4g} to {unseen[1]:.4g})"
    is_plain = met and not _ordered(evidence, policy)
    small = _within_level(evidence, policy) if is_plain else ""
    change += f"; what is left {small}" if small else ""
    if not met:
        sentence = f"Partly explained: {what}; {change}. Remaining residual: {place}."
        return Verdict(VerdictCode.PARTLY_EXPLAINED, tuple(names + others), sentence)
    if evidence.as_well_without_a_name:
        sentence = (
            f"Imitated: {what}; {change}. But {evidence.as_well_without_a_name}, so the cause may be another "
            "one that resembles it."
        )
        return Verdict(VerdictCode.IMITATED, tuple(names + others), sentence)
    if evidence.imitations:
        sentence = f"Imitated: {what}; {change}. What the cause is, these tests do not tell."
        return Verdict(VerdictCode.IMITATED, tuple(names + others), sentence)
    if _ordered(evidence, policy):
        sentence = f"An order remains, within the accuracy of the noise ({place}): {what}; {change}."
        return Verdict(VerdictCode.ORDER_REMAINS, tuple(names + others), sentence)
    if any(len(step.members) > 1 for step in steps):
        sentence = f"Explained, but not uniquely: {what}; {change}.{_separate(evidence.further, policy)}"
        return Verdict(VerdictCode.EXPLAINED_BY_ONE_OF, tuple(names + others), sentence)
    is_instrument = all(step.form.group == "instrument" for step in steps)
    code = VerdictCode.INSTRUMENT if is_instrument else VerdictCode.EXPLAINED
    return Verdict(code, tuple(names), f"Explained: {what}; {change}.")


def _separate(further: tuple[FurtherMeasurement, ...], policy: SearchPolicy) -> str:
    if not further:
        return ""
    best = further[0]
    one, other = best.effects
    if best.chi_square < policy.decisive_chi_square:
        return f" None of the incidences and planes considered would distinguish {one} from {other}."
    return (
        f" {best.measurement[0].upper()}{best.measurement[1:]} would distinguish {one} from {other} "
        f"(chi-square {best.chi_square:.3g})."
    )


def _named(step: Step) -> str:
    rest = step.members[1:]
    others = f"; these data cannot distinguish it from {', '.join(rest)}" if rest else ""
    return f"{step.sentence} ({step.effect}{others})"


def _place(evidence: Evidence, policy: SearchPolicy) -> str:
    """Where the residual is large; without a smooth part, the tests that say that it has structure at all."""
    if evidence.location.is_found:
        return evidence.location.sentence
    telling = significant_tests(evidence.structure, evidence.shape, policy)
    if not telling:
        return evidence.location.sentence
    tests = " and ".join(f"{name} (p = {p:.2g})" for name, p in telling[:_MOST_NAMES])
    return f"without a smooth pattern of directions, but significant by {tests}"


def significant_tests(
    structure: StructureResult, shape: ResidualShape | None, policy: SearchPolicy = DEFAULT_POLICY
) -> list[tuple[str, float]]:
    """Tests that a residual fails, in words, with their p, the smallest first."""
    found = [(TESTS[s.name], s.p_value) for s in structure.statistics]
    if shape is not None:
        found.append((TESTS["modes"], shape.p_value))
    return sorted((one for one in found if one[1] < policy.noise_p), key=lambda one: one[1])


def _within_level(evidence: Evidence, policy: SearchPolicy) -> str:
    """That a residual exceeds the noise, but by less than noise and model are known; empty if it does not."""
    figures = evidence.after.fitted
    if figures.probability is None or figures.probability >= policy.noise_p:
        return ""
    reason = (
        "is within the error that is allowed for the model of rough faces or of a limited field"
        if evidence.is_within_own_error
        else "by less than its level is known"
    )
    return (
        f"exceeds the noise (reduced chi-square {figures.reduced_chi_square:.4g}, p = "
        f"{figures.probability:.2g}), but {reason}"
    )


def _nothing_added(met: bool, evidence: Evidence, policy: SearchPolicy) -> Verdict:
    reduced, place = evidence.before.fitted.reduced_chi_square, _place(evidence, policy)
    if not met:
        return Verdict(
            VerdictCode.UNEXPLAINED_STRUCTURE,
            (),
            f"The residual has structure (reduced chi-square {reduced:.4g}) that none of the "
            f"{len(evidence.candidates)} effects tested explains: {place}.",
        )
    hard = [c.effect for c in evidence.candidates if c.status != Testability.TESTABLE]
    more = f"; hardly testable with these data: {', '.join(hard)}" if hard else ""
    if _ordered(evidence, policy):
        return Verdict(
            VerdictCode.ORDER_REMAINS,
            (),
            f"The residual is within the accuracy of the noise (reduced chi-square {reduced:.4g}), but has "
            f"an order that no effect explains: {place}{more}.",
        )
    small = _within_level(evidence, policy)
    found = small or f"is consistent with noise (reduced chi-square {reduced:.4g})"
    return Verdict(VerdictCode.NO_MISFIT, (), f"No misfit: the residual {found}{more}.")
