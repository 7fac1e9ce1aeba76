"""Fit a sample to a measurement, or to several."""

from collections.abc import Sequence
from pathlib import Path
from typing import overload

from jaxink.effects import settled
from jaxink.errors import InputRefusedError, require_kind
from jaxink.fitting.assembly import assemble
from jaxink.fitting.inputs import prepare_data, read_inputs, require_sample
from jaxink.fitting.joint_fit import fit_project
from jaxink.fitting.joint_result import JointResult
from jaxink.fitting.multistart import minimise
from jaxink.fitting.objective import Objective, make_objective
from jaxink.fitting.options import FitOptions
from jaxink.fitting.result import FitResult
from jaxink.measurement import GonioData, noise_of
from jaxink.numerics.precision import computing, release_programs
from jaxink.numerics.progress import Progress, log_progress
from jaxink.projects import Project
from jaxink.sample import Sample
from jaxink.solver import SolverConfig


@overload
def fit(
    data: Project,
    sample: None = None,
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> JointResult: ...
@overload
def fit(
    data: GonioData | str | Path | Sequence[str | Path],
    sample: Sample | str | Path,
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> FitResult: ...
def fit(
    data: GonioData | str | Path | Sequence[str | Path] | Project,
    sample: Sample | str | Path | None = None,
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> FitResult | JointResult:
    """Fit the free parameters of a sample to a measurement, or those of a project to all of its measurements.

    Computes with 64 bits whatever the session's setting, which is restored.

    Parameters
    ----------
    data
        Measurement, its file, or a list of files, whose rows are joined; or a project.
    sample
        Sample, or its file; None for a project, which has its own.
    options
        None for the defaults.
    progress
        Called with the task, the step and the loss.

    Raises
    ------
    InputRefusedError
        Data or sample are invalid.
    """
    options = FitOptions() if options is None else options
    require_kind("options", options, FitOptions)
    progress = progress or log_progress
    if isinstance(data, Project):
        if sample is not None:
            raise InputRefusedError("a project has its own samples; leave the sample out.")
        release_programs()
        with computing():
            return fit_project(data, options, progress)
    data, sample = read_inputs(data, require_sample(sample))
    data = prepare_data(data, sample)
    release_programs()
    with computing():
        return _fit(data, sample, options, progress)


def _fit(data: GonioData, sample: Sample, options: FitOptions, progress: Progress) -> FitResult:
    noise = noise_of(data, sample.noise)
    if options.objective == "chi_square" and not noise.known:
        raise InputRefusedError(
            f"{data.source or 'the measurement'}: its noise is {noise.origin} Declare it in [noise] of the "
            "sample file, or choose another objective."
        )
    sample = settled(sample, data)
    free = sample.parameters.free
    scans_first = options.scans_first and any(p.multimodal for p in free)

    def objective_at(config: SolverConfig | None) -> Objective:
        how = options.accuracy, options.layer_method
        made = make_objective(data, sample, options.objective, config, noise, *how)
        return made.tabulated() if scans_first else made

    objective, found = minimise(objective_at, free, options, progress)
    assert isinstance(objective, Objective)
    return assemble(data, sample, options, noise, objective, found.for_noise_of(noise.degrees_of_freedom))
