"""Names of the files in the folders of fits and diagnoses."""

import os
from pathlib import Path

RESULT_FILE = "result.json"
SAMPLE_FILE = "sample.toml"
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
