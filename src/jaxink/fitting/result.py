"""The result of a fit, complete for reporting, checking and predicting."""

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NotRequired, TypedDict, cast

import numpy as np

from jaxink.colour import GEOMETRIES, Arrangement, FittedColours, Geometry, Illuminant
from jaxink.display.brief import brief_repr
from jaxink.display.card import Card, Presented
from jaxink.effects import AugmentedModel, forward_model
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import SavedInFolder, plain
from jaxink.files.netcdf import netcdf_bytes
from jaxink.files.result_folder import FIT_HEAD, PARAMETER_FILE, RESULT_FILE, SAMPLE_FILE
from jaxink.files.version import installed_version
from jaxink.fitting.derived import DerivedQuantity
from jaxink.fitting.figures_of_merit import Merit, ScanMerit
from jaxink.fitting.fitted_colours import colours_of_fit, known_of_fit
from jaxink.fitting.fitted_parameters import (
    FittedCovariance,
    FittedParameter,
    FittedParameters,
    fit_card,
    parameter_text,
)
from jaxink.fitting.log_density import LogDensity
from jaxink.fitting.minima import Minima
from jaxink.fitting.mistake import Mistake, mistakes_sentence
from jaxink.fitting.objective import make_objective, weights_of
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.relative_deviation import Deviation, deviation, deviation_of_scan
from jaxink.fitting.verdict import FitVerdict, judge_fit
from jaxink.measurement import GonioData, NoiseLevel
from jaxink.model import ForwardModel, evaluate
from jaxink.numerics.digits import percent
from jaxink.residual import ResidualPoints, ResidualShape, residual_shape
from jaxink.sample import Sample, sample_text, sample_to_dict
from jaxink.solver import SolverConfig

if TYPE_CHECKING:
    import pandas

SCHEMA_VERSION = 1
_LARGEST_IN_NOISE = 1e100
DATA_FILE = "result.nc"
# Columns of result.nc with a value for each used point: name there and description, by field.
COLUMNS = {
    "predicted_per_sr": ("predicted_per_sr", "fitted BSDF, 1/sr"),
    "sigma_per_sr": ("fit_sigma_per_sr", "independent standard deviation used by the fit, 1/sr"),
    "whitened": ("residual_whitened", "residual whitened by the noise covariance"),
}
# Fields in result.nc, or at the head of result.json; all others are written and read by their names.
_ELSEWHERE = ("data", "outcome", *COLUMNS)


@dataclasses.dataclass(frozen=True)
class PathSummary:
    """The way of a search, with the values of each parameter; see `jaxink.fitting.outcome.SearchPath`."""

    evaluations: tuple[int, ...]
    jacobians: tuple[int, ...]
    seconds: tuple[float, ...]
    loss: tuple[float, ...]
    values: dict[str, tuple[float, ...]]

    __repr__ = brief_repr


@dataclasses.dataclass(frozen=True)
class SearchSummary:
    """One search of the fit; see `jaxink.fitting.outcome.Search`. An older result has no path."""

    __repr__ = brief_repr

    method: str
    outcome: str
    start: dict[str, float]
    values: dict[str, float]
    loss_start: float
    loss: float
    jacobians: int
    evaluations: int
    run_seconds: float
    compile_seconds: float
    path: PathSummary | None = None

    @property
    def is_single(self) -> bool:
        """Whether it is one search from one start, not several combined."""
        return self.method not in ("scan", "profile")


@dataclasses.dataclass(frozen=True)
class ProfileCurve:
    """Chi-square along one parameter; ``rise`` is measured from the minimum."""

    name: str
    values: tuple[float, ...]
    rise: tuple[float, ...]


@dataclasses.dataclass(frozen=True)
class NeglectedPolarisation:
    """What the polarisation of light scattered once and twice would change in the prediction, relative to it.

    Parameters
    ----------
    rms, largest
        Root mean square, and largest absolute value, over the used points.
    """

    rms: float
    largest: float

    @property
    def sentence(self) -> str:
        """For the user."""
        return (
            "The model neglects polarisation, which for light scattered once and twice would change the "
            f"prediction by {percent(self.rms)} rms and {percent(self.largest)} at most; "
            "[effects.polarisation] takes it into account."
        )


# Larger differences between two programs are no rounding.
_SAME_SERIES = 1e-6


@dataclasses.dataclass(frozen=True)
class MieCheck:
    """The Mie series at the solution beside that of miepython, another program.

    Parameters
    ----------
    spheres
        Number of spheres compared.
    largest_relative_difference
        Of efficiencies, asymmetry parameters and phase functions.
    """

    spheres: int
    largest_relative_difference: float

    @property
    def warning(self) -> str | None:
        """For the user, if the two differ."""
        if self.largest_relative_difference <= _SAME_SERIES:
            return None
        return (
            f"The Mie series at the solution differs from that of miepython by "
            f"{self.largest_relative_difference:.1g}, where at most {_SAME_SERIES:g} is expected: one of the "
            "two is wrong there. Please report it with the values of the particles."
        )


class NoiseOrigin(TypedDict):
    """Origin of the noise, relative factor of each scan, whether the noise is known at all, and how well.

    The level is that of an estimated noise, None for a stated one; an older result has none.
    """

    origin: str
    scan_relative: float
    known: bool
    level: NotRequired[NoiseLevel | None]


@dataclasses.dataclass(frozen=True, repr=False)
class FitResult(SavedInFolder, Presented):
    """Result of a fit.

    A field with a default may be absent from ``result.json`` that an older jaxink wrote.

    Parameters
    ----------
    sample
        With the fitted values in its parameter table.
    data
        The measurement as used, including masks.
    predicted_per_sr, sigma_per_sr
        Prediction and independent noise at the used points.
    whitened
        Residuals whitened by the noise covariance; None if the noise is unknown.
    method, objective
        As in `FitOptions`.
    outcome
        How the fit ended.
    parameters
        All parameters, by name.
    correlation_names, correlations
        Free parameters with a standard error, and their correlations.
    derived
        Optical coefficients.
    merit, scans
        Figures of merit, in total and by scan.
    noise
        Origin of the noise, and the factor of each scan.
    searches, profiles
        What was computed.
    solver
        Resolution.
    versions, seed
        For reproducing it.
    notes
        Remarks for the user.
    mistakes
        Mistakes in the input that were considered; see `jaxink.fitting.check_input`.
    neglected_polarisation
        The error of the scalar theory; None if the model takes polarisation into account, or its phase
        functions say nothing of it.
    mie_check
        The Mie series beside that of another program; None without Mie particles.
    minima
        The distinct minima that were found; None if the fit did not end in one, or in an older result.
    """

    json_file: ClassVar[str] = RESULT_FILE

    sample: Sample
    data: GonioData
    predicted_per_sr: np.ndarray
    sigma_per_sr: np.ndarray
    whitened: np.ndarray | None
    method: str
    objective: str
    outcome: Outcome
    parameters: FittedParameters
    correlation_names: tuple[str, ...]
    correlations: np.ndarray
    derived: tuple[DerivedQuantity, ...]
    merit: Merit
    scans: tuple[ScanMerit, ...]
    noise: NoiseOrigin
    searches: tuple[SearchSummary, ...]
    profiles: tuple[ProfileCurve, ...]
    solver: dict[str, int | str]
    versions: dict[str, str]
    seed: int
    notes: tuple[str, ...]
    mistakes: tuple[Mistake, ...] = ()
    neglected_polarisation: NeglectedPolarisation | None = None
    mie_check: MieCheck | None = None
    minima: Minima | None = None

    @cached_property
    def result_id(self) -> str:
        """Identifier that both files of a saved result carry: a digest of their content."""
        digest = hashlib.sha256(json.dumps(self._plain, sort_keys=True).encode())
        for values in (self.data.bsdf_per_sr, self.predicted_per_sr, self.sigma_per_sr, self.whitened):
            digest.update(b"" if values is None else np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()[:32]

    @property
    def converged(self) -> bool:
        """Whether the fit ended in a minimum; one that stopped at its goal did not."""
        return self.outcome.converged

    @cached_property
    def verdict(self) -> FitVerdict:
        """Whether the residual is what the noise would leave; points of weight 0 do not count."""
        weighted = weights_of(self.data, self.sample) > 0
        at_bound = ("at lower bound", "at upper bound")
        bounds = tuple(name for name, p in self.parameters.items() if p.flag in at_bound)
        whitened = None if self.whitened is None else self.whitened[weighted]
        n_free = len(self.sample.parameters.free)
        level = self.noise.get("level")
        verdict = judge_fit(self.outcome, self.objective, whitened, n_free, bounds, level)
        mistakes = mistakes_sentence(self.mistakes, verdict.reduced_chi_square)
        return dataclasses.replace(verdict, sentence=f"{verdict.sentence} {mistakes}".rstrip())

    @cached_property
    def residual_shape(self) -> ResidualShape | None:
        """Smooth modes of the residual, if the model does not fit; None if it does, or if that is unknown."""
        if self.whitened is None or not self.verdict.is_misfit:
            return None
        # Of a damaged file; squares of such numbers overflow.
        with np.errstate(all="ignore"):
            in_noise = np.concatenate([self.whitened, self.predicted_per_sr / self.sigma_per_sr])
        if not np.all(np.abs(in_noise) < _LARGEST_IN_NOISE):
            return None
        weight = np.sqrt(weights_of(self.data, self.sample))
        factor = self.noise["scan_relative"]
        noise = self.sigma_per_sr, factor, weight * self.whitened, weight
        return residual_shape(ResidualPoints.of(self.data, self.predicted_per_sr, *noise))

    @property
    def deviation(self) -> Deviation | None:
        """Root mean square and mean of measured / model - 1 at the used points; None unless all are > 0."""
        return deviation(self.data.bsdf_per_sr[self.data.used], self.predicted_per_sr)

    def deviation_of(self, scan: ScanMerit) -> Deviation | None:
        """The same of one of `scans`."""
        return deviation_of_scan(self.data, self.predicted_per_sr, scan)

    @property
    def run_seconds(self) -> float:
        """Run time of everything that was searched: the scan, all starts, refinement and profiles."""
        return sum(search.run_seconds for search in self.searches)

    @property
    def compile_seconds(self) -> float:
        """Time of all compilation before these searches."""
        return sum(search.compile_seconds for search in self.searches)

    @property
    def values(self) -> dict[str, float]:
        """Value of every parameter by name."""
        return {name: p.value for name, p in self.parameters.items()}

    @property
    def whitened_residual(self) -> np.ndarray:
        """Residual of each used point, whitened by the noise, shape ``(used points,)``.

        Without a factor common to each scan it is (measured - predicted) / sigma. With one, of the relative
        standard deviation r, the noise of a scan has the covariance diag(sigma^2) + r^2 s s^T with the
        prediction s, and the residual is multiplied by the inverse of its symmetric square root in units of
        sigma; see `docs/manual/result.md`. In either case, the sum of squares is the chi-square of `merit`.

        Raises
        ------
        InputRefusedError
            If the noise is unknown.
        """
        if self.whitened is None:
            raise InputRefusedError(
                f"{self.data.source or 'the measurement'}: its noise is unknown, so its residual cannot be "
                "whitened; declare it in [noise] of the sample file and fit again."
            )
        return self.whitened.copy()

    @property
    def noise_sentence(self) -> str:
        """Description of the noise."""
        sentence = str(self.noise["origin"]).rstrip(".")
        factor = self.noise["scan_relative"]
        if factor:
            sentence += f"; a factor common to each scan, standard deviation {100 * factor:.2g} %"
        return sentence + "."

    def __getitem__(self, name: str) -> FittedParameter:
        return self.parameters[name]

    @property
    def covariance(self) -> FittedCovariance:
        """Covariance of the fitted parameters in their units; without those that have no standard error."""
        return FittedCovariance.of(self.parameters, self.correlation_names, self.correlations)

    @property
    def config(self) -> SolverConfig:
        """Resolution at the end of the fit."""
        return SolverConfig(**cast("dict[str, Any]", self.solver))

    @cached_property
    def log_density(self) -> LogDensity:
        """Logarithm of the posterior density, a differentiable function of the free parameters' values.

        Raises
        ------
        InputRefusedError
            If the noise is unknown, or no parameter is free.
        """
        if not self.noise["known"]:
            raise InputRefusedError(
                f"{self.data.source or 'the measurement'}: its noise is unknown, so there is no density; "
                "declare it in [noise] of the sample file and fit again."
            )
        objective = make_objective(self.data, self.sample, config=self.config)
        return LogDensity.of(objective, self.values, self.covariance)

    def forward_model(self, data: GonioData | None = None) -> ForwardModel | AugmentedModel:
        """Forward model with the fitted values, for this or another measurement.

        Parameters
        ----------
        data
            Points to predict; None for the fitted measurement, including masked points.
        """
        at = self.data if data is None else data
        return forward_model(self.sample, at, self.config)

    def predict(self, data: GonioData | None = None) -> np.ndarray:
        """Predicted BSDF with the fitted values, 1/sr, shape ``(points,)``; `data` as in `forward_model`."""
        return evaluate(self.forward_model(data))

    def colour(
        self,
        geometries: Sequence[str | Geometry] = GEOMETRIES,
        illuminant: str | Illuminant = "D65",
        observer_deg: int = 2,
        arrangement: Arrangement | None = None,
    ) -> FittedColours:
        """CIE colours of the fitted ink; arguments as for `jaxink.colour.fitted_colours`."""
        known = known_of_fit(self.parameters, self.covariance, self.verdict.standard_errors_hold)
        seen = geometries, illuminant, observer_deg, arrangement
        return colours_of_fit(self.sample, self.data, self.predicted_per_sr, known, *seen)

    def to_dataset(self):
        """The measurement as an xarray Dataset, with prediction, noise and residuals."""
        dataset = self.data.to_dataset()
        for field, (name, what) in COLUMNS.items():
            column, values = np.full(len(self.data), np.nan), getattr(self, field)
            if values is not None:
                column[self.data.used] = values
            dataset[name] = ("point", column, {"long_name": what})
        return dataset.assign_attrs(result_id=self.result_id)

    def to_frame(self) -> "pandas.DataFrame":
        """The measurement as a pandas DataFrame, with prediction, noise and residuals; one row per point."""
        dataset, frame = self.to_dataset(), self.data.to_frame()
        return frame.assign(**{name: dataset[name].values for name, _ in COLUMNS.values()})

    def card(self) -> Card:
        """How the fit ended, its parameters, figures of merit, the noise and remarks."""
        return fit_card(
            self.data,
            self.outcome,
            f"{self.method} fit of {self.objective}",
            self.parameters,
            self.merit,
            self.deviation,
            self.verdict,
            self.minima,
            (self.noise_sentence, *self.notes),
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data of the result, as in ``result.json``; see `docs/manual/result.md`."""
        return {"schema_version": SCHEMA_VERSION, "result_id": self.result_id, **self._plain}

    @cached_property
    def _plain(self) -> dict[str, Any]:
        head = {
            "outcome": {
                "code": self.outcome.code,
                "converged": self.converged,
                "sentence": self.outcome.value,
            },
            "verdict": self.verdict,
            "residual_shape": self.residual_shape and self.residual_shape.to_dict(),
            "run_seconds": self.run_seconds,
            "compile_seconds": self.compile_seconds,
            "data_file": DATA_FILE,
            "source": self.data.source,
        }
        fields = {name: getattr(self, name) for name in json_fields()} | {
            "sample": sample_to_dict(self.sample),
            "parameters": tuple(self.parameters.values()),
        }
        return plain(head | fields)

    def files_beside(self) -> dict[str, bytes]:
        """The measurement with its prediction, the fitted sample as a sample file, and the parameters."""
        source = " ".join((self.data.source or "a measurement").split())
        head = [
            f"{FIT_HEAD} {source} by jaxink {installed_version()}.",
            self.verdict.sentence,
            "Values are those of the fit; what was free is still free.",
            "",
        ]
        return {
            DATA_FILE: netcdf_bytes(self.to_dataset()),
            SAMPLE_FILE: sample_text(self.sample, head=head).encode(),
            PARAMETER_FILE: parameter_text(self.parameters, self.verdict.standard_errors_hold).encode(),
        }


def json_fields() -> tuple[str, ...]:
    """Fields of a result that ``result.json`` contains under the same names."""
    return tuple(field.name for field in dataclasses.fields(FitResult) if field.name not in _ELSEWHERE)
