"""Fits of a model without each fold of points, and what they predict there."""

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
from jaxink.numerics.progress import Progress


class CrossValidation:
    """Predictions of points that a fit did not see, each model's made once.

    Parameters
    ----------
    setup
        The measurement.
    points
        Where its points lie.
    follow
        Called where fits are made: with what, the number of folds, and chi-square of all points.

    Attributes
    ----------
    observations
        The measurement with its noise.
    folds
        True where a fold leaves a point out.
    """

    def __init__(self, setup: Setup, points: Points, follow: Progress):
        used = setup.data.used
        self.observations = Observations(
            setup.data.bsdf_per_sr[used],
            np.asarray(setup.noise.sigma_per_sr, float),
            points.scan,
            float(setup.noise.scan_relative),
            weights_of(setup.data, setup.sample)[np.unique(points.scan, return_index=True)[1]],
        )
        self.folds = _folds(points, setup.policy)
        self._follow = follow
        self._predictions: dict[tuple[Effect, ...], np.ndarray] = {}

    def predictions(self, stage: Stage) -> Float[np.ndarray, "folds points"]:
        """Of a stage's model, 1/sr."""
        return self._made(stage.accepted, stage.bench, stage.solution)

    def gain(self, stage: Stage, refit: Refit) -> HeldOutGain:
        """Gain in the log density of held-out points by an effect that a stage lacks."""
        before = self.predictions(stage)
        after = self._made((*stage.accepted, refit.effect), refit.bench, refit.solution)
        return held_out_gain(self.observations, self.folds, before, after)

    def _made(self, effects: tuple[Effect, ...], bench: Workbench, solution: Solution) -> np.ndarray:
        if effects not in self._predictions:
            self._follow("held out", len(self.folds), solution.chi_square)
            fits = (bench.fit(solution.values, solution.free, left_out=fold) for fold in self.folds)
            self._predictions[effects] = np.stack([fit.predicted_per_sr for fit in fits])
        return self._predictions[effects]


def _folds(points: Points, policy: SearchPolicy) -> Bool[np.ndarray, "folds points"]:
    """Whole scans; blocks within them where there are too few."""
    if points.n_scans >= policy.fewest_scans:
        return scan_folds(points.scan)
    return block_folds(points, policy.held_out_blocks)
