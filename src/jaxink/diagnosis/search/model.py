"""The declared model with the effects accepted so far, fitted to the measurement."""

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution, Start
from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.problem import MODEL, SearchProblem
from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.diagnosis.statistics.structure import StructureResult, find_structure
from jaxink.effects import AreaWithOtherValues, Effect, Listed, extend, own_error, undivided
from jaxink.errors import NotFiniteError
from jaxink.numerics.precision import computing, release_programs

# A parameter closer than this many standard errors to a bound counts as being at the bound.
_NEAR_BOUND = 1e-6


class Score(NamedTuple):
    """Score of a column after projecting out the free parameters, and the norm of what is left of it."""

    z: float
    norm: float


class CandidateObjectives:
    """Objectives of a model with its candidates: one that most of them share, the others made on first use.

    Parameters
    ----------
    problem, accepted, listed
        Of the model: what it is fitted to, its effects, and its candidates.
    shared
        The objective of the accepted effects and of all candidates that need no program of their own.
    """

    def __init__(
        self,
        problem: SearchProblem,
        accepted: tuple[Effect, ...],
        listed: Listed,
        shared: CandidateObjective,
    ):
        self.shared = shared
        self._problem, self._accepted, self._listed = problem, accepted, listed
        self._own: dict[str | None, CandidateObjective] = {}

    def of(self, effect: Effect) -> CandidateObjective:
        """Objective of a candidate: of one with a program of its own, without the others."""
        if not effect.own_program:
            return self.shared
        if effect.program not in self._own:
            together = tuple(
                form for form in self._listed.forms if form.own_program and form.program == effect.program
            )
            added = sum(len(e.terms) for e in self._accepted) + max(len(form.terms) for form in together)
            # A program of its own is an expensive one, to be run once for each Jacobian.
            n_slots = len(self.shared.base_free) + added
            self._own[effect.program] = self._problem.objective(
                (*self._accepted, *together), n_slots, added_at_once=added
            )
        return self._own[effect.program]

    @contextmanager
    def compiled_meanwhile(self, values: dict[str, float]) -> Iterator[None]:
        """Compile programs that a screen will need in a thread, one after the other, during a fit.

        It shortens the first diagnosis of a sample by a tenth on two cores. What fails fails again in the
        screen, where it is noted.
        """

        def predict(effect: Effect) -> None:
            if not self._problem.deadline.is_over:
                with computing():
                    self.of(effect).predict(values)

        with ThreadPoolExecutor(1) as pool:
            for effects in screened_programs(self._listed):
                if not isinstance(effects[0], AreaWithOtherValues):
                    pool.submit(predict, effects[0])
            try:
                yield
            finally:
                pool.shutdown(wait=True, cancel_futures=True)

    def release(self, kept: CandidateObjective) -> None:
        """Drop the compiled programs, except those of one objective."""
        for objective in (self.shared, *self._own.values()):
            if objective is not kept:
                objective.release()
        release_programs()


@dataclasses.dataclass(frozen=True, eq=False)
class FittedModel:
    """The declared model with the effects accepted so far, at its minimum; made by `fit_model`.

    Parameters
    ----------
    problem
        What it is fitted to.
    accepted
        Its effects.
    listed
        Its candidates: effects that it may lack.
    objectives
        Objectives of the model and its candidates.
    solution
        Its fit.
    linearised
        Its linearisation there, where fits to nearly the same data start.
    jacobian, residual
        The same in the units of the parameters.
    """

    problem: SearchProblem
    accepted: tuple[Effect, ...]
    listed: Listed
    objectives: CandidateObjectives
    solution: Solution
    linearised: Start
    jacobian: Float[np.ndarray, "rows parameters"]
    residual: Float[np.ndarray, " rows"]

    @property
    def objective(self) -> CandidateObjective:
        """The objective that it was fitted by."""
        return self.objectives.shared

    @property
    def free(self) -> tuple[str, ...]:
        """Its free parameters."""
        return self.solution.free

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

    def score(self, direction: Direction) -> Score:
        """Score of a column after projecting out the free parameters."""
        column = self.projection.remove(direction.column)
        norm = float(np.linalg.norm(column))
        return Score(float(column @ self.residual) / norm if norm > 0 else 0.0, norm)

    def structure(self) -> StructureResult:
        """Tests for structure in its residual."""
        return find_structure(
            self.residual,
            self.jacobian,
            self.problem.points,
            at_bound=self.at_bound,
            options=self.problem.screen_options,
            policy=self.problem.policy,
        )

    @property
    def reduced_chi_square(self) -> float:
        """Chi-square per degree of freedom."""
        return self.solution.chi_square / max(len(self.solution.predicted_per_sr) - len(self.free), 1)

    @cached_property
    def tolerated(self) -> float:
        """What the known error of the model itself may add to the reduced chi-square."""
        error = own_error(extend(self.problem.sample, undivided(self.accepted)))
        relative = self.problem.noise.sigma_per_sr / np.abs(self.solution.predicted_per_sr)
        return float(np.mean((error / relative) ** 2))

    @property
    def is_within_own_error(self) -> bool:
        """Whether the model has a known error that may explain its misfit."""
        return 0 < self.reduced_chi_square - 1 <= self.tolerated

    @property
    def is_far(self) -> bool:
        """Whether the misfit is so large that the linear screen is unreliable."""
        return self.solution.chi_square > self.problem.policy.far_reduced_chi_square * len(self.residual)


def fit_model(
    problem: SearchProblem,
    accepted: tuple[Effect, ...],
    start: dict[str, float],
    objective: CandidateObjective | None = None,
) -> FittedModel:
    """Fit the declared model with some effects.

    The program of the fit contains the candidates, at zero strength. One that makes the model fail, or its
    derivatives infinite, is left out and noted.

    Parameters
    ----------
    problem
        What to fit to, and the candidates.
    accepted
        The effects.
    start
        Values of the parameters from which the fit starts.
    objective
        One with these effects that is compiled already; the model then has no candidates.

    Raises
    ------
    NotFiniteError
        The model has no finite derivatives even without candidates.
    """
    if objective is not None:
        return _fitted(problem.without_candidates(), accepted, start, Listed((), {}), objective, False)

    def with_candidates(names: Sequence[str]) -> FittedModel:
        part = problem.with_candidates(names)
        listed = part.listed(accepted)
        # Of a later model, there may be nothing left to look for.
        is_screened = not accepted and len(names) == len(problem.catalogue)
        shared = part.shared_objective(accepted, listed)
        return _fitted(problem, accepted, start, listed, shared, is_screened)

    names = [candidate.name for candidate in problem.catalogue]
    parts = problem.failures.in_parts(lambda some: [(some, with_candidates(some))], names, MODEL)
    if len(parts) == 1:
        return parts[0][1]
    return with_candidates([name for some, _ in parts for name in some])


def _fitted(
    problem: SearchProblem,
    accepted: tuple[Effect, ...],
    start: dict[str, float],
    listed: Listed,
    objective: CandidateObjective,
    is_screened: bool,
) -> FittedModel:
    free = objective.base_free + tuple(term.name for effect in accepted for term in effect.terms)
    objectives = CandidateObjectives(problem, accepted, listed, objective)
    with objectives.compiled_meanwhile(start) if is_screened else nullcontext():
        solution = objective.fit(start, free)
    linearised = objective.linearised(solution.values, free)
    jacobian, residual = linearised.derivatives
    # One derivative that is not finite invalidates those of all parameters of a program.
    if not np.all(np.isfinite(jacobian)):
        at = ", ".join(f"{name} = {solution.values[name]:g}" for name in free)
        raise NotFiniteError(f"the model or its derivatives are not finite at {at}")
    return FittedModel(problem, accepted, listed, objectives, solution, linearised, jacobian, residual)


def screened_programs(listed: Listed) -> list[list[Effect]]:
    """Candidates that are screened by programs of their own, by program.

    Neighbours in the catalogue share tables, so that one would wait for the other: they are apart.
    """
    programs = by_program(e for e in listed.forms if e.own_program and e.is_screened)
    neighbours = list(programs.values())
    return [*neighbours[::2], *neighbours[1::2]]


def by_program(effects: Iterable[Effect]) -> dict[str | None, list[Effect]]:
    """Effects by the program that they share."""
    programs: dict[str | None, list[Effect]] = {}
    for effect in effects:
        programs.setdefault(effect.program, []).append(effect)
    return programs
