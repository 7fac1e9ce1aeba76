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
from jaxink.fitting.gradient import GradientSearch, starts, together
from jaxink.fitting.joint_objective import FitObjective, JointObjective, compile_objective
from jaxink.fitting.limits import Budget
from jaxink.fitting.many import searches_at_once
from jaxink.fitting.method import Method, search
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Outcome, Search
from jaxink.fitting.scanning import DIRECT_JACOBIANS, RANKING_DECREMENT, Scan, scan
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
# Values of the radius and of the index. A grid of 12 by 5 misses minima that one of 16 by 6 finds.
_SHAPE = (16, 6)
_HELD_JACOBIANS, _RELEASED_JACOBIANS = 4, 8
# Fraction of the fits at grid points, lowest first, that are continued with all parameters free.
_RELEASED = 1 / 3
# This many are run to convergence: the lowest minimum, and the rivals that a result lists.
_KEPT = 8
# Of ends that are closer in both unit variables, the lowest one is searched.
_SAME = 0.04


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
    searches, scans, endings = _search(objective, free, options, budget, progress)
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
    found = Found(best, errors, tuple(searches), scans, endings)
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
    """Search from several starts: the searches; the scan, if any, as one; and where everything ended."""
    first = objective.scale.to_unit(np.array([p.value for p in free]))
    points, scans = starts(first, options.starts, options.seed), tuple[Search, ...]()
    endings, n_scanned = list[Ending](), 0
    made = scan_of(objective, free, first, _named(progress, "scan"), budget) if options.scans_first else None
    if made is not None:
        points, scans, n_scanned = made.starts + points[1:], (made.whole,), len(made.starts)
        endings.append(Ending(made.direct, is_start=True))
        endings += [Ending(passed, scanned=made.distances) for passed in made.minima]
    programs, searches = compile_objective(objective), list[Search]()
    declared = max(n_scanned, 1)
    at_once = _at_once(objective, options, len(points) - declared)
    for number, start in enumerate(points if at_once is None else points[:declared]):
        follow = _named(progress, f"start {number + 1}")
        method = _method(options, objective, free, start)
        searches.append(search(method, programs, start, budget, follow))
        endings.append(Ending(searches[-1], is_start=number >= n_scanned))
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
    return searches, scans, tuple(endings)


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


def scan_of(
    objective: FitObjective,
    free: Sequence[Parameter],
    first: Float[np.ndarray, " parameters"],
    progress: Callable[[int, float], None] | None = None,
    within: Budget | None = None,
) -> Scan | None:
    """The scan that an objective needs before its searches; None if no free parameter has many minima.

    Parameters
    ----------
    objective
        To be minimised.
    free
        Its free parameters.
    first
        Start values, scaled to [0, 1].
    progress
        Called with the number of the fit and the loss there.
    within
        Limits of the fit that the scan belongs to; it ends where they are reached.
    """
    position = next((i for i, p in enumerate(free) if p.multimodal), None)
    if position is None:
        return None
    engine = GradientSearch(objective)
    index = index_beside(free, position) if isinstance(objective, JointObjective) else None
    if index is None:
        return scan(engine, first, position, progress, within)
    return scan_grid(engine, first, (position, index), progress, within)


def index_beside(free: Sequence[Parameter], radius: int) -> int | None:
    """Position of the refractive index of the particles whose radius is free, if it is free, too.

    Parameters
    ----------
    free
        The free parameters.
    radius
        Position of the radius.
    """
    particles = free[radius].name.rpartition(".")[0]
    names = [parameter.name for parameter in free]
    index = f"{particles}.particle_index"
    return names.index(index) if index in names else None


def scan_grid(
    engine: GradientSearch,
    first: np.ndarray,
    positions: tuple[int, int],
    progress: Callable[[int, float], None] | None = None,
    within: Budget | None = None,
) -> Scan:
    """Find starts at the lowest minima over two parameters.

    Scattering by a sphere varies with its size and with its refractive index through their product, so that
    minima lie side by side in the plane of both; a scan along the radius, which follows one value of the
    index continuously, passes by some of them. Here each point of a grid is a start of its own, from the
    middle of all other ranges: a few steps with both parameters held, then, from the lowest third, a few
    steps of all parameters. A search from the start values comes first.

    Parameters
    ----------
    engine
        The search.
    first
        Start values, scaled to [0, 1].
    positions
        The radius and the index.
    progress
        Called with the number of the fit and the loss there.
    within
        Limits of the fit that the scan belongs to; it ends where they are reached.
    """
    every = [engine.run(first, max_jacobians=DIRECT_JACOBIANS, within=within)]
    direct = every[0]

    def run(start: np.ndarray, held: dict[int, float] | None, jacobians: int) -> Search | None:
        if within is not None and within.is_spent(min(one.loss for one in every)):
            return None
        every.append(engine.run(start, held, None, jacobians, within, RANKING_DECREMENT))
        if progress is not None:
            progress(len(every) - 1, every[-1].loss)
        return every[-1]

    sides = [np.linspace(0.0, 1.0, count).tolist() for count in _SHAPE]
    points = [dict(zip(positions, (x, y), strict=True)) for x in sides[0] for y in sides[1]]
    middle = np.full_like(first, 0.5)
    held = _by_loss([run(middle, point, _HELD_JACOBIANS) for point in points])
    best = held[: round(len(points) * _RELEASED)]
    ends = _apart(_by_loss([direct, *(run(one.unit, None, _RELEASED_JACOBIANS) for one in best)]), positions)
    whole = together("scan", every, ends[0] if ends else direct)
    # Along a valley, other ends need not be separate minima: only a full search can tell.
    return Scan([one.unit for one in ends[:_KEPT]] or [direct.unit], whole, direct, (), {})


def _by_loss(found: Sequence[Search | None]) -> list[Search]:
    finite = [one for one in found if one is not None and np.isfinite(one.loss)]
    return sorted(finite, key=lambda one: one.loss)


def _apart(ends: Sequence[Search], positions: tuple[int, int]) -> list[Search]:
    """The lowest one of each group of ends that are close to each other."""
    chosen = list[Search]()
    for end in ends:
        here = end.unit[list(positions)]
        if all(np.max(np.abs(here - other.unit[list(positions)])) >= _SAME for other in chosen):
            chosen.append(end)
    return chosen
