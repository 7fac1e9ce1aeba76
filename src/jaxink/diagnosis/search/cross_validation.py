"""Fits of a model without each fold of points, and their predictions of that fold."""

import numpy as np
from jaxtyping import Bool, Float

from jaxink.diagnosis.policy import SearchPolicy
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.setup import Setup
from jaxink.diagnosis.search.stage import Stage
from jaxink.diagnosis.search.workbench import Solution, Workbench
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.predictive_density import (
    HeldOutGain,
    Observations,
    block_folds,
    held_out_gain,
    scan_folds,
)
from jaxink.effects import Effect
from jaxink.fitting.objective import weights_of
from jaxink.numerics.progress import StepOf


class CrossValidation:
    """Predictions of held-out points, made once for each model while there is time for them.

    `folds` is True for the points that a fold holds out.
    """

    def __init__(self, setup: Setup, points: Points):
        used = setup.data.used
        self.observations = Observations(
            setup.data.bsdf_per_sr[used],
            np.asarray(setup.noise.sigma_per_sr, float),
            points.scan,
            float(setup.noise.scan_relative),
            weights_of(setup.data, setup.sample)[np.unique(points.scan, return_index=True)[1]],
        )
        self.folds = _folds(points, setup.policy)
        self._follow, self._allowance, self._policy = setup.follow, setup.allowance, setup.policy
        self._predictions: dict[tuple[Effect, ...], np.ndarray] = {}

    def predictions(self, stage: Stage) -> Float[np.ndarray, "folds points"] | None:
        """Predictions of a stage's model, 1/sr; None if there was no time for them."""
        return self._made(stage.accepted, stage.bench, stage.solution)

    def gain(self, stage: Stage, refit: Refit) -> HeldOutGain | None:
        """Gain in log density of held-out points from adding an effect to a stage; None as above."""
        before = self.predictions(stage)
        after = self._made((*stage.accepted, refit.effect), refit.bench, refit.solution)
        if before is None or after is None:
            return None
        return held_out_gain(self.observations, self.folds, before, after)

    def _made(self, effects: tuple[Effect, ...], bench: Workbench, solution: Solution) -> np.ndarray | None:
        if effects not in self._predictions:
            predicted, what = [], f"held out with {' and '.join(e.name for e in effects) or 'no effect'}"
            start = bench.linearised(solution.values, solution.free)
            for number, fold in enumerate(self.folds, start=1):
                if self._allowance.is_over:
                    return None
                self._follow(what, StepOf(number, len(self.folds)), solution.chi_square)
                fit = bench.fit_near(
                    start,
                    left_out=fold,
                    max_jacobians=self._policy.held_out_jacobians,
                    decrement=self._policy.held_out_decrement,
                )
                predicted.append(fit.predicted_per_sr)
            self._predictions[effects] = np.stack(predicted)
        return self._predictions[effects]


def _folds(points: Points, policy: SearchPolicy) -> Bool[np.ndarray, "folds points"]:
    """Whole scans, or blocks within them if there are too few scans."""
    if points.n_scans >= policy.fewest_scans:
        return scan_folds(points.scan)
    return block_folds(points, policy.held_out_blocks)
