"""One stage of a diagnosis: a model with the effects found so far, its screen, and refits of candidates."""

import dataclasses
import logging
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.diagnosis.candidate import Candidate, ScreenOptions, ScreenResult
from jaxink.diagnosis.screen import screen
from jaxink.diagnosis.workbench import Solution, Workbench
from jaxink.effects import AreaWithOtherValues, Case, Effect, Listed, Scene, effects_for, extend, undivided
from jaxink.fitting.uncertainty import covariance
from jaxink.measurement import FitNoise, GonioData
from jaxink.numerics.precision import computing, release_programs
from jaxink.sample import Sample
from jaxink.solver.accuracy import DEFAULT_ACCURACY
from jaxink.solver.stack import SolverConfig

_LOG = logging.getLogger("jaxink")
# Slots beyond those of the declared sample's free parameters, so that all stages share a program.
_FURTHER_SLOTS = 6
# Programs that are compiled at a time.
_COMPILING = 2
# A parameter nearer than this many standard errors to its bound may sit on it.
_NEAR_BOUND = 1e-6
# Reduced chi-square from which the parameters of the fit may be far from those of a better model.
FAR = 3.0
# Multiples of a linear detection limit at which refits see whether it holds, the largest first.
_MULTIPLES = (16.0, 8.0, 4.0, 2.0)
# Refits, and predicted falls, that differ by less in chi-square are not told apart.
TOLD_APART = 4.0
# Relative difference up to which two programs compute the same model.
_SAME = 1e-2
# Changes of all points together, in units of the noise, that rounding makes.
_ROUNDING = 1e-6
# Settings from which a refit starts, the most promising ones, and Jacobians of each start.
_STARTS, _QUICK = 2, 12


@dataclasses.dataclass(frozen=True)
class Setup:
    """What all stages share.

    Parameters
    ----------
    sample, data, noise, config, scene
        The declared sample, its measurement, and the sizes of the discretisation.
    catalogue
        Classes of effects.
    options
        Of the screen.
    accuracy
        Of the discretisation.
    """

    sample: Sample
    data: GonioData
    noise: FitNoise
    config: SolverConfig
    scene: Scene
    catalogue: tuple[type[Effect], ...]
    options: ScreenOptions
    accuracy: float = DEFAULT_ACCURACY

    def bench(self, effects: tuple[Effect, ...], n_slots: int) -> Workbench:
        """A workbench of the sample with some effects, which act in the order of the catalogue."""
        names = [effect.name for effect in self.catalogue]
        effects = tuple(sorted(effects, key=lambda e: (names.index(e.name), str(e))))
        return Workbench(self.sample, effects, self.data, self.noise, self.config, self.scene, n_slots)

    def listed(self, accepted: tuple[Effect, ...]) -> Listed:
        """Effects that the sample may lack beside some."""
        names = {effect.name for effect in accepted}
        rest = tuple(c for c in self.catalogue if c.name not in names)
        relative = float(np.min(self.noise.sigma_per_sr / np.abs(self.data.bsdf_per_sr[self.data.used])))
        # What divides a layer acts last: for all others the layer is one.
        whole = extend(self.sample, undivided(accepted))
        return effects_for(Case(whole, self.scene, relative, self.accuracy), rest)

    def shared_bench(self, accepted: tuple[Effect, ...], listed: Listed) -> Workbench:
        """The workbench of all effects that need no program of their own."""
        inside = tuple(e for e in listed.forms if not e.own_program)
        n_accepted = sum(len(e.terms) for e in accepted)
        most = max((len(e.terms) for e in inside), default=1)
        n_slots = len(self.sample.parameters.free) + max(_FURTHER_SLOTS, n_accepted + most)
        return self.bench(accepted + inside, n_slots)


@dataclasses.dataclass(frozen=True)
class Direction:
    """One way in which an effect may be present: a column of the screen.

    Parameters
    ----------
    effect
        The form.
    setting
        Values of its parameters there.
    column
        Whitened change of the prediction by a strength of one.
    largest
        Largest strength in the unit of the column.
    """

    effect: Effect
    setting: dict[str, float]
    column: Float[np.ndarray, " rows"]
    largest: float

    @property
    def column_strength(self) -> float:
        """Strength that the column stands for, in `unit`; 1 for a share of the area."""
        here = self.setting.get(self.effect.strength.name)
        return abs(here - self.effect.neutral) if here is not None and self.effect.scales else 1.0

    @property
    def unit(self) -> str:
        """What strengths of a screen are told in: the effect's own unit, or a share of the area."""
        is_share = self.effect.strength.name in self.setting and not self.effect.scales
        return "share" if is_share else self.effect.strength.unit

    def without_rounding(self) -> "Direction":
        """The direction, of no length where all that the effect can change is rounding."""
        if np.linalg.norm(self.column) * self.largest <= _ROUNDING:
            return dataclasses.replace(self, column=np.zeros_like(self.column))
        return self

    def reachable_drop(self, z: float, norm: float) -> float:
        """Fall of chi-square by a strength within its range, in the linear approximation."""
        if z <= 0 and self.effect.sign == 1:
            return 0.0
        step = min(abs(z) / norm, self.largest) * norm
        return 2 * step * abs(z) - step**2


@dataclasses.dataclass(frozen=True)
class Refit:
    """A candidate fitted with all other parameters.

    Parameters
    ----------
    effect
        The form that fits best.
    solution
        Where it ended.
    bench
        The workbench that it was fitted on.
    drop
        Fall of chi-square.
    """

    effect: Effect
    solution: Solution
    bench: Workbench
    drop: float

    @property
    def strength(self) -> float:
        """Strength: distance of the first term from the declared model."""
        return self.solution.values[self.effect.strength.name] - self.effect.neutral

    def penalised(self, n_points: int) -> float:
        """Fall of chi-square less what its number of terms costs (Schwarz 1978)."""
        return self.drop - len(self.effect.terms) * np.log(n_points)

    def is_like(self, other: "Refit", n_points: int) -> bool:
        """Whether the data do not tell two candidates apart, their terms being paid for or not.

        One of more terms that fits as well is not preferred, but neither is it refuted.
        """
        paid = self.penalised(n_points) - other.penalised(n_points)
        return bool(min(abs(paid), abs(self.drop - other.drop)) < TOLD_APART)

    def deviations(self) -> dict[str, float]:
        """Standard error of each free parameter; infinite where the data say nothing, nan on a bound."""
        return deviations(self.bench, self.solution)


def deviations(bench: Workbench, solution: Solution) -> dict[str, float]:
    """Standard error of each free parameter of a solution; nan where a bound holds it."""
    n = len(solution.free)
    search = solution.search
    spread = covariance(search.triangle[:, :n], search.unit[:n], search.gradient[:n])
    slope = bench.scale_of(solution.free).slope(search.unit[:n])
    sigma = np.where(spread.held, np.nan, spread.deviation * np.abs(slope))
    return dict(zip(solution.free, sigma.tolist(), strict=True))


def finite(error: float) -> float | None:
    """A standard error as reports have it: None where the data say nothing or a bound holds the value."""
    return error if np.isfinite(error) else None


class Stage:
    """The model with the effects that were found so far.

    Parameters
    ----------
    setup
        What all stages share.
    accepted
        Effects found so far.
    values
        Where to start the fit.
    """

    def __init__(self, setup: Setup, accepted: tuple[Effect, ...], values: dict[str, float]):
        self.setup, self.accepted = setup, accepted
        self.listed: Listed = setup.listed(accepted)
        self.bench = setup.shared_bench(accepted, self.listed)
        self.free = self.bench.base_free + tuple(t.name for e in accepted for t in e.terms)
        self._own: dict[str, Workbench] = {}
        self._refits: dict[Effect, Refit] = {}
        self.solution, self._made = self._fitted(values)
        self.jacobian, self.residual = self.bench.jacobian(self.solution.values, self.free)

    @cached_property
    def at_bound(self) -> Int[np.ndarray, " parameters"]:
        """-1, 0 or 1 for each free parameter, as the screen asks."""
        n = len(self.free)
        unit = self.solution.search.unit[:n]
        sigma = np.sqrt(np.diag(np.linalg.pinv(self._information(), hermitian=True)))
        near = np.minimum(sigma, 0.25)
        return np.where(unit <= near * _NEAR_BOUND, -1, np.where(unit >= 1 - near * _NEAR_BOUND, 1, 0))

    def _information(self):
        n = len(self.free)
        triangle = self.solution.search.triangle[:, :n]
        return triangle.T @ triangle

    @cached_property
    def base(self) -> Float[np.ndarray, "rows directions"]:
        """Orthonormal directions that the free parameters imitate, those on a bound excepted."""
        inside = self.jacobian[:, self.at_bound == 0]
        norms = np.linalg.norm(inside, axis=0)
        left, singular, _ = np.linalg.svd(inside / np.where(norms > 0, norms, 1.0), full_matrices=False)
        return left[:, singular > 1e-9 * singular[0]] if singular.size else left

    def own_bench(self, effect: Effect) -> Workbench:
        """Workbench of an effect that changes the structure, without the other candidates."""
        if effect.program not in self._own:
            together = tuple(e for e in self.listed.forms if e.own_program and e.program == effect.program)
            n_slots = len(self.free) + max(len(e.terms) for e in together)
            self._own[effect.program] = self.setup.bench((*self.accepted, *together), n_slots)
        return self._own[effect.program]

    def release(self) -> None:
        """Hold the compiled programs of a stage that is left no more."""
        for bench in (self.bench, *self._own.values()):
            bench.release()
        release_programs()

    def directions(self, with_own: bool = True) -> dict[str, list[Direction]]:
        """Columns of all forms at all their settings, by name.

        Parameters
        ----------
        with_own
            False leaves out effects with a program of their own.
        """
        by_name: dict[str, list[Direction]] = {}
        for direction in [*self._tangents(), *(self._all_secants() if with_own else ())]:
            by_name.setdefault(direction.effect.name, []).append(direction.without_rounding())
        return by_name

    def _tangents(self) -> list[Direction]:
        """Columns of the forms that share the program."""
        found = []
        inside = [e for e in self.listed.forms if not e.own_program]
        # Settings of one rank at a time: effects do not touch each other while their strengths are zero.
        for rank in range(max((len(e.settings) for e in inside), default=0)):
            here = [e for e in inside if rank < len(e.settings)]
            values = dict(self.solution.values)
            for effect in here:
                values |= effect.settings[rank]
            names = tuple(dict.fromkeys(e.strength.name for e in here))
            columns, _ = self.bench.jacobian(values, self.free + names)
            for effect in here:
                column = columns[:, len(self.free) + names.index(effect.strength.name)]
                span = max(effect.strength.maximum - effect.neutral, effect.neutral - effect.strength.minimum)
                found.append(Direction(effect, effect.settings[rank], column, span))
        return found

    def _programs(self) -> dict[str, list[Effect]]:
        """Screened effects with programs of their own, by program."""
        own = [e for e in self.listed.forms if e.own_program and e.is_screened]
        programs = {effect.program: [e for e in own if e.program == effect.program] for effect in own}
        # Neighbours in the catalogue share tables: not at the same time, or one waits for the other.
        names = [*programs]
        return {name: programs[name] for name in [*names[::2], *names[1::2]]}

    def _fitted(self, values: dict[str, float]) -> tuple[Solution, dict[str, Future]]:
        """The fit, and programs that the screen will need: they are made while its own is compiled."""

        def make(effects):
            with jax.enable_x64(True):
                self.own_bench(effects[0]).predict(values)

        # A later model may leave nothing to look for.
        programs = {} if self.accepted else self._programs()
        pool = ThreadPoolExecutor(1)
        made = {
            name: pool.submit(make, effects)
            for name, effects in programs.items()
            if not isinstance(effects[0], AreaWithOtherValues)
        }
        try:
            return self.bench.fit(values, self.free), made
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def _all_secants(self) -> list[Direction]:
        programs = self._programs()

        def of(program):
            made = self._made.get(program)
            if made is not None and not made.cancelled():
                made.result()
            return [direction for effect in programs[program] for direction in self._secants(effect)]

        return [direction for directions in in_threads(of, programs) for direction in directions]

    def _secants(self, effect: Effect) -> list[Direction]:
        """Differences between the model with the effect at its settings and without it."""
        mixes = isinstance(effect, AreaWithOtherValues)
        shared = self.bench if mixes else self.own_bench(effect)
        found = []
        for setting in effect.settings:
            values = self.solution.values | setting
            if mixes:
                predicted, there = self.solution.predicted_per_sr, 0.0
                for share, other in effect.mixture(values):
                    there = there + share * (shared.predict(values | other) - predicted)
                change = there
            else:
                change = shared.predict(values) - self.solution.predicted_per_sr
            column = self.bench.whiten(self.solution.predicted_per_sr, np.asarray(change))
            found.append(Direction(effect, setting, column, effect.largest_share(setting)))
        return found

    def screened(self, directions: dict[str, list[Direction]]) -> ScreenResult:
        """Score of every effect whose directions are given."""
        candidates = [
            Candidate(name, np.stack([d.column for d in found], axis=1), found[0].effect.sign)
            for name, found in directions.items()
        ]
        return screen(
            self.residual, self.jacobian, candidates, at_bound=self.at_bound, options=self.setup.options
        )

    def promise(self, directions: list[Direction]) -> float:
        """Largest fall of chi-square that any way of being present promises, within its range."""
        falls = [0.0]
        for direction in directions:
            z, norm = self._score(direction)
            if norm > 1e-9 * max(float(np.linalg.norm(direction.column)), 1e-300):
                falls.append(direction.reachable_drop(z, norm))
        return max(falls)

    def remainder(self, column: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """What the free parameters cannot imitate of a whitened change of the prediction."""
        return column - self.base @ (self.base.T @ column)

    def _score(self, direction: Direction) -> tuple[float, float]:
        """Score and length of what the free parameters leave of a column."""
        column = self.remainder(direction.column)
        norm = float(np.linalg.norm(column))
        return (float(column @ self.residual) / norm if norm > 0 else 0.0), norm

    def limit_by_refits(self, direction: Direction, limit: float, critical_z: float) -> float:
        """Strength from which on refits of the model leave what a screen calls; the largest where none does.

        The limit of a screen is linear: it does not know how far the free parameters can follow an effect.

        Parameters
        ----------
        direction
            The effect.
        limit
            Detection limit of the screen, in units of the direction's column.
        critical_z
            Score that is called.

        Returns
        -------
        float
            In units of the column; at least the given limit, unless its range ends before.
        """
        effect, name = direction.effect, direction.effect.strength.name
        if isinstance(effect, AreaWithOtherValues) or not (effect.scales or name not in direction.setting):
            return limit
        bench = self.own_bench(effect) if effect.own_program else self.bench
        unit = direction.setting[name] - effect.neutral if name in direction.setting else 1.0
        terms = {t.name: t.value for t in effect.terms}

        def left_at(step):
            there = terms | self.solution.values | direction.setting | {name: effect.neutral + step * unit}
            truth = bench.predict(there)
            # To the end: what a search has not yet followed is not left.
            return self.bench.fit(self.solution.values, self.free, measured=truth).chi_square

        steps = sorted({min(factor * limit, direction.largest) for factor in _MULTIPLES}, reverse=True)
        middle = steps[len(steps) // 2]
        # A linear limit leaves the square of the multiple; half of that is near enough.
        if left_at(middle) >= (critical_z * middle / limit) ** 2 / 2:
            return limit
        seen = direction.largest
        for step in steps:
            if not left_at(step) >= critical_z**2:
                break
            seen = step
        return seen

    @property
    def is_far(self) -> bool:
        """Whether the misfit is so large that the linear screen, made where the fit ended, says little."""
        return self.solution.chi_square > FAR * len(self.residual)

    def _starts(self, settings: list[tuple]) -> list[tuple]:
        """Where refits begin: the solution, and where that is far off, the start of the declared sample."""
        base = set(self.bench.base_free)
        own = self.solution.values
        starts = [(own, setting) for setting in settings[:_STARTS]]
        if self.is_far and settings:
            declared = {name: value for name, value in self.bench.start.items() if name in base}
            starts.insert(1, (own | declared, settings[0]))
        return starts

    def polished(self, refit: Refit) -> Refit:
        """The refit, followed to its minimum."""
        if refit.solution.search.outcome.converged:
            return refit
        found = refit.bench.fit(refit.solution.values, refit.solution.free)
        done = dataclasses.replace(refit, solution=found, drop=self.solution.chi_square - found.chi_square)
        self._refits[refit.effect] = done
        return done

    def best_refit(self, directions: list[Direction]) -> Refit:
        """Refit of the form of an effect that fits best, its number of terms being paid for."""
        name = directions[0].effect.name
        found = [self.refit(form, directions) for form in self.listed.forms if form.name == name]
        return max(found, key=lambda r: r.penalised(len(self.residual)))

    def after(self, refit: Refit) -> "Stage":
        """The stage with one more effect."""
        return Stage(self.setup, (*self.accepted, refit.effect), refit.solution.values)

    def refit(self, effect: Effect, directions: list[Direction]) -> Refit:
        """Fit an effect with all other parameters, from its most promising settings."""
        if effect in self._refits:
            return self._refits[effect]
        bench = self.own_bench(effect) if effect.own_program else self.bench
        starts = []
        for direction in (d for d in directions if d.effect == effect or not effect.is_screened):
            z, norm = self._score(direction)
            if not norm > 0:
                continue
            starts.append((direction.reachable_drop(z, norm), direction.setting, z / norm, direction.largest))
        starts.sort(key=lambda s: -s[0])
        free = self.free + tuple(t.name for t in effect.terms)
        best: Solution | None = None
        for origin, (_, setting, step, largest) in self._starts(starts):
            values = {t.name: t.value for t in effect.terms} | origin | setting
            values |= effect.start(setting, float(np.clip(step, -largest, largest)))
            found = bench.fit(values, free, max_jacobians=_QUICK)
            if np.isfinite(found.chi_square) and (best is None or found.chi_square < best.chi_square):
                best = found
        if best is None or best.chi_square > self.solution.chi_square:
            # From where the effect is absent nothing gets worse.
            absent = {t.name: t.value for t in effect.terms} | self.solution.values
            # A face that is hardly rough has peaks too narrow to be resolved: it is not the smooth one.
            if best is None or np.allclose(bench.predict(absent), self.solution.predicted_per_sr, rtol=_SAME):
                here = bench.fit(absent, free, max_jacobians=_QUICK)
                best = here if best is None or here.chi_square < best.chi_square else best
        refit = Refit(effect, best, bench, self.solution.chi_square - best.chi_square)
        _LOG.debug("%s: chi-square falls by %.6g", effect.name, refit.drop)
        self._refits[effect] = refit
        return refit


def in_threads(work: Callable, items: Iterable) -> list:
    """Work on items of different programs, two at a time: most of it is compiling."""

    def guarded(item):
        with computing():
            return work(item)

    with ThreadPoolExecutor(_COMPILING) as pool:
        return list(pool.map(guarded, items))


def held_out_predictions(
    bench: Workbench, solution: Solution, folds: Bool[np.ndarray, "folds points"]
) -> Float[np.ndarray, "folds points"]:
    """Predictions by fits without each fold's points."""
    return np.stack(
        [bench.fit(solution.values, solution.free, left_out=fold).predicted_per_sr for fold in folds]
    )
