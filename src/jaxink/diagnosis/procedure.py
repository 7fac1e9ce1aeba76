"""The complete diagnosis of a measurement: fit, search, judge."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import overload

import numpy as np

from jaxink.diagnosis.findings.assembly import diagnosis_of, explains_all
from jaxink.diagnosis.findings.diagnosis import Diagnosis
from jaxink.diagnosis.joint.joint_diagnosis import JointDiagnosis
from jaxink.diagnosis.joint.search import diagnose_project
from jaxink.diagnosis.search.checkpoint import Checkpoint
from jaxink.diagnosis.search.deadline import Deadline, OptionalTask
from jaxink.diagnosis.search.loop import search_effects
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.search.problem import problem_of
from jaxink.diagnosis.search.unfinished import Unfinished
from jaxink.errors import InputRefusedError, require_kind
from jaxink.fitting import FitResult, check_input, fit, read_inputs, require_sample, weights_of
from jaxink.measurement import USER, GonioData
from jaxink.numerics.failures import Failures
from jaxink.numerics.precision import computing, release_programs
from jaxink.numerics.progress import Progress, log_progress
from jaxink.projects import Project
from jaxink.sample import Sample


@overload
def diagnose(
    data: Project,
    sample: None = None,
    options: DiagnosisOptions | None = None,
    progress: Progress | None = None,
) -> JointDiagnosis: ...
@overload
def diagnose(
    data: GonioData | str | Path | Sequence[str | Path],
    sample: Sample | str | Path,
    options: DiagnosisOptions | None = None,
    progress: Progress | None = None,
    fitted: FitResult | None = None,
    unfinished: Unfinished | None = None,
) -> Diagnosis: ...
def diagnose(
    data: GonioData | str | Path | Sequence[str | Path] | Project,
    sample: Sample | str | Path | None = None,
    options: DiagnosisOptions | None = None,
    progress: Progress | None = None,
    fitted: FitResult | None = None,
    unfinished: Unfinished | None = None,
) -> Diagnosis | JointDiagnosis:
    """Test whether a model lacks something, identify and add it, and report the error before and after.

    A refit, a candidate or another part that fails is left out and named in the result.

    Parameters
    ----------
    data
        Measurement, its file, or a list of files, whose rows are joined; or a project.
    sample
        Sample as declared, or its file; None for a project, which has its own.
    options
        None for the defaults.
    progress
        Called with the task, the step and the misfit.
    fitted
        Fit of this measurement and sample, if there is one already.
    unfinished
        Where finished pieces are kept, and taken from if the same diagnosis was stopped before; see
        `Unfinished`.

    Raises
    ------
    InputRefusedError
        Data or sample are invalid, or the noise is unknown.
    """
    options = DiagnosisOptions() if options is None else options
    require_kind("options", options, DiagnosisOptions)
    if isinstance(data, Project):
        if sample is not None or fitted is not None or unfinished is not None:
            raise InputRefusedError("a project has its own samples and fits; leave out all but the options.")
        release_programs()
        with computing():
            return diagnose_project(data, options, progress or log_progress)
    data, sample = read_inputs(data, require_sample(sample))
    follow = progress or log_progress
    deadline, failures = Deadline(options.time_limit_s), Failures()
    if fitted is None and unfinished is not None:
        fitted = unfinished.fitted()
    if fitted is None:
        data = _without_weightless(data, sample)
        fitted = fit(data, sample, options.fit, progress)
    checkpoint = Checkpoint() if unfinished is None else unfinished.begin(fitted)
    result = fitted if fitted.mistakes else _checked(fitted, deadline, failures, follow)
    if unfinished is not None and result.mistakes:
        unfinished.keep(result)
    if explains_all(result.mistakes, options.policy):
        # Effects would only imitate the mistake.
        options = dataclasses.replace(options, catalogue=(), max_effects=0)
    with computing():
        problem = problem_of(result, sample, options, follow, deadline, failures, checkpoint)
        return diagnosis_of(search_effects(problem, result, options))


class _TimeIsUp(Exception):  # noqa: N818 - it ends a task, and is no error
    pass


def _checked(fitted: FitResult, deadline: Deadline, failures: Failures, follow: Progress) -> FitResult:
    """The fit with mistakes in its input, or as it is if there is no time to look for them."""

    def follow_in_time(what: str, step: int, misfit: float) -> None:
        follow(what, step, misfit)
        if deadline.is_over:
            raise _TimeIsUp

    if not deadline.permits(OptionalTask.INPUT_CHECK):
        return fitted
    try:
        return check_input(fitted, follow_in_time, failures)
    except _TimeIsUp:
        deadline.permits(OptionalTask.INPUT_CHECK)
        return fitted


def _without_weightless(data: GonioData, sample: Sample) -> GonioData:
    """Mask points of weight 0, whose residuals do not count."""
    weightless = np.zeros(len(data), bool)
    weightless[data.used] = weights_of(data, sample) == 0
    return data.replace(mask=data.mask | (USER.bit * weightless).astype(np.uint32))
