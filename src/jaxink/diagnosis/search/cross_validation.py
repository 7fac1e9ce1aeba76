"""Fits of a model without each fold of points, and their predictions of that fold."""

import numpy as np
from jaxtyping import Bool, Float

from jaxink.diagnosis.policy import SearchPolicy
from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution, Start
from jaxink.diagnosis.search.model import FittedModel
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.predictive_density import (
    HeldOutGain,
    Observations,
    block_folds,
    held_out_gain,
    scan_folds,
)
from jaxink.effects import Effect
from jaxink.fitting import weights_of
from jaxink.numerics.progress import StepOf


class CrossValidation:
    """Predictions of held-out points, made once for each model while there is time for them.

    `folds` is True for the points that a fold holds out. A fold whose fit fails is noted, and predicted by
    NaN.
    """

    def __init__(self, problem: SearchProblem):
        data, points = problem.data, problem.points
        self.observations = Observations(
            data.bsdf_per_sr[data.used],
            np.asarray(problem.noise.sigma_per_sr, float),
            points.scan,
            float(problem.noise.scan_relative),
            weights_of(data, problem.sample)[np.unique(points.scan, return_index=True)[1]],
        )
        self.folds = _folds(points, problem.policy)
        self._problem = problem
        self._predictions: dict[tuple[Effect, ...], np.ndarray] = {}

    def predictions(self, model: FittedModel) -> Float[np.ndarray, "folds points"] | None:
        """Predictions of a model, 1/sr; None if there was no time for them."""
        return self._made(model.accepted, model.objective, model.solution)

    def gain(self, model: FittedModel, refit: Refit) -> HeldOutGain | None:
        """Gain in log density of held-out points from adding an effect to a model; None as above.

        Only of folds that both predict.
        """
        before = self.predictions(model)
        after = self._made((*model.accepted, refit.effect), refit.objective, refit.solution)
        if before is None or after is None:
            return None
        known = np.all(np.isfinite(before) & np.isfinite(after), axis=1)
        return held_out_gain(self.observations, self.folds[known], before[known], after[known])

    def _made(
        self, effects: tuple[Effect, ...], objective: CandidateObjective, solution: Solution
    ) -> np.ndarray | None:
        if effects not in self._predictions:
            predicted = self._predicted(effects, objective, solution)
            if predicted is None:
                return None
            self._predictions[effects] = predicted
        return self._predictions[effects]

    def _predicted(
        self, effects: tuple[Effect, ...], objective: CandidateObjective, solution: Solution
    ) -> np.ndarray | None:
        problem, policy, failures = self._problem, self._problem.policy, self._problem.failures
        names = " and ".join(e.name for e in effects)
        model = f"the model with {names}" if effects else "the declared model"
        predicted, count = np.full(self.folds.shape, np.nan), len(self.folds)
        start: Start | None = None
        with failures.sparing(f"the linearisation of {model}", names):
            start = objective.linearised(solution.values, solution.free)
        for number, fold in enumerate(self.folds if start is not None else (), start=1):
            if problem.deadline.is_over:
                return None
            what = f"held out with {names or 'no effect'}"
            problem.follow(what, StepOf(number, count), solution.chi_square)
            with failures.sparing(f"the fit of {model} without fold {number} of {count}", names):
                fit = objective.fit_near(
                    start,
                    left_out=fold,
                    max_jacobians=policy.held_out_jacobians,
                    decrement=policy.held_out_decrement,
                )
                predicted[number - 1] = fit.predicted_per_sr
        return predicted


def _folds(points: Points, policy: SearchPolicy) -> Bool[np.ndarray, "folds points"]:
    """Whole scans, or blocks within them if there are too few scans."""
    if points.n_scans >= policy.fewest_scans:
        return scan_folds(points.scan)
    return block_folds(points, policy.held_out_blocks)
