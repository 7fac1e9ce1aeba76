"""Judges the outcome of a search and assembles the diagnosis."""

import numpy as np

from jaxink.diagnosis.findings.anonymous import best_anonymous
from jaxink.diagnosis.findings.candidates import candidate_rows
from jaxink.diagnosis.findings.consistency import consistency_of
from jaxink.diagnosis.findings.corrected import corrected_fit
from jaxink.diagnosis.findings.diagnosis import Diagnosis
from jaxink.diagnosis.findings.further_measurements import FurtherMeasurement, further_measurements
from jaxink.diagnosis.findings.hidden import hidden_effects
from jaxink.diagnosis.findings.input_mistake import beside_mistakes
from jaxink.diagnosis.findings.judgement import Evidence, in_view_of, is_met, is_ordered, judge
from jaxink.diagnosis.findings.location import locate
from jaxink.diagnosis.findings.parameters import (
    estimates_of,
    misfit_errors,
    undetermined_parameters,
)
from jaxink.diagnosis.findings.shape import overlaps_with, residual_points, shape_of
from jaxink.diagnosis.findings.summary import summary_of
from jaxink.diagnosis.search.allowance import Task
from jaxink.diagnosis.search.loop import SearchResult
from jaxink.effects import invalidity
from jaxink.numerics.progress import Progress

# What failed if there is only the fit of the declared model.
_CORRECTED = "the result of the corrected model, for which that of the declared one stands,"
_SETTINGS = ("level", "n_bootstrap", "seed", "max_effects", "max_parameters")


def diagnosis_of(found: SearchResult, follow: Progress) -> Diagnosis:
    """Judge a search and collect the evidence for the verdict."""
    first, last, steps, policy = found.first, found.last, found.steps, found.options.policy
    further = _further(found, follow)
    before = summary_of(first, found.cross_validation)
    after = summary_of(last, found.cross_validation) if steps else before
    location = locate(
        last.residual,
        last.jacobian,
        found.points,
        at_bound=last.at_bound,
        options=found.setup.options,
        policy=policy,
    )
    shifts = misfit_errors(last, found.points, location.smooth)
    consistency = consistency_of(found.setup.data, found.setup.noise, policy)
    policy = in_view_of(consistency, policy)
    shape = shape_of(last, location.smooth.share)
    is_tolerated = last.is_within_own_error
    remains = not (is_tolerated or is_met(after, found.structure_after, policy, shape))
    is_odd = not is_tolerated and (remains or is_ordered(found.structure_after, policy, shape))
    candidates, corrected = candidate_rows(found.screenings[0], steps), found.fit
    with found.setup.failures.sparing(_CORRECTED, ""):
        corrected = corrected_fit(found, follow)
    time_limit, failures = found.setup.allowance.outcome(), found.setup.failures.found
    evidence = Evidence(
        steps=steps,
        before=before,
        after=after,
        structure=found.structure_after,
        location=location,
        candidates=candidates,
        further=further,
        consistency=consistency,
        undetermined=undetermined_parameters(last, shifts) if remains else (),
        imitations=_imitations(found),
        as_well_without_a_name=_as_well_without_a_name(found),
        shape=shape,
        time_limit=time_limit,
        failures=failures,
        level=found.setup.noise.level,
        tolerated=last.tolerated,
    )
    return Diagnosis(
        declared=found.fit,
        corrected=corrected,
        verdict=beside_mistakes(judge(evidence, policy), found.fit, after.fitted, policy),
        steps=steps,
        before=before,
        after=after,
        candidates=candidates,
        not_testable=first.listed.not_testable,
        structure_before=found.structure_before,
        structure_after=found.structure_after,
        location=location,
        parameters_before=estimates_of(first),
        parameters_after=estimates_of(last),
        misfit_errors=shifts,
        undetermined=evidence.undetermined,
        effects=last.accepted,
        settings={key: getattr(found.options, key) for key in _SETTINGS},
        further=further,
        consistency=evidence.consistency,
        remaining=candidate_rows(found.screenings[-1], ()) if len(found.screenings) > 1 else (),
        time_limit=time_limit,
        failures=failures,
        imitations=evidence.imitations,
        shape=shape if is_odd else None,
        overlaps=overlaps_with(shape, found) if is_odd else {},
        hidden=() if remains else hidden_effects(last, found.screenings[-1]),
    )


def _imitations(found: SearchResult) -> dict[str, str]:
    """Effects whose fitted values do not mean what the effect says, with the reason."""
    values, wavelengths = found.last.solution.values, found.points.wavelength_nm
    reasons = {step.effect: invalidity(step.form, values, wavelengths) for step in found.steps}
    return {effect: reason for effect, reason in reasons.items() if reason}


def _as_well_without_a_name(found: SearchResult) -> str:
    """Which smooth description the data do not distinguish from all effects added, if one is; in words."""
    if not found.steps:
        return ""
    n, policy = len(found.points), found.options.policy
    best = best_anonymous(residual_points(found.first), found.points, found.first.projection)
    terms = sum(len(step.form.terms) for step in found.steps)
    gained = found.first.solution.chi_square - found.last.solution.chi_square
    if best.penalised(n) <= gained - terms * np.log(n) - policy.class_delta_chi_square:
        return ""
    return (
        f"a smooth function of {best.variable} with {best.amplitudes} amplitudes describes the residual "
        f"no worse (decrease in chi-square {best.delta_chi_square:.4g}, by the effects {gained:.4g})"
    )


def _further(found: SearchResult, follow: Progress) -> tuple[FurtherMeasurement, ...]:
    """Measurements that would distinguish the members of the class, if exactly one effect was found."""
    if len(found.steps) != 1 or len(found.steps[0].members) < 2:
        return ()
    screening = found.screenings[0]
    names, failures = found.steps[0].members[:2], found.setup.failures
    first, second = (screening.refits.get(name) for name in names)
    if first is None or second is None or not found.setup.allowance.permits(Task.FURTHER, names):
        return ()
    follow("further measurements", 1, first.solution.chi_square)
    with failures.sparing("the search for measurements that would distinguish {}", " and ".join(names)):
        return further_measurements(found.setup, screening.stage.accepted, first, second)
    return ()
