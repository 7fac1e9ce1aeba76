"""The result of a fit: everything needed to report it, to check it and to predict from it again."""

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files import plain as as_plain
from jaxink.files import written_whole
from jaxink.fitting.merit import Merit, ScanMerit
from jaxink.fitting.outcome import Outcome
from jaxink.measurement import GonioData, read_netcdf
from jaxink.sample import Sample, sample_from_dict, sample_to_dict

if TYPE_CHECKING:
    from jaxink.forward import ForwardModel

SCHEMA_VERSION = 1
RESULT_FILE = "result.json"
DATA_FILE = "result.nc"


@dataclasses.dataclass(frozen=True)
class FittedParameter:
    """One parameter after the fit.

    Parameters
    ----------
    name, unit
        As in the sample.
    value
        Value at the end.
    standard_error
        One standard error; None where it is not known, see ``flag``.
    start, minimum, maximum
        Start value and range.
    free
        Whether the fit could change it.
    tie
        Expression that gave the value, or None.
    flag
        Empty, or: ``at lower bound``, ``at upper bound``, ``not determined``, ``open below``, ``open above``.
    interval
        Where chi-square rises by less than 1 with all others fitted anew; None where not computed.
    """

    name: str
    unit: str
    value: float
    standard_error: float | None
    start: float
    minimum: float
    maximum: float
    free: bool
    tie: str | None = None
    flag: str = ""
    interval: tuple[float, float] | None = None


@dataclasses.dataclass(frozen=True)
class DerivedQuantity:
    """A quantity that follows from the parameters, of one layer at one wavelength.

    Parameters
    ----------
    layer, wavelength_nm
        Where.
    quantity
        ``scattering_per_mm``, ``absorption_per_mm``, ``asymmetry_parameter`` g,
        ``reduced_scattering_per_mm`` (scattering (1 - g)) or ``reduced_optical_thickness`` (that times
        the thickness). An opaque layer has no coefficients unless it is made of Mie particles.
    value, standard_error
        Value and one standard error by the fit's covariance, None where not known.
    """

    layer: str
    wavelength_nm: float
    quantity: str
    value: float
    standard_error: float | None


@dataclasses.dataclass(frozen=True)
class SearchSummary:
    """One search of the fit; see `jaxink.fitting.outcome.Search`."""

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

    @property
    def is_single(self) -> bool:
        """Whether it is one search from one start, not many of one purpose together."""
        return self.method in ("gradient", "simplex")


@dataclasses.dataclass(frozen=True)
class ProfileCurve:
    """Chi-square along one parameter; ``rise`` is measured from the minimum."""

    name: str
    values: tuple[float, ...]
    rise: tuple[float, ...]


@dataclasses.dataclass(frozen=True)
class FitResult:
    """Result of a fit.

    Parameters
    ----------
    sample
        With the fitted values in its parameter table.
    data
        The measurement as it was used, masks included.
    predicted_per_sr, sigma_per_sr
        Prediction and independent noise at the used points.
    whitened
        Residuals whitened by the noise covariance; None where the noise is not known.
    method, objective
        ``gradient`` or ``simplex``; what was minimised.
    outcome
        How the fit ended.
    parameters
        All parameters.
    correlation_names, correlations
        Free parameters with a standard error and their correlations.
    derived
        Optical coefficients.
    merit, scans
        Figures of merit, in all and by scan.
    noise
        Where the noise came from, and the factor of each scan.
    searches, profiles
        What was computed.
    solver
        Sizes of the discretisation.
    versions, seed
        To repeat it.
    notes
        Sentences for the reader.
    """

    sample: Sample
    data: GonioData
    predicted_per_sr: np.ndarray
    sigma_per_sr: np.ndarray
    whitened: np.ndarray | None
    method: str
    objective: str
    outcome: Outcome
    parameters: tuple[FittedParameter, ...]
    correlation_names: tuple[str, ...]
    correlations: np.ndarray
    derived: tuple[DerivedQuantity, ...]
    merit: Merit
    scans: tuple[ScanMerit, ...]
    noise: dict[str, Any]
    searches: tuple[SearchSummary, ...]
    profiles: tuple[ProfileCurve, ...]
    solver: dict[str, int]
    versions: dict[str, str]
    seed: int
    notes: tuple[str, ...] = ()

    @property
    def converged(self) -> bool:
        """Whether the fit ended in a minimum."""
        return self.outcome.converged

    @property
    def values(self) -> dict[str, float]:
        """Value of every parameter by name."""
        return {p.name: p.value for p in self.parameters}

    @property
    def noise_sentence(self) -> str:
        """Where the noise came from, in words."""
        sentence = str(self.noise["origin"]).rstrip(".")
        factor = self.noise["scan_relative"]
        if factor:
            sentence += f"; a factor common to each scan, standard deviation {100 * factor:.2g} %"
        return sentence + "."

    def __getitem__(self, name: str) -> FittedParameter:
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)

    def forward_model(self, data: GonioData | None = None) -> "ForwardModel":
        """Forward model with the fitted values, at the points of this or of another measurement.

        Parameters
        ----------
        data
            Where to predict; None: the fitted measurement, masked points included.

        Returns
        -------
        ForwardModel
        """
        from jaxink.forward import ForwardModel
        from jaxink.stack import SolverConfig

        at = self.data if data is None else data
        return ForwardModel(self.sample, *at.directions, SolverConfig(**self.solver))

    def predict(self, data: GonioData | None = None) -> np.ndarray:
        """Predicted BSDF with the fitted values.

        Parameters
        ----------
        data
            Where to predict; None: the fitted measurement, masked points included.

        Returns
        -------
        np.ndarray
            1/sr, shape ``(points,)``.
        """
        from jaxink.forward import evaluate

        return evaluate(self.forward_model(data))

    def to_dataset(self):
        """The measurement as an xarray Dataset, with prediction, noise and residuals beside it."""
        dataset = self.data.to_dataset()
        for name, values, what in (
            ("predicted_per_sr", self.predicted_per_sr, "fitted BSDF, 1/sr"),
            ("fit_sigma_per_sr", self.sigma_per_sr, "independent standard deviation used by the fit, 1/sr"),
            ("residual_whitened", self.whitened, "residual whitened by the noise covariance"),
        ):
            column = np.full(len(self.data), np.nan)
            if values is not None:
                column[self.data.used] = values
            dataset[name] = ("point", column, {"long_name": what})
        return dataset

    def to_dict(self) -> dict[str, Any]:
        """Plain data of the result, as in ``result.json``; see `docs/result.md`."""
        plain = {
            "schema_version": SCHEMA_VERSION,
            "outcome": {
                "code": self.outcome.name.lower(),
                "converged": self.converged,
                "sentence": self.outcome.value,
            },
            "data_file": DATA_FILE,
            "source": self.data.source,
        }
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name in ("data", "predicted_per_sr", "sigma_per_sr", "whitened", "outcome"):
                continue
            plain[field.name] = sample_to_dict(value) if field.name == "sample" else as_plain(value)
        return plain

    def save(self, directory: str | Path) -> Path:
        """Write ``result.json`` and ``result.nc``, each whole or not at all.

        Parameters
        ----------
        directory
            Made if it does not exist.

        Returns
        -------
        Path
            Of ``result.json``.

        Raises
        ------
        InputRefusedError
            If the directory cannot be written.
        """
        directory = Path(directory)
        try:
            directory.mkdir(parents=True, exist_ok=True)
            with written_whole(directory / DATA_FILE) as part:
                self.to_dataset().to_netcdf(part, engine="h5netcdf")
            text = json.dumps(self.to_dict(), indent=1, allow_nan=False)
            with written_whole(directory / RESULT_FILE) as part:
                part.write_text(text + "\n", encoding="utf-8")
        except OSError as problem:
            raise InputRefusedError(
                f"{directory}: the result cannot be written there ({problem.strerror or problem}); "
                "choose another folder."
            ) from None
        return directory / RESULT_FILE


def load_result(path: str | Path) -> FitResult:
    """Read a result that `FitResult.save` wrote.

    Parameters
    ----------
    path
        The folder, or its ``result.json``.

    Returns
    -------
    FitResult

    Raises
    ------
    InputRefusedError
        If it is not a result, or one of another schema version.
    """
    path = Path(path)
    path = path / RESULT_FILE if path.is_dir() else path
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputRefusedError(f"{path}: there is no result there; `jaxink fit` writes one.") from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as problem:
        raise InputRefusedError(f"{path}: is not a result of jaxink ({problem}).") from None
    if not isinstance(plain, dict) or plain.get("schema_version") != SCHEMA_VERSION:
        found = plain.get("schema_version") if isinstance(plain, dict) else None
        raise InputRefusedError(
            f"{path}: schema_version is {found!r}; this jaxink reads results of version {SCHEMA_VERSION}."
        )
    import xarray

    data_path = path.with_name(plain["data_file"])
    data = read_netcdf(data_path)
    with xarray.open_dataset(data_path, engine="h5netcdf") as dataset:
        columns = {
            name: dataset[name].values[data.used]
            for name in ("predicted_per_sr", "fit_sigma_per_sr", "residual_whitened")
        }
    whitened = columns["residual_whitened"]
    names = tuple(plain["correlation_names"])
    return FitResult(
        sample=sample_from_dict(plain["sample"]),
        data=data,
        predicted_per_sr=columns["predicted_per_sr"],
        sigma_per_sr=columns["fit_sigma_per_sr"],
        whitened=None if np.all(np.isnan(whitened)) else whitened,
        method=plain["method"],
        objective=plain["objective"],
        outcome=Outcome[plain["outcome"]["code"].upper()],
        parameters=tuple(
            FittedParameter(**{**p, "interval": p["interval"] and tuple(p["interval"])})
            for p in plain["parameters"]
        ),
        correlation_names=names,
        correlations=np.array(plain["correlations"], float).reshape(len(names), len(names)),
        derived=tuple(DerivedQuantity(**d) for d in plain["derived"]),
        merit=Merit(**plain["merit"]),
        scans=tuple(ScanMerit(**s) for s in plain["scans"]),
        noise=plain["noise"],
        searches=tuple(SearchSummary(**s) for s in plain["searches"]),
        profiles=tuple(
            ProfileCurve(p["name"], tuple(p["values"]), tuple(p["rise"])) for p in plain["profiles"]
        ),
        solver=plain["solver"],
        versions=plain["versions"],
        seed=plain["seed"],
        notes=tuple(plain["notes"]),
    )
