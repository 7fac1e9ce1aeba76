"""Fit a sample to a measurement: several starts, refinement of the resolution, and profiles."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import jax
import numpy as np

from jaxink.effects import Scene, settled
from jaxink.errors import InputRefusedError, require_kind
from jaxink.fitting.assembly import Found, assemble
from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.endings import Ending
from jaxink.fitting.gradient import GradientSearch, starts, together
from jaxink.fitting.inputs import prepare_data, read_inputs
from jaxink.fitting.limits import Budget
from jaxink.fitting.many import searches_at_once
from jaxink.fitting.method import search
from jaxink.fitting.objective import Objective, make_objective
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Outcome, Search
from jaxink.fitting.result import FitResult
from jaxink.fitting.scanning import scan
from jaxink.fitting.uncertainty import Covariance, Profile, covariance, profile
from jaxink.measurement import GonioData, noise_of
from jaxink.numerics.precision import computing, release_programs
from jaxink.numerics.progress import Progress, StepOf, log_progress
from jaxink.sample import Sample
from jaxink.solver.config import SolverConfig

# A profile is computed for a larger standard error, as a share of the range, or a larger correlation.
_WIDE = 0.1
_CORRELATED = 0.98
# Of more parameters than this, only the weakest are followed unless all are asked for.
_MOST_PROFILES = 6
# A search along a profile that ends this much lower in chi-square has found a lower minimum.
_LOWER = 1e-3
_MOST_LOWER_MINIMA = 3
# The resolution converges after one refinement, unless the solution moves far.
_MOST_REFINEMENTS = 2
# Stacks of all searches that an accelerator makes at once.
_STACKS_AT_ONCE = 1024


def fit(
    data: GonioData | str | Path | Sequence[str | Path],
    sample: Sample | str | Path,
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> FitResult:
    """Fit the free parameters of a sample to a measurement.

    Computes with 64 bits whatever the session's setting, which is restored.

    Parameters
    ----------
    data
        Measurement, its file, or a list of files, whose rows are joined.
    sample
        Sample, or its file.
    options
        None for the defaults.
    progress
        Called with the task, the step and the loss.

    Raises
    ------
    InputRefusedError
        Data or sample are invalid.
    """
    options = FitOptions() if options is None else options
    require_kind("options", options, FitOptions)
    data, sample = read_inputs(data, sample)
    data = prepare_data(data, sample)
    release_programs()
    with computing():
        return _fit(data, sample, options, progress or log_progress)


def _fit(data: GonioData, sample: Sample, options: FitOptions, progress: Progress) -> FitResult:
    noise = noise_of(data, sample.noise)
    if options.objective == "chi_square" and not noise.known:
        raise InputRefusedError(
            f"{data.source or 'the measurement'}: its noise is {noise.origin} Declare it in [noise] of the "
            "sample file, or choose another objective."
        )
    if sample.effects:
        used = data.used
        scene = Scene.of(*data.used_directions, row=data.reading_order[used])
        sample = settled(sample, scene, data.bsdf_per_sr[used])
    scans_first = options.scans_first and any(p.multimodal for p in sample.parameters.free)

    def objective_at(config: SolverConfig | None) -> Objective:
        how = options.accuracy, options.layer_method
        made = make_objective(data, sample, options.objective, config, noise, *how)
        return made.tabulated() if scans_first else made

    objective = objective_at(options.config)
    budget = Budget(options.limits(len(objective.measured)))
    searches, scans, endings = _search(objective, sample, options, budget, progress)
    best = ended = _lowest(searches, sample)
    shift = 0.0
    for _ in range(_MOST_REFINEMENTS):
        config = _larger_sizes(objective, best, options)
        if config is None or budget.is_spent(best.loss):
            break
        objective = objective_at(config)
        method, follow = options.make_method().near_solution, _named(progress, "refinement")
        refined = _lowest([search(method, CompiledObjective(objective), best.unit, budget, follow)], sample)
        best, shift = refined, shift + refined.loss - best.loss
        searches.append(best)
    # At a goal, which is no minimum, the covariance says nothing about the distance from one.
    at_minimum = best.outcome is not Outcome.GOAL
    errors = _covariance(best) if options.objective == "chi_square" and at_minimum else None
    # The best ending as refined; the others are as far from it as they were at their own resolution.
    endings = tuple(
        dataclasses.replace(e, search=best) if e.search is ended else dataclasses.replace(e, shift=shift)
        for e in endings
    )
    found = Found(best, errors, tuple(searches), scans, endings)
    # A search that a limit ended has no minimum to follow chi-square from.
    if errors is not None and options.profile != "none" and best.outcome.converged:
        found = _with_profiles(GradientSearch(objective), objective.free, found, options.profile, progress)
    return assemble(data, sample, options, noise, objective, found)


def _larger_sizes(objective: Objective, best: Search, options: FitOptions) -> SolverConfig | None:
    """Resolution needed at the solution, if it exceeds that of the fit."""
    if options.config is not None:
        return None
    model = objective.model
    used, values = model.config, objective.numbers(best.unit)
    asked = used.at_least(model.sizes(values, options.accuracy, options.layer_method))
    return None if asked == used else asked


def _search(
    objective: Objective, sample: Sample, options: FitOptions, budget: Budget, progress: Progress
) -> tuple[list[Search], tuple[Search, ...], tuple[Ending, ...]]:
    """Search from several starts: the searches; the scan, if any, as one; and where everything ended."""
    free = sample.parameters.free
    first = objective.scale.to_unit(np.array([p.value for p in free]))
    points, scans = starts(first, options.starts, options.seed), tuple[Search, ...]()
    endings, n_scanned = list[Ending](), 0
    rugged = [i for i, p in enumerate(free) if p.multimodal]
    if rugged and options.scans_first:
        position = rugged[0]
        made = scan(GradientSearch(objective), first, position, _named(progress, "scan"), budget)
        points, scans, n_scanned = made.starts + points[1:], (made.whole,), len(made.starts)
        endings.append(Ending(made.direct, is_start=True))
        endings += [Ending(passed, scanned=(position, made.distance)) for passed in made.minima]
    compiled, searches = CompiledObjective(objective), list[Search]()
    declared = max(n_scanned, 1)
    at_once = _at_once(objective, options, len(points) - declared)
    for number, start in enumerate(points if at_once is None else points[:declared]):
        follow = _named(progress, f"start {number + 1}")
        searches.append(search(options.make_method(), compiled, start, budget, follow))
        endings.append(Ending(searches[-1], is_start=number >= n_scanned))
        if budget.is_spent(searches[-1].loss):
            break
    if at_once is not None:
        follow = _named(progress, "random starts")
        many = searches_at_once(compiled, points[declared:], at_once, progress=follow)
        endings += [Ending(found, is_start=True) for found in many]
        searches += many
        best = _lowest(searches, sample)
        if any(best is found for found in many):
            # The method itself, which leaves bounds far from the minimum, has the last word.
            searches.append(search(options.make_method(), compiled, best.unit, budget, follow))
            endings.append(Ending(searches[-1]))
    return searches, scans, tuple(endings)


def _at_once(objective: Objective, options: FitOptions, n_random: int) -> int | None:
    """How many searches from random starts run at once; None: one after the other."""
    limits = options.limits(len(objective.measured))
    if options.method != "gradient" or not limits.is_open or limits.goal_loss is not None or n_random < 2:
        return None
    # Nothing is gained on a processor: a batch takes as long as its members, and its program half a minute.
    if jax.default_backend() == "cpu":
        return None
    return min(max(_STACKS_AT_ONCE // objective.model.n_stacks, 1), n_random)


def _lowest(searches: list[Search], sample: Sample) -> Search:
    best = min(searches, key=lambda s: s.loss if np.isfinite(s.loss) else np.inf)
    if not np.isfinite(best.loss):
        raise InputRefusedError(
            "the model is not finite at the start values: "
            + ", ".join(f"{p.name} = {p.value:g}" for p in sample.parameters.free)
            + "; start elsewhere."
        )
    return best


def _named(progress: Progress, what: str) -> Callable[[int, float], None]:
    return lambda step, loss: progress(what, step, loss)


def _covariance(best: Search) -> Covariance | None:
    if best.triangle is None or best.gradient is None:
        return None
    return covariance(best.triangle, best.unit, best.gradient)


def _with_profiles(
    engine: GradientSearch, free: tuple[str, ...], found: Found, which: str, progress: Progress
) -> Found:
    """Profiles of the weakest parameters, or of all; repeated if one of them finds a lower minimum."""
    along: list[Search] = []
    for _ in range(_MOST_LOWER_MINIMA):
        followed, others = _to_follow(found.errors, which)
        profiles = _profiles(engine, found, followed, free, progress)
        here = [search for one in profiles for search in one.searches]
        along += here
        lower = [search for search in here if search.loss < found.best.loss - _LOWER]
        if not lower:
            break
        improved: Search | None = None
        with found.failures.sparing("the search for the minimum near a profile", ""):
            improved = engine.run(min(lower, key=lambda s: s.loss).unit)
        if improved is None:
            break
        found = dataclasses.replace(found, searches=(*found.searches, improved))
        if improved.loss >= found.best.loss:
            break
        endings = *found.endings, Ending(found.best)
        found = dataclasses.replace(found, best=improved, errors=_covariance(improved), endings=endings)
    series = (together("profile", along, found.best),) if along else ()
    return dataclasses.replace(
        found, profiles=profiles, n_not_profiled=len(others), series=(*found.series, *series)
    )


def _profiles(
    engine: GradientSearch, found: Found, followed: Sequence[int], free: tuple[str, ...], progress: Progress
) -> tuple[Profile, ...]:
    profiles, errors = [], found.errors
    if errors is None:
        return ()
    for number, position in enumerate(followed, 1):
        progress(f"profile of {free[position]}", StepOf(number, len(followed)), found.best.loss)
        with found.failures.sparing("the profile of {}", free[position]):
            profiles.append(profile(engine, found.best, position, errors.deviation[position]))
    return tuple(profiles)


def _to_follow(errors: Covariance | None, which: str) -> tuple[list[int], list[int]]:
    """Parameters whose profiles are computed, in their order, and weak ones for which that would be long."""
    if errors is None:
        return [], []
    if which == "all":
        return list(range(len(errors.held))), []
    weakness = [_weakness(errors, position) for position in range(len(errors.held))]
    weak = sorted((i for i, w in enumerate(weakness) if w > 1), key=lambda i: (-weakness[i], i))
    return sorted(weak[:_MOST_PROFILES]), sorted(weak[_MOST_PROFILES:])


def _weakness(errors: Covariance, position: int) -> float:
    """How far a parameter is from being well determined by the covariance: weak above 1."""
    deviation = errors.deviation[position]
    if errors.held[position] or not np.isfinite(deviation):
        return np.inf
    others = np.abs(np.delete(errors.correlation[position], position))
    apart = 1 - np.max(others, initial=0.0, where=np.isfinite(others))
    return float(max(deviation / _WIDE, (1 - _CORRELATED) / max(apart, np.finfo(float).tiny)))
