"""Loads a saved joint fit and checks it."""

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.decoding import Rules, decode, read_json
from jaxink.files.exchange import settle
from jaxink.files.reading import shown_path
from jaxink.files.result_folder import (
    LARGEST_RESULT_BYTES,
    MEASUREMENTS,
    READINGS_FILE,
    RESULT_FILE,
    joint_file,
)
from jaxink.fitting.agreement import Agreement
from jaxink.fitting.fitted_parameters import FittedParameter, FittedParameters
from jaxink.fitting.joint_result import SCHEMA_VERSION, JointResult, digest_of
from jaxink.fitting.loading import load_result, require_consistent, require_version
from jaxink.fitting.minima import Minima
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.readings_result import ReadingsResult
from jaxink.fitting.result import FitResult, NoiseOrigin, ProfileCurve, SearchSummary
from jaxink.measurement import Readings, Spheres
from jaxink.sample import NULLS, sample_from_dict
from jaxink.solver import SolverConfig


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


class _Readings(TypedDict):
    """Entries of ``readings.json``."""

    schema_version: int
    result_id: str
    sample: Any
    data: Any
    predicted: tuple[float, ...]
    sigma: tuple[float, ...]
    whitened: tuple[float, ...]
    objective: str
    outcome: str
    parameters: tuple[FittedParameter, ...]
    noise: NoiseOrigin
    config: SolverConfig


class _Columns(TypedDict):
    """Entries of its data; null stands for what has no angle or no sphere."""

    quantity: tuple[str, ...]
    theta_i_deg: tuple[float | None, ...]
    theta_o_deg: tuple[float | None, ...]
    phi_deg: tuple[float | None, ...]
    wavelength_nm: tuple[float, ...]
    value: tuple[float, ...]
    sigma: tuple[float, ...] | None
    row: tuple[int, ...]
    spheres: dict[str, tuple[float | None, ...]] | None
    source: str
    notes: tuple[str, ...]


def load_joint_result(path: str | Path, effects: Collection[Any] = ()) -> JointResult:
    """Read the result of a joint fit that `JointResult.save` wrote.

    Parameters
    ----------
    path
        Its folder, or the ``joint.json`` in it; or the folder of a joint diagnosis, whose corrected model is
        then taken.
    effects
        Classes of effects of your own that the samples declare.

    Raises
    ------
    InputRefusedError
        Naming file and key: it is not a joint result, has another schema version, or its files do not belong
        together.
    """
    path = joint_file(Path(path))
    settle(path.parent)
    name = shown_path(path)
    if not os.path.lexists(path):
        raise InputRefusedError(f"{name}: there is no joint fit; `jaxink fit PROJECT.toml` writes one.")
    plain = read_json(path, LARGEST_RESULT_BYTES, "joint result")
    try:
        require_version(plain, SCHEMA_VERSION, "joint results")
        document = decode(_Document, {k: v for k, v in plain.items() if k not in _FOLLOWING}, "", _RULES)
        require_consistent(document, "outcome", document["outcome"])
    except InputRefusedError as problem:
        raise InputRefusedError(f"{name}: {problem}") from None
    folder, size = path.parent / MEASUREMENTS, len(document["correlation_names"])
    made = {key: value for key, value in document.items() if key not in ("schema_version", "result_id")}
    result = JointResult(
        **made
        | {
            "measurements": {one: _part(folder / one, effects) for one in document["measurements"]},
            "outcome": Outcome[document["outcome"].upper()],
            "parameters": FittedParameters.of(document["parameters"]),
            "correlations": np.array(document["correlations"], float).reshape(size, size),
        }
    )
    # Of the data as they are in the files: an older jaxink may have written them in other forms.
    content = {key: value for key, value in plain.items() if key not in ("schema_version", "result_id")}
    if digest_of(content, [_identifier(folder / one) for one in result.measurements]) != plain["result_id"]:
        raise InputRefusedError(
            f"{name}: does not belong to the results in {shown_path(folder)}; restore the files of one joint "
            "fit, or fit again."
        )
    return result


def _identifier(folder: Path) -> str:
    """Identifier of the result of a measurement, as it is saved."""
    name = READINGS_FILE if os.path.lexists(folder / READINGS_FILE) else RESULT_FILE
    return str(read_json(folder / name, LARGEST_RESULT_BYTES, "result").get("result_id"))


def _part(folder: Path, effects: Collection[Any]) -> FitResult | ReadingsResult:
    """The result of one measurement."""
    path = folder / READINGS_FILE
    if not os.path.lexists(path):
        return load_result(folder, effects)
    plain = read_json(path, LARGEST_RESULT_BYTES, "result")
    try:
        document = decode(_Readings, plain, "", _RULES)
        require_one_of("outcome", document["outcome"], [outcome.code for outcome in Outcome])
        return ReadingsResult(
            sample=sample_from_dict(document["sample"], effects=effects),
            data=_readings_of(document["data"]),
            outcome=Outcome[document["outcome"].upper()],
            parameters=FittedParameters.of(document["parameters"]),
            objective=document["objective"],
            noise=document["noise"],
            config=document["config"],
            **{name: np.array(document[name], float) for name in ("predicted", "sigma", "whitened")},
        )
    except InputRefusedError as problem:
        raise InputRefusedError(f"{shown_path(path)}: {problem}") from None


def _readings_of(plain: Any) -> Readings:
    columns = decode(_Columns, plain, "data")
    spheres, sigma = columns["spheres"], columns["sigma"]
    arrays = {
        name: np.array(columns[name], float)
        for name in ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "value")
    }
    return Readings(
        quantity=np.array(columns["quantity"]),
        sigma=None if sigma is None else np.array(sigma),
        row=np.array(columns["row"]),
        spheres=None if spheres is None else Spheres(**{k: np.array(v, float) for k, v in spheres.items()}),
        source=columns["source"],
        notes=columns["notes"],
        **arrays,
    )
