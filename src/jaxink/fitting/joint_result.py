"""The result of a joint fit: one set of parameters, and a result for each measurement."""

import dataclasses
import hashlib
import json
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from jaxink.display.brief import counted
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import SavedInFolder, plain
from jaxink.files.result_folder import JOINT_FILE, MEASUREMENTS, PARAMETER_FILE
from jaxink.fitting.agreement import Agreement, PartMisfit
from jaxink.fitting.fitted_parameters import (
    FittedCovariance,
    FittedParameter,
    FittedParameters,
    parameter_text,
)
from jaxink.fitting.minima import Minima
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.readings_result import ReadingsResult
from jaxink.fitting.result import FitResult, ProfileCurve, SearchSummary
from jaxink.fitting.verdict import FitVerdict, judge_fit
from jaxink.numerics.digits import percent, rounded
from jaxink.sample import Sample

SCHEMA_VERSION = 1


def digest_of(content: Mapping[str, Any], parts: Iterable[str]) -> str:
    """Digest of the plain data of a joint result and of the identifiers of its measurements."""
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode())
    for identifier in parts:
        digest.update(identifier.encode())
    return digest.hexdigest()[:32]


@dataclasses.dataclass(frozen=True, repr=False)
class JointResult(SavedInFolder, Presented):
    """Result of the joint fit of several measurements.

    Parameters
    ----------
    title
        Of the project.
    measurements
        The result of each measurement, by name: its sample with the fitted values, its prediction and its
        figures of merit. Standard errors are those of the joint fit.
    names
        Name in the project of each parameter, by measurement.
    instruments
        Name of the instrument of each measurement.
    method, objective
        As in `FitOptions`.
    outcome
        How the fit ended.
    loss
        Value of the objective: the chi-square of all measurements and priors, or the mean square of its RMSD.
    parameters
        All parameters, by their names in the project.
    correlation_names, correlations
        Free parameters with a standard error, and their correlations.
    noise_freedom
        Degrees of freedom of the least certain estimate of noise; None if all noise is stated.
    agreement
        Whether the measurements agree; None if the fit is not of chi-square, or did not end in a minimum.
    minima
        The distinct minima that were found.
    searches, profiles
        What was computed.
    versions, seed
        For reproducing it.
    notes
        Remarks for the user.
    """

    json_file: ClassVar[str] = JOINT_FILE
    owned: ClassVar[tuple[str, ...]] = (MEASUREMENTS,)

    title: str
    measurements: Mapping[str, FitResult | ReadingsResult]
    names: Mapping[str, Mapping[str, str]]
    instruments: Mapping[str, str]
    method: str
    objective: str
    outcome: Outcome
    loss: float
    parameters: FittedParameters
    correlation_names: tuple[str, ...]
    correlations: np.ndarray
    noise_freedom: float | None
    agreement: Agreement | None
    minima: Minima | None
    searches: tuple[SearchSummary, ...]
    profiles: tuple[ProfileCurve, ...]
    versions: dict[str, str]
    seed: int
    notes: tuple[str, ...]

    @cached_property
    def result_id(self) -> str:
        """Identifier of the saved result: a digest of its content and of the results of its measurements."""
        return digest_of(self._plain, [one.result_id for one in self.measurements.values()])

    @property
    def converged(self) -> bool:
        """Whether the fit ended in a minimum."""
        return self.outcome.converged

    @property
    def points(self) -> int:
        """Number of fitted points."""
        return sum(one.merit.points for one in self.measurements.values())

    @property
    def n_free(self) -> int:
        """Number of fitted parameters."""
        return len(self.parameters.free)

    @property
    def chi_square(self) -> float | None:
        """Sum over the points of all measurements, without priors; None if a noise is unknown."""
        found = [one.merit.chi_square for one in self.measurements.values()]
        known = [value for value in found if value is not None]
        return float(sum(known)) if len(known) == len(found) else None

    @property
    def degrees_of_freedom(self) -> int:
        """Number of points beyond that of fitted parameters."""
        return self.points - self.n_free

    @property
    def reduced_chi_square(self) -> float | None:
        """Chi-square per degree of freedom."""
        if self.chi_square is None or self.degrees_of_freedom <= 0:
            return None
        return self.chi_square / self.degrees_of_freedom

    @property
    def values(self) -> dict[str, float]:
        """Value of every parameter by its name in the project."""
        return {name: p.value for name, p in self.parameters.items()}

    @property
    def samples(self) -> dict[str, Sample]:
        """The sample of each measurement with the fitted values."""
        return {name: one.sample for name, one in self.measurements.items()}

    @property
    def covariance(self) -> FittedCovariance:
        """Covariance of the fitted parameters in their units; without those that have no standard error."""
        return FittedCovariance.of(self.parameters, self.correlation_names, self.correlations)

    @cached_property
    def verdict(self) -> FitVerdict:
        """Whether the residual of all measurements is what the noise would leave."""
        columns = [one.whitened for one in self.measurements.values()]
        known = [column for column in columns if column is not None]
        whitened = np.concatenate(known) if len(known) == len(columns) else None
        at_bound = ("at lower bound", "at upper bound")
        bounds = tuple(name for name, p in self.parameters.items() if p.flag in at_bound)
        levels = [one.noise.get("level") for one in self.measurements.values()]
        estimated = [level for level in levels if level is not None]
        level = min(estimated, key=lambda one: one.degrees_of_freedom) if estimated else None
        return judge_fit(self.outcome, self.objective, whitened, self.n_free, bounds, level)

    def __getitem__(self, name: str) -> FittedParameter:
        return self.parameters[name]

    def of(self, measurement: str) -> FitResult | ReadingsResult:
        """The result of one measurement.

        Raises
        ------
        InputRefusedError
            The project has no such measurement.
        """
        if measurement not in self.measurements:
            known = ", ".join(self.measurements)
            raise InputRefusedError(f"there is no measurement '{measurement}'; the project has: {known}.")
        return self.measurements[measurement]

    def predict(self) -> dict[str, np.ndarray]:
        """Prediction of each measurement with the fitted values: the BSDF in 1/sr, or readings."""
        return {name: one.predict() for name, one in self.measurements.items()}

    def misfit_of(self, name: str) -> PartMisfit | None:
        """How one measurement is fitted, jointly and alone; None if that was not compared."""
        parts = () if self.agreement is None else self.agreement.parts
        return next((part for part in parts if part.name == name), None)

    def measurement_table(self) -> CardTable:
        """Misfit of each measurement, in the joint fit and alone."""
        heads = [
            "measurement",
            "points",
            "chi-square",
            "reduced",
            "alone",
            "cost",
            "held out, reduced",
            "rms of measured / model - 1",
        ]
        rows = []
        for name, one in self.measurements.items():
            part, deviation = self.misfit_of(name), one.deviation
            rows.append(
                [
                    name,
                    str(one.merit.points),
                    rounded(one.merit.chi_square, 5),
                    rounded(part.reduced_chi_square, 4) if part else "",
                    rounded(part.chi_square_alone, 5) if part else "",
                    rounded(part.cost, 3) if part else "",
                    rounded(part.reduced_held_out, 4) if part else "",
                    percent(deviation and deviation.rms),
                ]
            )
        return CardTable(heads, rows)

    def parameter_table(self) -> CardTable:
        """All parameters; standard errors that mean nothing are called that."""
        return self.parameters.table(self.verdict.standard_errors_hold)

    def card(self) -> Card:
        """How the fit ended, its measurements, whether they agree, parameters and remarks."""
        misfit = (
            "" if self.reduced_chi_square is None else f": reduced chi-square {self.reduced_chi_square:.4g}"
        )
        title = f"Joint fit of {counted(len(self.measurements), 'measurement')}{misfit}"
        ended = f"{self.method.capitalize().replace('_', '-')} fit of {self.objective} {self.outcome.value}."
        sentences = [self.verdict.sentence, ended]
        if self.agreement is not None:
            sentences.append(self.agreement.sentence)
        tables, remarks = [self.measurement_table(), self.parameter_table()], self.notes
        if self.minima is not None and self.minima.is_told:
            tables, remarks = [*tables, self.minima.table()], (self.minima.sentence, *remarks)
        return Card(title, sentences, tables, remarks)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in ``joint.json``."""
        return {"schema_version": SCHEMA_VERSION, "result_id": self.result_id, **self._plain}

    @cached_property
    def _plain(self) -> dict[str, Any]:
        fields = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)} | {
            "measurements": tuple(self.measurements),
            "parameters": tuple(self.parameters.values()),
            "outcome": self.outcome.code,
        }
        head = {
            "verdict": self.verdict,
            "points": self.points,
            "chi_square": self.chi_square,
            "degrees_of_freedom": self.degrees_of_freedom,
            "reduced_chi_square": self.reduced_chi_square,
        }
        return plain(head | fields)

    def files_beside(self) -> dict[str, bytes]:
        """The parameters, and the files of each measurement in a folder of its own."""
        text = parameter_text(self.parameters, self.verdict.standard_errors_hold)
        files = {PARAMETER_FILE: text.encode()}
        for name, one in self.measurements.items():
            files |= {f"{MEASUREMENTS}/{name}/{file}": content for file, content in one.files().items()}
        return files
