"""Figures of merit of a model, for the fitted points and for held-out points."""

import dataclasses
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from jaxink.diagnosis.search.cross_validation import CrossValidation
from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.model import FittedModel
from jaxink.display.brief import brief_repr
from jaxink.fitting import Deviation, deviation, merit
from jaxink.measurement import USER, GonioData


@dataclasses.dataclass(frozen=True)
class Figures:
    """Figures of merit of a prediction.

    Parameters
    ----------
    rmsd_absolute
        Root mean square of pi (measured - predicted).
    rmsd_relative
        Root mean square of the difference divided by the mean of both; None if a value is not positive.
    relative_rms
        Root mean square of predicted / measured - 1.
    chi_square, degrees_of_freedom, reduced_chi_square, probability
        Under the stated or estimated noise, weighted as in the fits. For held-out points the degrees of
        freedom are the number of points.
    """

    rmsd_absolute: float
    rmsd_relative: float | None
    relative_rms: float | None
    chi_square: float
    degrees_of_freedom: int
    reduced_chi_square: float | None
    probability: float | None


@dataclasses.dataclass(frozen=True)
class Summary:
    """How well a model fits the measurement and predicts held-out points.

    Parameters
    ----------
    fitted, held_out
        For the fit of all points, and for fits that leave out each scan in turn, without the points for which
        that failed; None if a time limit left no time for these, or all failed.
    predicted_per_sr, whitened
        From the fit of all points.
    held_out_per_sr
        Prediction of each point by the fit that left it out, nan where that failed; None as above.
    """

    __repr__ = brief_repr

    fitted: Figures
    held_out: Figures | None
    predicted_per_sr: Float[np.ndarray, " points"]
    whitened: Float[np.ndarray, " points"]
    held_out_per_sr: Float[np.ndarray, " points"] | None

    def rows(
        self, measured_per_sr: Float[np.ndarray, " points"]
    ) -> Iterator[tuple[str, Figures, Deviation | None]]:
        """Rows of a table: fitted and held-out points, their figures and the deviation of the measurement."""
        yield "fitted", self.fitted, deviation(measured_per_sr, self.predicted_per_sr)
        if self.held_out is not None and self.held_out_per_sr is not None:
            known = np.isfinite(self.held_out_per_sr)
            yield "held out", self.held_out, deviation(measured_per_sr[known], self.held_out_per_sr[known])


def summary_of(model: FittedModel, cross_validation: CrossValidation) -> Summary:
    """Figures of merit of a model, including its predictions of held-out points if there is time."""
    measured, folds = cross_validation.observations.measured_per_sr, cross_validation.folds
    held_out, data, n = cross_validation.predictions(model), model.problem.data, len(measured)
    predicted, whitened = model.solution.predicted_per_sr, model.residual[:n]
    known = model.problem.noise.degrees_of_freedom
    fitted = _figures(data, predicted, whitened, len(model.free), known)
    if held_out is None:
        model.problem.deadline.permits(OptionalTask.HELD_OUT, ["corrected" if model.accepted else "declared"])
        return Summary(fitted, None, predicted, whitened, None)
    unseen = np.sum(np.where(folds, held_out, 0.0), axis=0) / np.maximum(np.sum(folds, axis=0), 1)
    finite = np.isfinite(unseen)
    if not finite.any():
        return Summary(fitted, None, predicted, whitened, None)
    # The noise of points beside those of a fold that failed is that of a perfect prediction.
    filled = np.where(finite, unseen, measured)
    left = model.objective.whiten(filled, measured - filled)[:n]
    seen = data.mask.copy()
    seen[np.flatnonzero(data.used)[~finite]] |= USER.bit
    figures = _figures(data.replace(mask=seen), unseen[finite], left[finite], 0, known)
    return Summary(fitted, figures, predicted, whitened, unseen)


def _figures(data: GonioData, predicted, whitened, n_parameters: int, noise_freedom: float) -> Figures:
    found = merit(data, predicted, whitened, n_parameters, noise_freedom)
    return Figures(
        found.rmsd_absolute_pi,
        found.rmsd_relative,
        found.relative_rms,
        float(np.sum(whitened**2)),
        len(whitened) - n_parameters,
        found.reduced_chi_square,
        found.probability,
    )
