"""A saved ``report.json``, of this version or of version 1, as plain data."""

import os
from pathlib import Path
from typing import Any

from jaxink.effects import Inapplicable
from jaxink.errors import InputRefusedError
from jaxink.files.decoding import described, read_json
from jaxink.files.reading import shown_path
from jaxink.files.result_folder import REPORT_FILE

REPORT_VERSION = 2
_LARGEST_BYTES = 64_000_000
# Names of version 1; each is the name of one field only.
_RENAMED = {
    "absorbed_fraction": "degenerate_fraction",
    "predicted_drop": "predicted_delta_chi_square",
    "refit_drop": "refit_delta_chi_square",
    "actual_drop": "actual_delta_chi_square",
    "stated": "expected",
    "is_broken": "exceeds_noise",
}


def read_report(path: str | Path) -> dict[str, Any]:
    """Read a report that `Diagnosis.save` wrote, with the field names of the current version.

    Parameters
    ----------
    path
        The folder, or its ``report.json``.

    Returns
    -------
    dict[str, Any]
        As `Diagnosis.to_dict` makes it; fields are described in docs/manual/diagnosis.md.

    Raises
    ------
    InputRefusedError
        The file cannot be read, or is not a report of version 1 or 2.
    """
    path = Path(path)
    path = path / REPORT_FILE if os.path.isdir(path) else path
    report = read_json(path, _LARGEST_BYTES, "report")
    version = report.get("schema_version") if isinstance(report, dict) else None
    if version not in (1, REPORT_VERSION) or isinstance(version, bool):
        raise InputRefusedError(
            f"{shown_path(path)}: schema_version is {described(version)}; this jaxink reads reports of "
            f"versions 1 and {REPORT_VERSION}."
        )
    report = _renamed(report) | {"schema_version": REPORT_VERSION} if version == 1 else report
    return _with_kinds_of_reasons(report)


def _with_kinds_of_reasons(report: dict[str, Any]) -> dict[str, Any]:
    """Reasons that lie in the sample as `Inapplicable` again; reports before there were such name none."""
    reasons, names = report.get("not_testable"), report.get("inapplicable", [])
    if not isinstance(reasons, dict) or not isinstance(names, list):
        return report
    kept = {name: Inapplicable(reason) if name in names else reason for name, reason in reasons.items()}
    return report | {"not_testable": kept}


def _renamed(value: Any) -> Any:
    if isinstance(value, dict):
        return {_RENAMED.get(key, key): _renamed(entry) for key, entry in value.items()}
    return [_renamed(entry) for entry in value] if isinstance(value, list) else value
