"""Predictive density of held-out points, and folds of points that are held out together."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.diagnosis.statistics.points import Points
from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError


@dataclass(frozen=True)
class Observations:
    """Measured values with their noise, including one unknown factor for each scan.

    Parameters
    ----------
    measured_per_sr, sigma_per_sr
        BSDF and the independent standard deviation of each point.
    scan
        Scan of each point.
    scan_relative
        Standard deviation of the common relative factor of each scan.
    weight
        Weight of each scan; None for 1.
    """

    __repr__ = brief_repr

    measured_per_sr: Float[np.ndarray, " points"]
    sigma_per_sr: Float[np.ndarray, " points"]
    scan: Int[np.ndarray, " points"]
    scan_relative: float
    weight: Float[np.ndarray, " scans"] | None = None

    def log_density(
        self, predicted_per_sr: Float[np.ndarray, " points"], held_out: Bool[np.ndarray, " points"]
    ) -> float:
        """Log density of the held-out points, given the other points of their scans.

        The covariance within a scan is diag(sigma^2) + s^2 f f^T. The factor of a scan that is held out as a
        whole is marginalised; otherwise the remaining points of the scan constrain it.

        Parameters
        ----------
        predicted_per_sr
            Prediction f of all points, by parameters fitted without the held-out ones.
        held_out
            True for the held-out points.

        References
        ----------
        Sherman, Morrison 1950 Ann. Math. Stat. 21, 124, and the determinant lemma.
        """
        touched = np.isin(self.scan, np.unique(self.scan[held_out]))
        known = touched & ~held_out
        return self._joint(predicted_per_sr, touched) - self._joint(predicted_per_sr, known)

    def _joint(self, predicted, chosen) -> float:
        """Weighted log density of some points; scans are independent."""
        sigma = self.sigma_per_sr[chosen]
        residual = (self.measured_per_sr[chosen] - predicted[chosen]) / sigma
        common = self.scan_relative * predicted[chosen] / sigma
        scan = self.scan[chosen]
        square = np.bincount(scan, common**2)
        along = np.bincount(scan, common * residual)
        misfit = np.bincount(scan, residual**2) - along**2 / (1 + square)
        volume = np.bincount(scan, np.log(2 * np.pi * sigma**2)) + np.log1p(square)
        weight = 1.0 if self.weight is None else self.weight[: square.size]
        return float(-0.5 * np.sum(weight * (misfit + volume)))


def scan_folds(scan: Int[np.ndarray, " points"]) -> Bool[np.ndarray, "folds points"]:
    """Each scan held out in turn: True for held-out points; InputRefusedError if there is only one scan."""
    numbers = np.unique(scan)
    if numbers.size < 2:
        raise InputRefusedError("there is only one scan; hold out blocks within it instead.")
    return scan[None, :] == numbers[:, None]


def block_folds(points: Points, n_blocks: int) -> Bool[np.ndarray, "folds points"]:
    """One block of neighbouring points of every scan held out at a time.

    For effects that are a factor of single scans, which holding out whole scans cannot detect.

    Parameters
    ----------
    points
        Settings of the points; blocks follow each other along the scans.
    n_blocks
        Number of blocks in each scan.

    Raises
    ------
    InputRefusedError
        There are fewer than two blocks, or more than the longest scan has points.
    """
    longest = int(np.bincount(points.scan).max())
    if not 2 <= n_blocks <= longest:
        raise InputRefusedError(
            f"n_blocks is {n_blocks}; it must be between 2 and {longest}, the points of the longest scan."
        )
    folds = np.zeros((n_blocks, len(points)), bool)
    scan = points.scan[points.path]
    for number in range(points.n_scans):
        along = points.path[scan == number]
        for fold, block in enumerate(np.array_split(along, n_blocks)):
            folds[fold, block] = True
    return folds


@dataclass(frozen=True)
class HeldOutGain:
    """Gain in log predictive density from an addition to a model, for each fold."""

    __repr__ = brief_repr

    gains: Float[np.ndarray, " folds"]

    @property
    def mean(self) -> float:
        """Mean over the folds; nan if there is none."""
        return float(np.mean(self.gains)) if self.gains.size else float("nan")

    @property
    def standard_error(self) -> float:
        """Of the mean, from the scatter of the folds; infinite for a single fold."""
        if self.gains.size < 2:
            return float("inf")
        return float(np.std(self.gains, ddof=1) / np.sqrt(self.gains.size))

    @property
    def improves(self) -> bool:
        """Whether the mean gain exceeds one standard error."""
        return self.mean > self.standard_error


def held_out_gain(
    observations: Observations,
    folds: Bool[np.ndarray, "folds points"],
    before_per_sr: Float[np.ndarray, "folds points"],
    after_per_sr: Float[np.ndarray, "folds points"],
) -> HeldOutGain:
    """Compare two models by their predictions (1/sr) of held-out points, fitted without those of the fold."""
    gains = [
        observations.log_density(after, fold) - observations.log_density(before, fold)
        for fold, before, after in zip(folds, before_per_sr, after_per_sr, strict=True)
    ]
    return HeldOutGain(np.array(gains))
