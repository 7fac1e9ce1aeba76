"""One stage of a search: a model with the effects found so far, and its screen."""

import itertools
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property, partial
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution, Start
from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.direction import SCREEN, Direction, secants, tangents
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.setup import MODEL, SearchProblem
from jaxink.diagnosis.statistics.candidate import Candidate, ScreenResult
from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.diagnosis.statistics.screen import screen
from jaxink.effects import AreaWithOtherValues, Effect, Listed, extend, own_error, undivided
from jaxink.errors import NotFiniteError
from jaxink.numerics.failures import Failures
from jaxink.numerics.precision import release_programs
from jaxink.numerics.progress import StepOf
from jaxink.numerics.threads import in_threads

# A parameter closer than this many standard errors to a bound counts as being at the bound.
_NEAR_BOUND = 1e-6


class Score(NamedTuple):
    """Score of a column after projecting out the free parameters, and the norm of what is left of it."""

    z: float
    norm: float


class _Fitted(NamedTuple):
    """A fit, and programs compiled in the meantime."""

    solution: Solution
    made: dict[str | None, Future]


class Stage:
    """The model with the effects found so far.

    A candidate that makes the model fail, or its derivatives infinite, is left out and recorded.

    Parameters
    ----------
    setup
        What all stages share.
    accepted
        Effects found so far.
    values
        Start of the fit.
    bench
        Workbench with these effects and a program for them, if there is one already; without candidates.

    Attributes
    ----------
    bench, free, solution, linearised, jacobian, residual
        The workbench of all effects that share its program; the free parameters, their fit, and its
        linearisation: as a start of fits to nearly the same data, and in the units of the parameters.
    refits
        Refits made so far, by the form of the effect.

    Raises
    ------
    NotFiniteError
        The model has no finite derivatives even without candidates.
    """

    listed: Listed
    bench: CandidateObjective
    free: tuple[str, ...]
    solution: Solution
    linearised: Start
    jacobian: Float[np.ndarray, "rows parameters"]
    residual: Float[np.ndarray, " rows"]

    def __init__(
        self,
        setup: SearchProblem,
        accepted: tuple[Effect, ...],
        values: dict[str, float],
        bench: CandidateObjective | None = None,
    ):
        self.setup = setup if bench is None else setup.without_candidates()
        self.accepted = accepted
        self._own: dict[str | None, CandidateObjective] = {}
        self.refits: dict[Effect, Refit] = {}
        names = tuple(candidate.name for candidate in self.setup.catalogue)
        sound = self.setup.failures.in_parts(partial(self._fit, values, bench), names, MODEL)
        if len(sound) < len(names):
            self._fit(values, bench, sound)

    def _fit(
        self, values: dict[str, float], bench: CandidateObjective | None, names: Sequence[str]
    ) -> list[str]:
        """Fit the model with some candidates included at zero strength, and return their names."""
        setup = self.setup.with_candidates(names)
        self.listed = setup.listed(self.accepted)
        self.bench = bench or setup.shared_bench(self.accepted, self.listed)
        self.free = self.bench.base_free + tuple(t.name for e in self.accepted for t in e.terms)
        # After a later fit there may be nothing left to search for.
        is_whole = len(names) == len(self.setup.catalogue)
        self.solution, self._made = self._fitted(values, with_programs=is_whole and not self.accepted)
        self.linearised = self.bench.linearised(self.solution.values, self.free)
        self.jacobian, self.residual = self.linearised.derivatives
        # One derivative that is not finite invalidates those of all parameters of a program.
        if not np.all(np.isfinite(self.jacobian)):
            at = ", ".join(f"{name} = {self.solution.values[name]:g}" for name in self.free)
            raise NotFiniteError(f"the model or its derivatives are not finite at {at}")
        return list(names)

    @cached_property
    def at_bound(self) -> Int[np.ndarray, " parameters"]:
        """-1, 0 or 1 for each free parameter, as in `prepare_screen`."""
        n = len(self.free)
        search = self.solution.search
        unit, triangle = search.unit[:n], search.derivatives.triangle[:, :n]
        sigma = np.sqrt(np.diag(np.linalg.pinv(triangle.T @ triangle, hermitian=True)))
        near = np.minimum(sigma, 0.25)
        return np.where(unit <= near * _NEAR_BOUND, -1, np.where(unit >= 1 - near * _NEAR_BOUND, 1, 0))

    @cached_property
    def projection(self) -> Projection:
        """Projection that removes the free parameters that are not at a bound."""
        return Projection(orthonormal_range(self.jacobian[:, self.at_bound == 0]))

    def own_bench(self, effect: Effect) -> CandidateObjective:
        """Workbench of an effect that changes the structure, without the other candidates."""
        if effect.program not in self._own:
            together = tuple(e for e in self.listed.forms if e.own_program and e.program == effect.program)
            n_slots = len(self.free) + max(len(e.terms) for e in together)
            # A program of its own is an expensive one, to be run once for each Jacobian.
            added = n_slots - len(self.bench.base_free)
            self._own[effect.program] = self.setup.bench((*self.accepted, *together), n_slots, added)
        return self._own[effect.program]

    def prepare(self, effect: Effect) -> None:
        """Compile the program for refits with an effect that has its own, in any thread."""
        if not self.setup.deadline.is_over:
            with jax.enable_x64(True):
                free = self.free + tuple(term.name for term in effect.terms)
                # What fails here fails again in the refit, if that is made, and is noted there.
                with Failures().sparing("the program with {}", effect.name):
                    self.own_bench(effect).prepare(self.solution.values, free)

    def release(self, kept: CandidateObjective) -> None:
        """Drop the compiled programs of a stage that is no longer needed, except those of one objective."""
        for bench in (self.bench, *self._own.values()):
            if bench is not kept:
                bench.release()
        release_programs()

    def directions(self, with_own: bool = True) -> dict[str, list[Direction]]:
        """Columns of all forms at all settings, by name; `with_own`: also of those with their own program."""
        by_name: dict[str, list[Direction]] = {}
        inside = [e for e in self.listed.forms if not e.own_program]
        inside = inside if self._may_screen(inside) else []
        shared = tangents(self.bench, self.solution, self.free, inside, self.setup.failures)
        for direction in [*shared, *(self._all_secants() if with_own else ())]:
            name = direction.effect.name
            if not np.all(np.isfinite(direction.column)):
                self.setup.failures.note(SCREEN, name, "the model or its derivatives are not finite")
            by_name.setdefault(name, []).append(direction.without_rounding())
        return by_name

    def _may_screen(self, effects: Iterable[Effect]) -> bool:
        task = OptionalTask.REPETITION if self.accepted else OptionalTask.SCREEN
        return self.setup.deadline.permits(task, () if self.accepted else (e.name for e in effects))

    def _programs(self) -> dict[str | None, list[Effect]]:
        """Screened effects with programs of their own, by program."""
        own = [e for e in self.listed.forms if e.own_program and e.is_screened]
        programs = by_program(own)
        # Neighbours in the catalogue share tables, so one would wait for the other.
        names = [*programs]
        return {name: programs[name] for name in [*names[::2], *names[1::2]]}

    def _fitted(self, values: dict[str, float], with_programs: bool) -> _Fitted:
        """The fit; meanwhile, programs that the screen will need are compiled if requested."""

        def make(effects):
            if self.setup.deadline.is_over:
                return
            with jax.enable_x64(True):
                self.own_bench(effects[0]).predict(values)

        programs = self._programs() if with_programs else {}
        pool = ThreadPoolExecutor(1)
        made = {
            name: pool.submit(make, effects)
            for name, effects in programs.items()
            if not isinstance(effects[0], AreaWithOtherValues)
        }
        try:
            return _Fitted(self.bench.fit(values, self.free), made)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def _all_secants(self) -> list[Direction]:
        programs, number = self._programs(), itertools.count(1)

        def of(program):
            if not self._may_screen(programs[program]):
                return []
            names = ", ".join(dict.fromkeys(effect.name for effect in programs[program]))
            step = StepOf(next(number), len(programs))
            self.setup.follow(f"screen with {names}", step, self.solution.chi_square)
            made = self._made.get(program)
            if made is not None and not made.cancelled():
                # Any error there is raised again below.
                made.exception()
            found = list[Direction]()
            for effect in programs[program]:
                with self.setup.failures.sparing(SCREEN, effect.name):
                    found += self._secants(effect)
            return found

        return [direction for directions in in_threads(of, programs) for direction in directions]

    def _secants(self, effect: Effect) -> list[Direction]:
        own = self.bench if isinstance(effect, AreaWithOtherValues) else self.own_bench(effect)
        return secants(self.bench, own, self.solution, effect)

    def screened(self, directions: dict[str, list[Direction]]) -> ScreenResult:
        """Score of every effect whose directions are given."""
        candidates = [
            Candidate(name, np.stack([d.column for d in found], axis=1), found[0].effect.sign)
            for name, found in directions.items()
        ]
        return screen(
            self.residual,
            self.jacobian,
            candidates,
            at_bound=self.at_bound,
            options=self.setup.options,
            policy=self.setup.policy,
        )

    def promise(self, directions: list[Direction]) -> float:
        """Largest predicted decrease in chi-square among the directions of an effect."""
        decreases = [0.0]
        for direction in directions:
            z, norm = self.score(direction)
            if norm > 1e-9 * max(float(np.linalg.norm(direction.column)), 1e-300):
                decreases.append(direction.reachable_delta_chi_square(z, norm))
        return max(decreases)

    def score(self, direction: Direction) -> Score:
        """Score of a column after projecting out the free parameters."""
        column = self.projection.remove(direction.column)
        norm = float(np.linalg.norm(column))
        return Score(float(column @ self.residual) / norm if norm > 0 else 0.0, norm)

    @property
    def reduced_chi_square(self) -> float:
        """Chi-square per degree of freedom."""
        return self.solution.chi_square / max(len(self.solution.predicted_per_sr) - len(self.free), 1)

    @cached_property
    def tolerated(self) -> float:
        """What the known error of the model itself may add to the reduced chi-square."""
        error = own_error(extend(self.setup.sample, undivided(self.accepted)))
        relative = self.setup.noise.sigma_per_sr / np.abs(self.solution.predicted_per_sr)
        return float(np.mean((error / relative) ** 2))

    @property
    def is_within_own_error(self) -> bool:
        """Whether the model has a known error that may explain its misfit."""
        return 0 < self.reduced_chi_square - 1 <= self.tolerated

    @property
    def is_far(self) -> bool:
        """Whether the misfit is so large that the linear screen is unreliable."""
        return self.solution.chi_square > self.setup.policy.far_reduced_chi_square * len(self.residual)


def by_program(effects: Iterable[Effect]) -> dict[str | None, list[Effect]]:
    """Effects by the program that they share."""
    programs: dict[str | None, list[Effect]] = {}
    for effect in effects:
        programs.setdefault(effect.program, []).append(effect)
    return programs
