"""Names of the files in the folders of fits and diagnoses."""

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from jaxink.errors import InputRefusedError

RESULT_FILE = "result.json"
SAMPLE_FILE = "sample.toml"
# The page of a fit or of a diagnosis.
PAGE_FILE = "report.html"
# The parameters of a fit, for spreadsheets, and its head.
PARAMETER_FILE = "parameters.csv"
PARAMETER_COLUMNS = (
    "parameter",
    "wavelength_nm",
    "value",
    "standard_error",
    "unit",
    "minimum",
    "maximum",
    "state",
    "note",
)
# How files begin that a fit or a diagnosis has written, whose names a user's own may have.
FIT_HEAD, DIAGNOSIS_HEAD = "Fit of", "Diagnosis of"
_HEADS = {
    SAMPLE_FILE: (f"# {FIT_HEAD} ", f"# {DIAGNOSIS_HEAD} "),
    PARAMETER_FILE: (",".join(PARAMETER_COLUMNS),),
}
# Of a joint fit: its result, and the folder with the results of its measurements.
JOINT_FILE, MEASUREMENTS = "joint.json", "measurements"
# Of the diagnosis of several measurements.
JOINT_REPORT = "joint_report.json"
# Of a measurement that is no BSDF.
READINGS_FILE = "readings.json"
LARGEST_RESULT_BYTES = 256_000_000
# Of a diagnosis: its report, and the folders of its two fits.
REPORT_FILE = "report.json"
DECLARED, CORRECTED = "declared", "corrected"
# What a diagnosis has finished while it is not complete.
UNFINISHED = "unfinished"


def result_file(path: Path) -> Path:
    """The ``result.json`` that a path stands for: for a diagnosis, that of the corrected model."""
    if path.name == REPORT_FILE:
        path = path.parent
    if not os.path.isdir(path):
        return path
    is_diagnosis = os.path.lexists(path / REPORT_FILE) and not os.path.lexists(path / RESULT_FILE)
    return path / CORRECTED / RESULT_FILE if is_diagnosis else path / RESULT_FILE


def joint_file(path: Path) -> Path:
    """The ``joint.json`` that a path stands for: for a joint diagnosis, that of the corrected model."""
    if path.name == JOINT_REPORT:
        path = path.parent
    if not os.path.isdir(path):
        return path
    is_diagnosis = os.path.lexists(path / JOINT_REPORT) and not os.path.lexists(path / JOINT_FILE)
    return path / CORRECTED / JOINT_FILE if is_diagnosis else path / JOINT_FILE


# What a folder holds, by the file that only this has.
_KINDS = {
    RESULT_FILE: "a fit",
    REPORT_FILE: "a diagnosis",
    JOINT_FILE: "a joint fit",
    JOINT_REPORT: "a joint diagnosis",
}


def require_not_replaced(folder: Path, inputs: Iterable[Path], own_file: str) -> None:
    """Reject a folder in which a result would replace an input, a file that no result wrote, or another kind.

    Parameters
    ----------
    folder
        That of the result.
    inputs
        Files that it is made from.
    own_file
        The file by which folders of its kind are known; a result of the same kind is replaced.
    """
    for name, kind in _KINDS.items():
        if name != own_file and (folder / name).exists():
            raise InputRefusedError(
                f"{folder}: holds {kind} ({name}), and {_KINDS[own_file]} would replace its page; choose "
                "another folder."
            )
    for name, heads in _HEADS.items():
        file = folder / name
        with suppress(OSError):
            with file.open(encoding="utf-8", errors="replace") as text:
                is_ours = text.readline(4096).startswith(heads)
            if not is_ours or any(one.exists() and one.samefile(file) for one in inputs):
                raise InputRefusedError(
                    f"{file}: would be replaced by the result's file of that name; choose another folder."
                )
