"""A saved fit as far as it decides what a table will contain; reading it does not need JAX."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.files.decoding import decode, read_json
from jaxink.files.result_folder import LARGEST_RESULT_BYTES, result_file
from jaxink.ink.uncertainty import determined
from jaxink.sample import Sample, sample_from_dict


class _Row(NamedTuple):
    name: str
    standard_error: float | None
    flag: str


@dataclasses.dataclass(frozen=True)
class SavedFit:
    """The part of a saved result that decides what a table of its ink will contain.

    Parameters
    ----------
    sample
        With the fitted values.
    wavelengths_nm
        Wavelengths of the fit, ascending.
    has_standard_errors
        Whether the fit gives standard errors.
    """

    __repr__ = brief_repr

    sample: Sample
    wavelengths_nm: tuple[float, ...]
    has_standard_errors: bool


def read_saved_fit(path: str | Path) -> SavedFit | None:
    """Read the folder of a fit, or the ``result.json`` in it.

    Returns
    -------
    SavedFit or None
        None if it is not a result; `jaxink.load_result` then says why.
    """
    path = result_file(Path(path))
    try:
        plain = read_json(path, LARGEST_RESULT_BYTES, "result")
        if not isinstance(plain, Mapping):
            return None
        rows = {row.name: row for row in map(_row, decode(tuple[Any, ...], plain["parameters"]))}
        scans = decode(tuple[Any, ...], plain["scans"])
        wavelengths = sorted({decode(float, scan["wavelength_nm"]) for scan in scans})
        known, _, lost = determined([rows[name] for name in plain["correlation_names"]])
        # Older results have no verdict.
        holds = plain.get("verdict", {}).get("standard_errors_hold", True)
        has_errors = bool(known) and not lost and holds
        return SavedFit(sample_from_dict(plain["sample"]), tuple(wavelengths), has_errors)
    except (InputRefusedError, LookupError, TypeError, AttributeError):
        return None


def _row(plain: Any) -> _Row:
    return _Row(plain["name"], plain["standard_error"], plain.get("flag", ""))
