"""Judges the outcome of a search and assembles the diagnosis.

Descriptions of a residual that name no cause: smooth functions of one variable, or of both polar angles.

A cause that is in no catalogue is often imitated by an effect that is. Such a description then needs a few
amplitudes more but comes closer, by more than these cost.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.findings.candidates import candidate_rows
from jaxink.diagnosis.findings.consistency import consistency_of
from jaxink.diagnosis.findings.diagnosis import Diagnosis
from jaxink.diagnosis.findings.further_measurements import FurtherMeasurement, further_measurements
from jaxink.diagnosis.findings.hidden import hidden_effects
from jaxink.diagnosis.findings.judgement import Evidence, fits_noise, is_ordered, judge, tightened_by_repeats
from jaxink.diagnosis.findings.location import locate
from jaxink.diagnosis.findings.summary import Figures, summary_of
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.diagnosis.policy import SearchPolicy
from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.loop import SearchResult
from jaxink.diagnosis.search.model import FittedModel
from jaxink.diagnosis.search.refit import Estimate, estimates, finite
from jaxink.diagnosis.statistics.discrepancy import SmoothPart, misfit_deviation
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.display.named_rows import NamedRows
from jaxink.effects import declare, invalidity, settled
from jaxink.fitting import (
    Ending,
    FitResult,
    Found,
    Mistake,
    Objective,
    Search,
    assemble,
    covariance,
    fit,
    make_objective,
    mistakes_sentence,
    prepare_data,
)
from jaxink.measurement import noise_of
from jaxink.residual import ResidualPoints, ResidualShape, modes_for, residual_shape

# What failed if there is only the fit of the declared model.
_CORRECTED = "the result of the corrected model, for which that of the declared one stands,"
_SETTINGS = ("level", "n_bootstrap", "seed", "max_effects", "max_parameters")
_DEGREE = 3
_MODE_ORDER = 2


def diagnosis_of(found: SearchResult) -> Diagnosis:
    """Judge a search and collect the evidence for the verdict."""
    first, last, steps, policy = found.first, found.last, found.steps, found.options.policy
    further = _further(found)
    before = summary_of(first, found.cross_validation)
    after = summary_of(last, found.cross_validation) if steps else before
    location = locate(
        last.residual,
        last.jacobian,
        found.problem.points,
        at_bound=last.at_bound,
        options=found.problem.screen_options,
        policy=policy,
    )
    shifts = misfit_errors(last, found.problem.points, location.smooth)
    consistency = consistency_of(found.problem.data, found.problem.noise, policy)
    policy = tightened_by_repeats(consistency, policy)
    shape = shape_of(last, location.smooth.share)
    is_tolerated = last.is_within_own_error
    remains = not (is_tolerated or fits_noise(after, found.structure_after, policy, shape))
    is_odd = not is_tolerated and (remains or is_ordered(found.structure_after, policy, shape))
    candidates, corrected = candidate_rows(found.screens[0], steps), found.fit
    with found.problem.failures.sparing(_CORRECTED, ""):
        corrected = corrected_fit(found)
    time_limit, failures = found.problem.deadline.outcome(), found.problem.failures.found
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
        level=found.problem.noise.level,
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
        remaining=candidate_rows(found.screens[-1], ()) if len(found.screens) > 1 else (),
        time_limit=time_limit,
        failures=failures,
        imitations=evidence.imitations,
        shape=shape if is_odd else None,
        overlaps=overlaps_with(shape, found) if is_odd else {},
        hidden=() if remains else hidden_effects(last, found.screens[-1]),
    )


def _imitations(found: SearchResult) -> dict[str, str]:
    """Effects whose fitted values do not mean what the effect says, with the reason."""
    values, wavelengths = found.last.solution.values, found.problem.points.wavelength_nm
    reasons = {step.effect: invalidity(step.form, values, wavelengths) for step in found.steps}
    return {effect: reason for effect, reason in reasons.items() if reason}


def _as_well_without_a_name(found: SearchResult) -> str:
    """Which smooth description the data do not distinguish from all effects added, if one is; in words."""
    if not found.steps:
        return ""
    n, policy = len(found.problem.points), found.options.policy
    best = best_anonymous(residual_points(found.first), found.problem.points, found.first.projection)
    terms = sum(len(step.form.terms) for step in found.steps)
    gained = found.first.solution.chi_square - found.last.solution.chi_square
    if best.penalised(n) <= gained - terms * np.log(n) - policy.class_delta_chi_square:
        return ""
    return (
        f"a smooth function of {best.variable} with {best.amplitudes} amplitudes describes the residual "
        f"no worse (decrease in chi-square {best.delta_chi_square:.4g}, by the effects {gained:.4g})"
    )


def _further(found: SearchResult) -> tuple[FurtherMeasurement, ...]:
    """Measurements that would distinguish the members of the class, if exactly one effect was found."""
    if len(found.steps) != 1 or len(found.steps[0].members) < 2:
        return ()
    screen = found.screens[0]
    names, failures = found.steps[0].members[:2], found.problem.failures
    first, second = (screen.refits.best.get(name) for name in names)
    if first is None or second is None or not found.problem.deadline.permits(OptionalTask.FURTHER, names):
        return ()
    found.problem.follow("further measurements", 1, first.solution.chi_square)
    with failures.sparing("the search for measurements that would distinguish {}", " and ".join(names)):
        return further_measurements(found.problem, screen.model.accepted, first, second)
    return ()


class Anonymous(NamedTuple):
    """A description: what the relative change depends on, its amplitudes, and its decrease in chi-square."""

    variable: str
    amplitudes: int
    delta_chi_square: float

    def penalised(self, n_points: int) -> float:
        """Decrease in chi-square minus ln(points) for each amplitude (Schwarz 1978)."""
        return self.delta_chi_square - self.amplitudes * np.log(n_points)


def best_anonymous(residual: ResidualPoints, points: Points, projection: Projection) -> Anonymous:
    """The best description of a residual, without what the free parameters reproduce."""
    found = []
    for variable, relative in _descriptions(residual, points):
        span = orthonormal_range(projection.unit(residual.whiten(relative)).unit)
        found.append(Anonymous(variable, span.shape[1], float(np.sum((span.T @ residual.whitened) ** 2))))
    return max(found, key=lambda one: one.penalised(len(points)))


def _descriptions(residual: ResidualPoints, points: Points) -> Iterator[tuple[str, np.ndarray]]:
    """What it depends on, in words, and the columns: the same on both sides, on one side only, or on each."""
    here = {side: residual.of_side(side)[:, None] for side in "RT"}
    variables = {
        "the angle of view": np.cos(np.deg2rad(points.theta_o_deg)),
        "the angle of incidence": np.cos(np.deg2rad(points.theta_i_deg)),
        "the order of measurement": points.order,
    }
    for name, values in variables.items():
        scaled = (values - values.mean()) / max(float(np.ptp(values)), 1e-300)
        yield from _by_side(name, np.vander(scaled, _DEGREE + 1), here)
    modes = [mode.values(residual) for mode in modes_for(residual, _MODE_ORDER)]
    yield from _by_side("the angles of incidence and view", np.stack(modes, axis=1), here)


def _by_side(name, columns, here) -> Iterator[tuple[str, np.ndarray]]:
    yield name, columns
    sides = [side for side, points in here.items() if points.any()]
    if len(sides) == 2:
        for side in sides:
            yield f"{name} on side {side}", columns * here[side]
        yield f"{name}, on each side", np.hstack([columns * here[side] for side in sides])


def corrected_fit(found: SearchResult) -> FitResult:
    """Fit of the corrected model, from the end of the search and at its resolution.

    It is that of the declared model if no effect was found. Otherwise the last fit of the search has fitted
    the same parameters of the same model already, in another order; nothing is compiled for it again.
    """
    if not found.last.accepted:
        return found.fit
    problem, solution = found.problem, found.last.solution
    sample = declare(problem.sample, found.last.accepted, solution.values)
    options = dataclasses.replace(
        found.options.fit, starts=1, scan=False, profile="none", config=problem.config
    )
    data = prepare_data(found.fit.data, sample)
    fixed = settled(sample, data)
    noise = noise_of(data, sample.noise)
    objective = make_objective(data, fixed, "chi_square", problem.config, noise)
    searched = found.last.objective
    search = _in_order_of(objective, solution, searched)
    if search is None:
        return fit(data, sample, options, problem.follow)
    end = search.derivatives
    errors = covariance(end.triangle, search.unit, end.gradient).for_noise_of(noise.degrees_of_freedom)
    others = (_in_order_of(objective, rival, searched) for rival in found.rivals)
    endings = (Ending(search, is_start=True), *(Ending(other) for other in others if other is not None))
    ended = Found(search, errors, (search,), endings=endings, is_from_search=True)
    return assemble(data, fixed, options, noise, objective, ended)


def _in_order_of(objective: Objective, solution: Solution, searched: CandidateObjective) -> Search | None:
    """A search with its variables in the order of an objective; None if they are not the same."""
    search, names = solution.search, solution.free
    if set(names) != set(objective.free):
        return None
    scale = searched.scale_of(objective.free)
    fields = (field.name for field in dataclasses.fields(scale))
    if not all(np.array_equal(getattr(scale, name), getattr(objective.scale, name)) for name in fields):
        return None
    order = [names.index(name) for name in objective.free]
    end = search.derivatives
    return dataclasses.replace(
        search,
        start=search.start[order],
        unit=search.unit[order],
        triangle=np.linalg.qr(end.triangle[:, order])[1],
        gradient=end.gradient[order],
        path=dataclasses.replace(search.path, unit=search.path.unit[:, order]),
    )


def estimates_of(model: FittedModel) -> NamedRows[Estimate]:
    """Free parameters of a model with their standard errors from noise."""
    return NamedRows(estimates(model.objective, model.solution))


def misfit_errors(model: FittedModel, points: Points, smooth: SmoothPart) -> dict[str, float | None]:
    """Standard deviation of the bias of each parameter due to the smooth part of the misfit."""
    if smooth.p_value > model.problem.screen_options.level:
        return {name: 0.0 for name in model.free}
    shifts = misfit_deviation(smooth, model.jacobian, points, at_bound=model.at_bound)
    return {name: finite(shift) for name, shift in zip(model.free, shifts.tolist(), strict=True)}


def undetermined_parameters(model: FittedModel, shifts: dict[str, float | None]) -> tuple[str, ...]:
    """Parameters at a bound, or that misfit and noise may have moved to a bound."""
    names, coverage = [], model.problem.policy.coverage_errors
    for name, (value, error) in estimates_of(model).items():
        term, misfit = model.objective.terms[name], shifts[name]
        room = min(value - term.minimum, term.maximum - value)
        if misfit is None or error is None or coverage * np.hypot(misfit, error) >= room:
            names.append(name)
    return tuple(names)


def shape_of(model: FittedModel, structured: float | None = None) -> ResidualShape:
    """Shape of a model's residual, orthogonal to its free parameters; `structured` as in `residual_shape`."""
    return residual_shape(residual_points(model), model.projection.basis, structured)


def residual_points(model: FittedModel) -> ResidualPoints:
    """The residual of a model, point by point."""
    problem = model.problem
    return ResidualPoints.of(
        problem.data,
        model.solution.predicted_per_sr,
        problem.noise.sigma_per_sr,
        problem.noise.scan_relative,
        model.residual,
        model.objective.weight,
    )


def overlaps_with(shape: ResidualShape, found: SearchResult) -> dict[str, float]:
    """Overlap of each effect that was not accepted with the shape, the largest first.

    An overlap is the cosine between both after the projection off the free parameters: of the setting of the
    effect at which it is largest, and of its sign if it has only one. Empty if the last model was not
    screened.
    """
    screen = found.screens[-1] if found.screens else None
    if screen is None or screen.model is not found.last:
        return {}
    overlaps = {}
    for name, directions in screen.directions.items():
        cosines = [shape.overlap(found.last.projection.remove(d.column)) for d in directions]
        overlaps[name] = max(cosines, key=abs if directions[0].effect.may_be_negative else float)
    return dict(sorted(overlaps.items(), key=lambda item: -abs(item[1])))


def explains_all(mistakes: Sequence[Mistake], policy: SearchPolicy) -> bool:
    """Whether a mistake without any free parameter leaves so little that no effect need be looked for."""
    return any(
        mistake.is_named
        and mistake.reduced_chi_square is not None
        and mistake.reduced_chi_square <= policy.enough_reduced_chi_square
        for mistake in mistakes
    )


def beside_mistakes(verdict: Verdict, declared: FitResult, after: Figures, policy: SearchPolicy) -> Verdict:
    """The verdict on effects, or that the input has a mistake if no effect explains the data as well.

    Parameters
    ----------
    verdict
        From the effects alone.
    declared
        The fit of the declared model, with the mistakes that were considered.
    after
        Figures of merit with all effects.
    policy
        Thresholds.
    """
    named = [mistake for mistake in declared.mistakes if mistake.is_named]
    if not named:
        return verdict
    sentence = mistakes_sentence(tuple(declared.mistakes), declared.verdict.reduced_chi_square)
    if explains_all(named, policy):
        return Verdict(VerdictCode.INPUT_MISTAKE, (), f"{sentence} No missing effect was looked for.")
    reached = [m.reduced_chi_square for m in named if m.reduced_chi_square is not None]
    before, left = declared.verdict.reduced_chi_square, after.reduced_chi_square
    if before is not None and left is not None and verdict.effects:
        is_little = verdict.code.fits_noise or left - 1 <= policy.enough_share * (before - 1)
        if is_little and left <= min(reached, default=np.inf):
            also = " ".join(f"{mistake.statement}." for mistake in named)
            sentence = f"{verdict.sentence} A mistake in the input was considered, too: {also}"
            return dataclasses.replace(verdict, sentence=sentence)
    return Verdict(VerdictCode.INPUT_MISTAKE, (), f"{sentence} No effect explains the data as well.")
