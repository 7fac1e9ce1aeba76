"""Loads a saved joint fit and checks it."""

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.decoding import Rules, decode, described, read_json
from jaxink.files.exchange import settle
from jaxink.files.reading import shown_path
from jaxink.files.result_folder import JOINT_FILE, LARGEST_RESULT_BYTES, MEASUREMENTS
from jaxink.fitting.agreement import Agreement
from jaxink.fitting.fitted_parameters import FittedParameter, FittedParameters
from jaxink.fitting.joint_result import SCHEMA_VERSION, JointResult
from jaxink.fitting.loading import load_result
from jaxink.fitting.methods import METHODS
from jaxink.fitting.minima import Minima
from jaxink.fitting.objective import OBJECTIVES
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.result import ProfileCurve, SearchSummary
from jaxink.sample.archive import NULLS


class _Document(TypedDict):
    """Entries of ``joint.json``; those that follow from others are not read."""

    schema_version: int
    result_id: str
    title: str
    measurements: tuple[str, ...]
    names: dict[str, dict[str, str]]
    instruments: dict[str, str]
    method: str
    objective: str
    outcome: str
    loss: float
    parameters: tuple[FittedParameter, ...]
    correlation_names: tuple[str, ...]
    correlations: tuple[tuple[float, ...], ...]
    noise_freedom: float | None
    agreement: Agreement | None
    minima: Minima | None
    searches: tuple[SearchSummary, ...]
    profiles: tuple[ProfileCurve, ...]
    versions: dict[str, str]
    seed: int
    notes: tuple[str, ...]


_FOLLOWING = ("verdict", "points", "chi_square", "degrees_of_freedom", "reduced_chi_square")
_RULES = Rules({**NULLS, "": np.nan})


def load_joint_result(path: str | Path, effects: Collection[Any] = ()) -> JointResult:
    """Read the result of a joint fit that `JointResult.save` wrote.

    Parameters
    ----------
    path
        Its folder, or the ``joint.json`` in it.
    effects
        Classes of effects of your own that the samples declare.

    Raises
    ------
    InputRefusedError
        Naming file and key: it is not a joint result, has another schema version, or its files do not belong
        together.
    """
    path = Path(path)
    path = path / JOINT_FILE if os.path.isdir(path) else path
    settle(path.parent)
    name = shown_path(path)
    if not os.path.lexists(path):
        raise InputRefusedError(f"{name}: there is no joint fit; `jaxink fit PROJECT.toml` writes one.")
    plain = read_json(path, LARGEST_RESULT_BYTES, "joint result")
    version = plain.get("schema_version") if isinstance(plain, dict) else None
    if version != SCHEMA_VERSION or isinstance(version, bool):
        raise InputRefusedError(
            f"{name}: schema_version is {described(version)}; this jaxink reads joint results of version "
            f"{SCHEMA_VERSION}."
        )
    try:
        document = decode(_Document, {k: v for k, v in plain.items() if k not in _FOLLOWING}, "", _RULES)
        require_one_of("outcome", document["outcome"], [outcome.code for outcome in Outcome])
        require_one_of("method", document["method"], METHODS)
        require_one_of("objective", document["objective"], OBJECTIVES)
        size = len(document["correlation_names"])
        if [len(row) for row in document["correlations"]] != [size] * size:
            raise InputRefusedError(
                f"correlations must have {size} rows of {size}, the length of correlation_names."
            )
    except InputRefusedError as problem:
        raise InputRefusedError(f"{name}: {problem}") from None
    folder = path.parent / MEASUREMENTS
    made = {key: value for key, value in document.items() if key not in ("schema_version", "result_id")}
    result = JointResult(
        **made
        | {
            "measurements": {one: load_result(folder / one, effects) for one in document["measurements"]},
            "outcome": Outcome[document["outcome"].upper()],
            "parameters": FittedParameters.of(document["parameters"]),
            "correlations": np.array(document["correlations"], float).reshape(size, size),
        }
    )
    if result.result_id != document["result_id"]:
        raise InputRefusedError(
            f"{name}: does not belong to the results in {shown_path(folder)}; restore the files of one joint "
            "fit, or fit again."
        )
    return result
