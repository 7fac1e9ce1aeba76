"""A diagnosis that was saved, loaded again."""

import dataclasses
from collections.abc import Collection
from pathlib import Path
from typing import Any

from jaxink.diagnosis.findings.report_reading import read_report
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.display.brief import brief_repr
from jaxink.errors import require_one_of
from jaxink.files.decoding import Rules, decode
from jaxink.files.result_folder import CORRECTED, DECLARED
from jaxink.fitting import FitResult, load_result

_CODES = {code.value: code for code in VerdictCode}


@dataclasses.dataclass(frozen=True)
class SavedDiagnosis:
    """What `load_diagnosis` reads.

    Parameters
    ----------
    declared, corrected
        Fits of the declared and of the corrected model.
    verdict
        The verdict.
    report
        All of ``report.json``, as `jaxink.diagnosis.read_report` returns it.
    """

    __repr__ = brief_repr

    declared: FitResult
    corrected: FitResult
    verdict: Verdict
    report: dict[str, Any]


def load_diagnosis(folder: str | Path, effects: Collection[Any] = ()) -> SavedDiagnosis:
    """Read a diagnosis that `jaxink diagnose` or `Diagnosis.save` wrote.

    Parameters
    ----------
    folder
        Its folder, or the ``report.json`` in it.
    effects
        Classes of effects of your own that the samples declare.

    Raises
    ------
    InputRefusedError
        A file is missing or invalid.
    """
    folder = Path(folder)
    folder = folder.parent if folder.is_file() else folder
    report = read_report(folder)
    rules = Rules(made_of={VerdictCode: (str, _code)})
    verdict = decode(Verdict, report["verdict"], "verdict", rules)
    declared, corrected = (load_result(folder / name, effects) for name in (DECLARED, CORRECTED))
    return SavedDiagnosis(declared, corrected, verdict, report)


def _code(word: str) -> VerdictCode:
    require_one_of("code", word, tuple(_CODES))
    return _CODES[word]
