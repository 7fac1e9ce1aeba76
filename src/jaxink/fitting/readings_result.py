"""Readings in a joint fit: what was predicted, and how well it fits."""

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from jaxink.colour import (
    GEOMETRIES,
    Arrangement,
    FittedColours,
    Geometry,
    Illuminant,
    colours_of_sample,
)
from jaxink.display.card import Card, CardTable, Presented
from jaxink.effects import readings_model
from jaxink.files.encoding import SavedInFolder, plain
from jaxink.files.result_folder import READINGS_FILE, SAMPLE_FILE
from jaxink.files.version import installed_version
from jaxink.fitting.fitted_parameters import FittedParameters
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.relative_deviation import Deviation, deviation
from jaxink.fitting.result import NoiseOrigin
from jaxink.fitting.verdict import FitVerdict, judge_fit
from jaxink.measurement import Readings
from jaxink.model import evaluate
from jaxink.numerics.digits import rounded
from jaxink.sample import Sample, sample_text, sample_to_dict
from jaxink.solver import SolverConfig

SCHEMA_VERSION = 1


@dataclasses.dataclass(frozen=True)
class ReadingsMerit:
    """How well a prediction fits readings.

    Parameters
    ----------
    points
        Number of readings.
    chi_square
        Under the stated noise.
    """

    points: int
    chi_square: float


@dataclasses.dataclass(frozen=True, repr=False)
class ReadingsResult(SavedInFolder, Presented):
    """Readings of spheres, collimated light and reflectance factors as a joint fit predicts them.

    Parameters
    ----------
    sample
        With the fitted values in its parameter table.
    data
        The readings.
    predicted, sigma
        Prediction and standard deviation of each.
    whitened
        Residuals whitened by the noise covariance.
    objective
        As in `FitOptions`.
    outcome
        How the joint fit ended.
    parameters
        All parameters of the sample, by name.
    noise
        Origin of the noise, and the factor of each quantity.
    config
        Resolution of the solver.
    """

    json_file: ClassVar[str] = READINGS_FILE

    sample: Sample
    data: Readings
    predicted: Float[np.ndarray, " readings"]
    sigma: Float[np.ndarray, " readings"]
    whitened: Float[np.ndarray, " readings"]
    objective: str
    outcome: Outcome
    parameters: FittedParameters
    noise: NoiseOrigin
    config: SolverConfig

    @cached_property
    def result_id(self) -> str:
        """Digest of the content."""
        return hashlib.sha256(json.dumps(self._plain, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def merit(self) -> ReadingsMerit:
        """Figures of merit."""
        return ReadingsMerit(len(self.data), float(np.sum(self.whitened**2)))

    @cached_property
    def verdict(self) -> FitVerdict:
        """Whether the residual is what the noise would leave."""
        return judge_fit(self.outcome, self.objective, self.whitened, len(self.sample.parameters.free))

    @property
    def deviation(self) -> Deviation | None:
        """Root mean square and mean of measured / model - 1; None unless all are positive."""
        return deviation(self.data.value, self.predicted)

    @property
    def noise_sentence(self) -> str:
        """Description of the noise."""
        return f"{str(self.noise['origin']).rstrip('.')}."

    def predict(self, readings: Readings | None = None) -> Float[np.ndarray, " readings"]:
        """Predicted readings with the fitted values.

        Parameters
        ----------
        readings
            What to predict; None for the fitted readings.
        """
        return evaluate(readings_model(self.sample, self.data if readings is None else readings, self.config))

    def colour(
        self,
        geometries: Sequence[str | Geometry] = GEOMETRIES,
        illuminant: str | Illuminant = "D65",
        observer_deg: int = 2,
        arrangement: Arrangement | None = None,
    ) -> FittedColours:
        """CIE colours of the fitted ink, without standard errors; see `jaxink.colour.colours_of_sample`."""
        seen = geometries, illuminant, observer_deg, arrangement
        return colours_of_sample(self.sample, *seen, np.unique(self.data.wavelength_nm).tolist())

    def table(self) -> CardTable:
        """Each reading: measured, fitted, and the difference in standard deviations."""
        rows = [
            [
                quantity,
                f"{self.data.wavelength_nm[i]:g}",
                *("" if np.isnan(angle[i]) else f"{angle[i]:g}" for angle in self._angles),
                rounded(self.data.value[i], 4),
                rounded(self.predicted[i], 4),
                f"{(self.data.value[i] - self.predicted[i]) / self.sigma[i]:+.2f}",
            ]
            for i, quantity in enumerate(self.data.quantity.tolist())
        ]
        heads = ["quantity", "nm", "incidence, deg", "view, deg", "measured", "fitted", "difference / s.d."]
        return CardTable(heads, rows)

    @property
    def _angles(self) -> tuple[Float[np.ndarray, " readings"], Float[np.ndarray, " readings"]]:
        return self.data.theta_i_deg, self.data.theta_o_deg

    def card(self) -> Card:
        """The readings and their prediction."""
        title = f"Readings {self.data.source or 'in memory'}: chi-square {self.merit.chi_square:.4g}"
        return Card(title, (self.verdict.sentence,), (self.table(),), (self.noise_sentence, *self.data.notes))

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in ``readings.json``."""
        return {"schema_version": SCHEMA_VERSION, "result_id": self.result_id, **self._plain}

    @cached_property
    def _plain(self) -> dict[str, Any]:
        fields = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)} | {
            "sample": sample_to_dict(self.sample),
            "parameters": tuple(self.parameters.values()),
            "outcome": self.outcome.code,
        }
        return plain(fields)

    def files_beside(self) -> dict[str, bytes]:
        """The fitted sample as a sample file."""
        source = " ".join((self.data.source or "readings").split())
        head = [f"Fit of {source} by jaxink {installed_version()}.", self.verdict.sentence, ""]
        return {SAMPLE_FILE: sample_text(self.sample, head=head).encode()}
