"""The searches of a fit: several starts, refinement of the resolution, and profiles."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError, no_such_name
from jaxink.fitting.assembly import Found
from jaxink.fitting.comparison_methods import Simplex
from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.endings import Ending
from jaxink.fitting.fit_objective import FitObjective, compile_objective
from jaxink.fitting.gradient import GradientSearch, starts, together
from jaxink.fitting.joint_objective import JointObjective
from jaxink.fitting.limits import Budget
from jaxink.fitting.many import searches_at_once
from jaxink.fitting.method import Method, search
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Outcome, Search
from jaxink.fitting.sweep import sweep_of
from jaxink.fitting.uncertainty import Covariance, Profile, covariance, profile
from jaxink.numerics.progress import Progress, StepOf
from jaxink.sample import Parameter

# A parameter is profiled if its standard error exceeds this fraction of its range, or a correlation this.
_WIDE = 0.1
_CORRELATED = 0.98
# If more qualify, only the least well determined are profiled unless all are asked for.
_MOST_PROFILES = 6
# A search along a profile that ends this much lower in chi-square has found a lower minimum.
_LOWER = 1e-3
_MOST_LOWER_MINIMA = 3
# The resolution converges after one refinement, unless the solution moves far.
_MOST_REFINEMENTS = 2
# Stacks of all searches that an accelerator makes at once.
_STACKS_AT_ONCE = 1024


def minimise(
    objective_at: Callable[[Any], FitObjective],
    free: Sequence[Parameter],
    options: FitOptions,
    progress: Progress,
) -> tuple[FitObjective, Found]:
    """Minimise an objective by the searches that the options ask for.

    Parameters
    ----------
    objective_at
        The objective at a resolution of the solver; None: the one that the accuracy requires at the start.
    free
        The free parameters, in the order of its variables.
    options
        Of the fit.
    progress
        Called with the task, the step and the loss.

    Returns
    -------
    tuple
        The objective at the final resolution, and what was found.

    Raises
    ------
    InputRefusedError
        The model is not finite at the start.
    """
    objective = objective_at(options.config)
    budget = Budget(options.limits(objective.n_points))
    searches, sweeps, endings = _search(objective, free, options, budget, progress)
    best = ended = _lowest(searches, free)
    shift = 0.0
    for _ in range(_MOST_REFINEMENTS):
        resolution = _finer(objective, best, options)
        if resolution is None or budget.is_spent(best.loss):
            break
        objective = objective_at(resolution)
        method, follow = options.make_method().near_solution, _named(progress, "refinement")
        refined = _lowest([search(method, compile_objective(objective), best.unit, budget, follow)], free)
        best, shift = refined, shift + refined.loss - best.loss
        searches.append(best)
    # A search that stopped at its goal is not at a minimum, and has no meaningful covariance.
    at_minimum = best.outcome is not Outcome.GOAL
    errors = _covariance(best) if options.objective == "chi_square" and at_minimum else None
    # The best ending as refined; the others are as far from it as they were at their own resolution.
    endings = tuple(
        dataclasses.replace(e, search=best) if e.search is ended else dataclasses.replace(e, shift=shift)
        for e in endings
    )
    found = Found(best, errors, tuple(searches), sweeps, endings)
    # A search that was stopped by a limit has no minimum to follow chi-square from.
    if errors is not None and options.profile != "none" and best.outcome.converged:
        found = _with_profiles(GradientSearch(objective), objective.free, found, options.profile, progress)
    return objective, found


def _finer(objective: FitObjective, best: Search, options: FitOptions) -> Any:
    """Resolution needed at the solution, if it exceeds that of the fit."""
    if options.config is not None:
        return None
    values = objective.numbers(best.unit)
    asked = objective.resolution_at(values, options.accuracy, options.layer_method)
    return None if asked == objective.resolution else asked


def _search(
    objective: FitObjective,
    free: Sequence[Parameter],
    options: FitOptions,
    budget: Budget,
    progress: Progress,
) -> tuple[list[Search], tuple[Search, ...], tuple[Ending, ...]]:
    """Search from several starts: the searches; the sweep, if any, as one; and where everything ended."""
    first = objective.scale.to_unit(np.array([p.value for p in free]))
    points, sweeps = starts(first, options.starts, options.seed), tuple[Search, ...]()
    endings, n_swept = list[Ending](), 0
    made = sweep_of(objective, free, first, _named(progress, "scan"), budget) if options.scans_first else None
    if made is not None:
        points, sweeps, n_swept = made.starts + points[1:], (made.whole,), len(made.starts)
        endings.append(Ending(made.direct, is_start=True))
        endings += [Ending(passed, swept=made.distances) for passed in made.minima]
    programs, searches = compile_objective(objective), list[Search]()
    declared = max(n_swept, 1)
    at_once = _at_once(objective, options, len(points) - declared)
    for number, start in enumerate(points if at_once is None else points[:declared]):
        follow = _named(progress, f"start {number + 1}")
        method = _method(options, objective, free, start)
        searches.append(search(method, programs, start, budget, follow))
        endings.append(Ending(searches[-1], is_start=number >= n_swept))
        if budget.is_spent(searches[-1].loss):
            break
    if at_once is not None and isinstance(programs, CompiledObjective):
        follow = _named(progress, "random starts")
        many = searches_at_once(programs, points[declared:], at_once, progress=follow)
        endings += [Ending(found, is_start=True) for found in many]
        searches += many
        best = _lowest(searches, free)
        if any(best is found for found in many):
            # The method itself finishes, because it can leave bounds far from the minimum.
            searches.append(search(options.make_method(), programs, best.unit, budget, follow))
            endings.append(Ending(searches[-1]))
    return searches, sweeps, tuple(endings)


def _method(
    options: FitOptions,
    objective: FitObjective,
    free: Sequence[Parameter],
    start: Float[np.ndarray, " parameters"],
) -> Method:
    """The method of a search from a start; of a simplex with the first steps that are asked for."""
    method = options.make_method()
    if not (options.simplex_steps and isinstance(method, Simplex)):
        return method
    names = [p.name for p in free]
    for name in options.simplex_steps:
        if name not in names:
            raise InputRefusedError(f"simplex_steps names the free parameter '{name}', {no_such_name(names)}")
    corner = objective.scale.to_physical(start)
    for i, p in enumerate(free):
        step = options.simplex_steps.get(p.name, 0.0)
        outside = corner[i] + step > p.maximum
        corner[i] = max(corner[i] - step, p.minimum) if outside else corner[i] + step
    steps = objective.scale.to_unit(corner) - start
    given = [p.name in options.simplex_steps for p in free]
    return dataclasses.replace(method, steps=tuple(np.where(given, steps, 0.0).tolist()))


def _at_once(objective: FitObjective, options: FitOptions, n_random: int) -> int | None:
    """How many searches from random starts run at once; None: one after the other."""
    if isinstance(objective, JointObjective):
        return None
    limits = options.limits(objective.n_points)
    if options.method != "gradient" or not limits.is_open or limits.goal_loss is not None or n_random < 2:
        return None
    # Nothing is gained on a CPU: a batch takes as long as its members, and its program half a minute.
    if jax.default_backend() == "cpu":
        return None
    return min(max(_STACKS_AT_ONCE // objective.n_stacks, 1), n_random)


def _lowest(searches: list[Search], free: Sequence[Parameter]) -> Search:
    best = min(searches, key=lambda s: s.loss if np.isfinite(s.loss) else np.inf)
    if not np.isfinite(best.loss):
        raise InputRefusedError(
            "the model is not finite at the start values: "
            + ", ".join(f"{p.name} = {p.value:g}" for p in free)
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
    """Parameters whose profiles are computed, in their order, and weak ones left out to save time."""
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
