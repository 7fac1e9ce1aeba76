"""A saved result, read back and checked."""

import dataclasses
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.decoding import Rules, decode, described, read_json
from jaxink.files.exchange import settle
from jaxink.files.netcdf import read_dataset, values_of
from jaxink.files.reading import shown_path
from jaxink.fitting.merit import Merit, ScanMerit
from jaxink.fitting.objective import OBJECTIVES
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.result import (
    RESULT_FILE,
    SCHEMA_VERSION,
    DerivedQuantity,
    FitResult,
    FittedParameter,
    NoiseOrigin,
    ProfileCurve,
    SearchSummary,
)
from jaxink.measurement import GonioData
from jaxink.sample import Sample
from jaxink.sample.archive import NULLS, sample_from_dict
from jaxink.solver.stack import SolverConfig

_LARGEST_BYTES = 256_000_000
# Where a fit did not start, or a model is not finite, null stands for what is not known.
_RULES = Rules({**NULLS, "": math.nan})
_COLUMNS = ("predicted_per_sr", "fit_sigma_per_sr", "residual_whitened")


@dataclasses.dataclass(frozen=True)
class _OutcomeEntry:
    code: str
    converged: bool
    sentence: str


@dataclasses.dataclass(frozen=True)
class _Document:
    """``result.json``; what it has that `FitResult` has is of the same name."""

    schema_version: int
    outcome: _OutcomeEntry
    data_file: str
    source: str
    sample: Any
    method: str
    objective: str
    parameters: tuple[FittedParameter, ...]
    correlation_names: tuple[str, ...]
    correlations: tuple[tuple[float, ...], ...]
    derived: tuple[DerivedQuantity, ...]
    merit: Merit
    scans: tuple[ScanMerit, ...]
    noise: NoiseOrigin
    searches: tuple[SearchSummary, ...]
    profiles: tuple[ProfileCurve, ...]
    solver: SolverConfig
    versions: dict[str, str]
    seed: int
    notes: tuple[str, ...]
    # Results of before there was an identifier lack it.
    result_id: str | None = None


def load_result(path: str | Path) -> FitResult:
    """Read a result that `FitResult.save` wrote.

    Parameters
    ----------
    path
        The folder, or its ``result.json``.

    Raises
    ------
    InputRefusedError
        Naming file and key, if it is not a result, one of another schema version, or if its two files are of
        different results.
    """
    path = Path(path)
    path = path / RESULT_FILE if os.path.isdir(path) else path
    # What a killed run had decided is finished before anything is read.
    settle(path.parent)
    name = shown_path(path)
    if "\0" not in str(path) and not os.path.lexists(path):
        raise InputRefusedError(f"{name}: there is no result there; `jaxink fit` writes one.")
    plain = read_json(path, _LARGEST_BYTES, "result")
    try:
        document, sample = _document(plain)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{name}: {problem}") from None
    data, columns = _points(path, document)
    whitened = columns["residual_whitened"]
    names = [field.name for field in dataclasses.fields(FitResult)]
    same = {name: getattr(document, name) for name in names if hasattr(document, name)}
    return FitResult(
        **same
        | {
            "sample": sample,
            "data": data,
            "predicted_per_sr": columns["predicted_per_sr"],
            "sigma_per_sr": columns["fit_sigma_per_sr"],
            "whitened": None if np.all(np.isnan(whitened)) else whitened,
            "outcome": Outcome[document.outcome.code.upper()],
            "correlations": np.array(document.correlations, float).reshape(2 * (len(document.correlations),)),
            "solver": dataclasses.asdict(document.solver),
        }
    )


def _document(plain: Any) -> tuple[_Document, Sample]:
    """What ``result.json`` says, each key checked."""
    version = plain.get("schema_version") if isinstance(plain, dict) else None
    if version != SCHEMA_VERSION or isinstance(version, bool):
        raise InputRefusedError(
            f"schema_version is {described(version)}; this jaxink reads results of version {SCHEMA_VERSION}."
        )
    document = decode(_Document, plain, "", _RULES)
    sample = sample_from_dict(document.sample)
    require_one_of("outcome.code", document.outcome.code, [outcome.name.lower() for outcome in Outcome])
    require_one_of("method", document.method, ("gradient", "simplex"))
    require_one_of("objective", document.objective, OBJECTIVES)
    known = [parameter.name for parameter in document.parameters]
    if sorted(known) != sorted(sample.parameters):
        raise InputRefusedError("parameters and sample.parameters must name the same parameters.")
    for name in document.correlation_names:
        require_one_of("an entry of correlation_names", name, known)
    size = len(document.correlation_names)
    if {len(row) for row in document.correlations} - {size} or len(document.correlations) != size:
        raise InputRefusedError(f"correlations must have {size} rows of {size}, as correlation_names has.")
    file = document.data_file
    if Path(file).name != file or not file.strip(".") or "\0" in file:
        raise InputRefusedError(
            f"data_file is {described(file)}; it must be the name of a file in the same folder."
        )
    return document, sample


def _points(path: Path, document: _Document) -> tuple[GonioData, dict[str, np.ndarray]]:
    """The measurement, and what the fit has for each used point."""
    data_path = path.with_name(document.data_file)
    dataset, name = read_dataset(data_path), shown_path(data_path)
    if str(dataset.attrs.get("result_id")) != str(document.result_id):
        raise InputRefusedError(
            f"{name}: belongs to another result than {path.name} beside it (their result_id differ); put the "
            "files of one result together, or fit again."
        )
    data = GonioData.from_dataset(dataset, name)
    return data, {key: values_of(dataset, key, ("point",), name)[data.used] for key in _COLUMNS}
