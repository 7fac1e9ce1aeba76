"""What a measurement would tell: its derivatives, its noise, and the information it adds."""

import dataclasses

import jax
import numpy as np
from jaxtyping import Float

from jaxink.fitting import (
    CompiledObjective,
    Objective,
    make_objective,
    readings_objective,
    whiten_scans,
    without_priors,
)
from jaxink.measurement import FitNoise, Readings
from jaxink.planning.known import KnownFit
from jaxink.planning.menu import Candidate
from jaxink.solver import DEFAULT_ACCURACY

_ACCURACY = 10 * DEFAULT_ACCURACY


@dataclasses.dataclass(frozen=True)
class NoiseOfKind:
    """Noise of a further measurement, as that of the present one.

    Parameters
    ----------
    relative
        Independent standard deviation of a reading, relative to its value.
    floor_per_sr
        The least of a BSDF.
    scan_relative
        Of the factor that readings of a scan have in common; repeated readings do not average it.
    """

    relative: float
    floor_per_sr: float
    scan_relative: float

    @classmethod
    def of(cls, known: KnownFit) -> "NoiseOfKind":
        """That of the measurement with the most points."""
        one, noise = known.base
        used = one.data.used  # type: ignore[union-attr]
        values = one.data.bsdf_per_sr[used]  # type: ignore[union-attr]
        positive = values > 0
        relative = float(np.median(noise.sigma_per_sr[positive] / values[positive]))
        return cls(relative, float(np.min(noise.sigma_per_sr)), noise.scan_relative)


class Planned:
    """A candidate with its programs: predicted values and information at any values of the parameters.

    Parameters
    ----------
    candidate
        The measurement.
    known
        What is known already.
    noise
        Of one reading.
    readings
        So many are taken, by repeating them or by other steps of the angles.
    """

    def __init__(self, candidate: Candidate, known: KnownFit, noise: NoiseOfKind, readings: int):
        self.candidate, self._known, self._noise = candidate, known, noise
        one = candidate.measurement
        self._objective = _objective(one)
        self.programs = CompiledObjective(self._objective)
        self.positions = np.array([known.free.index(one.names[own]) for own in self._objective.free], int)
        self._times = readings / self._objective.n_points

    def predicted(self, unit: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " points"]:
        """Prediction at its points."""
        return self.programs.linearised(unit[self.positions]).predicted

    def sigma(self, predicted: Float[np.ndarray, " points"]) -> Float[np.ndarray, " points"]:
        """Independent standard deviation of the mean of the repeated readings at each point."""
        noise = self._noise
        if self._is_of_readings:
            # Repeating does not average what is common to the readings of one quantity.
            return np.hypot(noise.relative / np.sqrt(self._times), noise.scan_relative) * np.abs(predicted)
        return np.hypot(noise.relative * predicted, noise.floor_per_sr) / np.sqrt(self._times)

    def at_noise_of(self, unit: Float[np.ndarray, " parameters"]) -> Objective:
        """The objective with the noise of a point; the factor common to a scan is part of each sigma."""
        predicted = self.predicted(unit)
        common = 0.0 if self._is_of_readings else self._noise.scan_relative * predicted
        return dataclasses.replace(self._objective, sigma=np.hypot(self.sigma(predicted), common))

    @property
    def _is_of_readings(self) -> bool:
        return isinstance(self.candidate.measurement.data, Readings)

    def whitened(
        self, unit: Float[np.ndarray, " parameters"]
    ) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points parameters"]]:
        """Prediction, and its derivatives by all free parameters in units of the noise."""
        point = self.programs.linearised(unit[self.positions])
        assert point.jacobian is not None
        slopes = np.zeros((len(point.predicted), len(unit)))
        # The objective has a standard deviation of 1: its residual is the measured value less the predicted.
        slopes[:, self.positions] = -point.jacobian
        return point.predicted, self.in_noise(slopes, point.predicted)

    def in_noise(
        self, columns: Float[np.ndarray, "points columns"], predicted: Float[np.ndarray, " points"]
    ) -> Float[np.ndarray, "points columns"]:
        """Changes of the prediction in units of the noise, with the common factors of scans."""
        sigma = self.sigma(predicted)
        scaled = columns / sigma[:, None]
        factor = self._noise.scan_relative
        if factor == 0 or self._is_of_readings:
            return scaled
        common, scan = factor * predicted / sigma, self._objective.scan
        whiten = jax.vmap(
            lambda column: whiten_scans(column, common, scan, self._objective.n_scans), in_axes=1, out_axes=1
        )
        return np.asarray(whiten(scaled))


def _objective(one) -> Objective:
    """An objective whose residual is minus the prediction, up to a constant."""
    sample = without_priors(one.sample)
    n = len(one.data)
    noise = FitNoise(np.ones(n), 0.0, "unit")
    make = readings_objective if isinstance(one.data, Readings) else make_objective
    return make(one.data, sample, noise=noise, accuracy=_ACCURACY)
