"""Loads a saved result and checks it."""

import dataclasses
import math
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NotRequired, TypedDict, get_type_hints

import numpy as np

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.decoding import Rules, decode, described, read_json
from jaxink.files.exchange import settle
from jaxink.files.netcdf import read_dataset, values_of
from jaxink.files.reading import shown_path
from jaxink.files.result_folder import (
    CORRECTED,
    LARGEST_RESULT_BYTES,
    MEASUREMENTS,
    REPORT_FILE,
    joint_file,
    result_file,
)
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.fitted_parameters import FittedParameter, FittedParameters
from jaxink.fitting.objective import OBJECTIVES
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.result import COLUMNS, SCHEMA_VERSION, FitResult, json_fields
from jaxink.measurement import GonioData
from jaxink.sample import NULLS, Sample, sample_from_dict
from jaxink.solver import SolverConfig

# null stands for unknown values if a fit did not start or a model is not finite.
_RULES = Rules({**NULLS, "": math.nan})


class _OutcomeEntry(TypedDict):
    code: str
    converged: bool
    sentence: str


class _VerdictEntry(TypedDict):
    code: str
    sentence: str
    reduced_chi_square: float | None
    standard_errors_hold: bool


def _entries() -> dict[str, Any]:
    """Type of each entry of ``result.json``; fields of `FitResult` have the type declared there."""
    head = {"schema_version": int, "outcome": _OutcomeEntry, "data_file": str, "source": str}
    # Entries that have another form in the file.
    forms = {
        "sample": Any,
        "parameters": tuple[FittedParameter, ...],
        "solver": SolverConfig,
        "correlations": tuple[tuple[float, ...], ...],
    }
    declared = get_type_hints(FitResult) | forms
    # A field with a default is a class attribute of the dataclass.
    fields = {n: NotRequired[declared[n]] if hasattr(FitResult, n) else declared[n] for n in json_fields()}
    # Older results lack the identifier, the verdict and the seconds; the latter two follow from the rest.
    later = {"result_id": NotRequired[str | None], "verdict": NotRequired[_VerdictEntry]}
    later |= {name: NotRequired[float] for name in ("run_seconds", "compile_seconds")}
    # It follows from the points.
    later["residual_shape"] = NotRequired[Any]
    return head | fields | later


# Its keys are those of `FitResult`, so that a type checker cannot know them.
_Document: Any = TypedDict("_Document", _entries())  # type: ignore[misc]


def load_result(path: str | Path, effects: Collection[Any] = ()) -> FitResult:
    """Read a result that `FitResult.save` wrote.

    Parameters
    ----------
    path
        Its folder, or the ``result.json`` in it. For the folder of a diagnosis, or its ``report.json``, the
        result is that of the corrected model.
    effects
        Classes of effects of your own that the sample declares.

    Raises
    ------
    InputRefusedError
        Naming file and key: it is not a result, has another schema version, or its two files do not belong
        together.
    """
    path = result_file(Path(path))
    # First complete a replacement of the files that an interrupted run had started.
    settle(path.parent)
    name = shown_path(path)
    if "\0" not in str(path) and not os.path.lexists(path):
        if os.path.lexists(joint := joint_file(path.parent)):
            raise InputRefusedError(
                f"{shown_path(path.parent)}: is a joint fit or diagnosis; give the folder of one of its "
                f"measurements, such as {_a_measurement(joint.parent)}, or use jaxink.load_joint_result."
            )
        if path.parent.name == CORRECTED:
            raise InputRefusedError(
                f"{name}: there is no result; {REPORT_FILE} was written by an older jaxink, so run `jaxink "
                "diagnose` again."
            )
        raise InputRefusedError(f"{name}: there is no result; `jaxink fit` writes one.")
    plain = read_json(path, LARGEST_RESULT_BYTES, "result")
    try:
        document, sample = _document(plain, effects)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{name}: {problem}") from None
    data, columns = _points(path, document)
    if np.all(np.isnan(columns["whitened"])):
        columns["whitened"] = None
    size = len(document["correlation_names"])
    fields = {name: document[name] for name in json_fields() if name in document} | {
        "sample": sample,
        "parameters": FittedParameters.of(document["parameters"]),
        "outcome": Outcome[document["outcome"]["code"].upper()],
        "correlations": np.array(document["correlations"], float).reshape(size, size),
        "solver": dataclasses.asdict(document["solver"]),
    }
    return FitResult(data=data, **columns, **fields)


def _a_measurement(folder: Path) -> str:
    """The folder of the first measurement of a joint fit."""
    places = folder / MEASUREMENTS
    found = sorted(os.listdir(places)) if os.path.isdir(places) else []
    return shown_path(places / (found[0] if found else "NAME"))


def _document(plain: Any, effects: Collection[Any]) -> tuple[dict[str, Any], Sample]:
    """Content of ``result.json``, each key checked."""
    require_version(plain, SCHEMA_VERSION, "results")
    document = decode(_Document, plain, "", _RULES)
    sample = sample_from_dict(document["sample"], effects=effects)
    require_consistent(document, "outcome.code", document["outcome"]["code"])
    known = [parameter.name for parameter in document["parameters"]]
    if sorted(known) != sorted(sample.parameters):
        raise InputRefusedError("parameters and sample.parameters must name the same parameters.")
    for name in document["correlation_names"]:
        require_one_of("an entry of correlation_names", name, known)
    file = document["data_file"]
    if Path(file).name != file or not file.strip(".") or "\0" in file:
        raise InputRefusedError(
            f"data_file is {described(file)}; it must be the name of a file in the same folder."
        )
    return document, sample


def require_version(plain: Any, version: int, what: str) -> None:
    """Reject content of another schema version; ``what`` it is, for the error."""
    found = plain.get("schema_version") if isinstance(plain, dict) else None
    if found != version or isinstance(found, bool):
        raise InputRefusedError(
            f"schema_version is {described(found)}; this jaxink reads {what} of version {version}."
        )


def require_consistent(document: Mapping[str, Any], outcome_key: str, outcome: str) -> None:
    """Reject an outcome, a method or an objective that is unknown, and correlations that are no square."""
    require_one_of(outcome_key, outcome, [known.code for known in Outcome])
    require_one_of("method", document["method"], METHODS)
    require_one_of("objective", document["objective"], OBJECTIVES)
    size = len(document["correlation_names"])
    if [len(row) for row in document["correlations"]] != [size] * size:
        raise InputRefusedError(
            f"correlations must have {size} rows of {size}, the length of correlation_names."
        )


def _points(path: Path, document: dict[str, Any]) -> tuple[GonioData, dict[str, Any]]:
    """The measurement, and the columns of the fit for each used point."""
    data_path = path.with_name(document["data_file"])
    dataset, name = read_dataset(data_path), shown_path(data_path)
    if str(dataset.attrs.get("result_id")) != str(document.get("result_id")):
        raise InputRefusedError(
            f"{name}: belongs to another result than {path.name} (their result_id differ); restore the "
            "files of one result, or fit again."
        )
    data = GonioData.from_dataset(dataset, name)
    return data, {
        field: values_of(dataset, column, ("point",), name)[data.used]
        for field, (column, _) in COLUMNS.items()
    }
