"""A diagnosis that was saved: loaded again, and its corrected model applied to another measurement."""

import dataclasses
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxink.diagnosis.findings.diagnosis import Diagnosis
from jaxink.diagnosis.findings.report_reading import read_report
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.diagnosis.search.candidate_objective import CandidateObjective
from jaxink.diagnosis.search.refit import Estimate, estimates
from jaxink.display.brief import brief_repr
from jaxink.display.named_rows import NamedRows
from jaxink.effects import Scene
from jaxink.errors import require_one_of
from jaxink.files.decoding import Rules, decode
from jaxink.files.result_folder import CORRECTED, DECLARED
from jaxink.fitting import FitResult, load_result, prepare_data
from jaxink.measurement import GonioData, noise_of
from jaxink.numerics.precision import computing

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


@dataclasses.dataclass(frozen=True)
class Transfer:
    """A model applied to a measurement other than the one it was found on.

    Parameters
    ----------
    data
        The measurement; points that are not used are masked.
    values
        Of all parameters.
    standard_errors
        Of the refitted parameters; None for those at a bound.
    predicted_per_sr, whitened
        At the used points; `whitened` in units of the noise, without the weights of the sample file.
    """

    data: GonioData
    values: dict[str, float]
    standard_errors: dict[str, float | None]
    predicted_per_sr: Float[np.ndarray, " points"]
    whitened: Float[np.ndarray, " points"]

    __repr__ = brief_repr

    @property
    def parameters(self) -> NamedRows[Estimate]:
        """All parameters with the standard errors of those refitted."""
        return NamedRows({n: Estimate(v, self.standard_errors.get(n)) for n, v in self.values.items()})


def transfer(found: Diagnosis | SavedDiagnosis | FitResult, data: GonioData, is_refitted: bool) -> Transfer:
    """Predict a measurement with the corrected model of a diagnosis, or with a fitted one.

    Parameters
    ----------
    found
        From another measurement of the same kind of sample.
    data
        May have other wavelengths, unless the sample has parameters given by wavelength.
    is_refitted
        Whether to refit all free parameters or to keep their values.

    Raises
    ------
    InputRefusedError
        The sample is not defined at the wavelengths of the data, or the noise is unknown.
    """
    result = found if isinstance(found, FitResult) else found.corrected
    wavelengths = tuple(np.unique(data.wavelength_nm).tolist())
    sample = dataclasses.replace(result.sample, wavelengths_nm=wavelengths)
    data = prepare_data(data, sample)
    free = sample.parameters.free
    with computing():
        scene = Scene.of_used(data)
        noise = noise_of(data, sample.noise)
        objective = CandidateObjective(sample, (), data, noise, result.config, scene, max(len(free), 1))
        values, errors = objective.start, dict[str, float | None]()
        if is_refitted:
            solution = objective.fit(values, objective.base_free)
            values, predicted = solution.values, solution.predicted_per_sr
            errors = {name: e.standard_error for name, e in estimates(objective, solution).items()}
        else:
            predicted = objective.predict(values)
        left = objective.in_noise(predicted, objective.measured - predicted)
    return Transfer(data, values, errors, predicted, left)
