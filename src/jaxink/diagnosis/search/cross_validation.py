"""Fits of a model without each fold of points, and their predictions of that fold."""

import numpy as np
from jaxtyping import Bool, Float

from jaxink.diagnosis.policy import SearchPolicy
from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution, Start
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.setup import SearchProblem
from jaxink.diagnosis.search.stage import Stage
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

    def __init__(self, setup: SearchProblem, points: Points):
        used = setup.data.used
        self.observations = Observations(
            setup.data.bsdf_per_sr[used],
            np.asarray(setup.noise.sigma_per_sr, float),
            points.scan,
            float(setup.noise.scan_relative),
            weights_of(setup.data, setup.sample)[np.unique(points.scan, return_index=True)[1]],
        )
        self.folds = _folds(points, setup.policy)
        self._follow, self._allowance, self._policy = setup.follow, setup.deadline, setup.policy
        self._failures = setup.failures
        self._predictions: dict[tuple[Effect, ...], np.ndarray] = {}

    def predictions(self, stage: Stage) -> Float[np.ndarray, "folds points"] | None:
        """Predictions of a stage's model, 1/sr; None if there was no time for them."""
        return self._made(stage.accepted, stage.bench, stage.solution)

    def gain(self, stage: Stage, refit: Refit) -> HeldOutGain | None:
        """Gain in log density of held-out points from adding an effect to a stage; None as above.

        Only of folds that both models predict.
        """
        before = self.predictions(stage)
        after = self._made((*stage.accepted, refit.effect), refit.bench, refit.solution)
        if before is None or after is None:
            return None
        known = np.all(np.isfinite(before) & np.isfinite(after), axis=1)
        return held_out_gain(self.observations, self.folds[known], before[known], after[known])

    def _made(
        self, effects: tuple[Effect, ...], bench: CandidateObjective, solution: Solution
    ) -> np.ndarray | None:
        if effects not in self._predictions:
            names = " and ".join(e.name for e in effects)
            model = f"the model with {names}" if effects else "the declared model"
            predicted, count = np.full(self.folds.shape, np.nan), len(self.folds)
            start: Start | None = None
            with self._failures.sparing(f"the linearisation of {model}", names):
                start = bench.linearised(solution.values, solution.free)
            for number, fold in enumerate(self.folds if start is not None else (), start=1):
                if self._allowance.is_over:
                    return None
                self._follow(
                    f"held out with {names or 'no effect'}", StepOf(number, count), solution.chi_square
                )
                with self._failures.sparing(f"the fit of {model} without fold {number} of {count}", names):
                    fit = bench.fit_near(
                        start,
                        left_out=fold,
                        max_jacobians=self._policy.held_out_jacobians,
                        decrement=self._policy.held_out_decrement,
                    )
                    predicted[number - 1] = fit.predicted_per_sr
            self._predictions[effects] = predicted
        return self._predictions[effects]


def _folds(points: Points, policy: SearchPolicy) -> Bool[np.ndarray, "folds points"]:
    """Whole scans, or blocks within them if there are too few scans."""
    if points.n_scans >= policy.fewest_scans:
        return scan_folds(points.scan)
    return block_folds(points, policy.held_out_blocks)
