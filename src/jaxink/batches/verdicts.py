"""Verdicts in a batch: what they mean, which of them are misfits, and what to do about these."""

import shlex
from collections.abc import Mapping
from typing import Any

from jaxink.batches.row import RESULTS, Row
from jaxink.diagnosis import VerdictCode
from jaxink.files.result_folder import SAMPLE_FILE
from jaxink.fitting import FitVerdictCode
from jaxink.measurement import option_words

_CODES: dict[str, FitVerdictCode | VerdictCode] = {
    str(code): code for kind in (FitVerdictCode, VerdictCode) for code in kind
}


def verdict_meaning(code: str) -> str:
    """What a verdict of a fit or of a diagnosis means; empty for one of another version."""
    return _CODES[code].meaning if code in _CODES else ""


def is_misfit(row: Row) -> bool:
    """Whether there is a result, and its model does not fit the measurement."""
    code = _CODES.get(row.verdict or "")
    return code is FitVerdictCode.MISFIT or (isinstance(code, VerdictCode) and code.structure_remains)


def standard_errors_hold(row: Row) -> bool:
    """Whether the standard errors of a result mean what they say."""
    return row.ended.has_result and row.ended.name == "DONE" and not is_misfit(row)


def what_to_do(misfit: Row, folder: str, reading: Mapping[str, Any]) -> tuple[list[str], str]:
    """Sentences on what to do about misfits, and the command for one of them.

    Parameters
    ----------
    misfit
        The one.
    folder
        That of the batch.
    reading
        Keywords of `jaxink.read` for its files.
    """
    if isinstance(_CODES[misfit.verdict or ""], VerdictCode):
        return ["The page of each says what remains, and what to do next."], ""
    sentences = [
        "If a sentence names a mistake in the input, correct that first.",
        'Otherwise find what the model lacks, for all with work = "both" in the plan, '
        f"for {misfit.name} with:",
    ]
    words = ["jaxink", "diagnose", *misfit.files, *option_words(reading)]
    words += ["--sample", f"{folder}/{RESULTS}/{misfit.name}/{SAMPLE_FILE}", "--out", f"{misfit.name}-report"]
    return sentences, shlex.join(words)
