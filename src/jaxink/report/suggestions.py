"""What to do after a fit or a diagnosis: sentences and the commands to type."""

import dataclasses
import shlex
from collections.abc import Sequence
from pathlib import Path

from jaxink.diagnosis import Diagnosis, VerdictCode
from jaxink.files.result_folder import MEASUREMENTS, SAMPLE_FILE
from jaxink.fitting import FitResult, JointResult


@dataclasses.dataclass(frozen=True)
class NextStep:
    """Something to do.

    Parameters
    ----------
    words
        What it is good for.
    command
        To be typed as it is; empty if there is none.
    """

    words: str
    command: str = ""

    def lines(self) -> list[str]:
        """Both, for a terminal."""
        return [self.words, *([f"  {self.command}"] if self.command else [])]


def next_steps(
    diagnosis: Diagnosis, folder: str | Path, inputs: Sequence[str] = (), sample_file: str = ""
) -> list[NextStep]:
    """Steps after a diagnosis, the most important first.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    folder
        Folder of its report.
    inputs
        Words of a command for the measurement: its files, and options that say how to read them. None: the
        name of the measurement.
    sample_file
        The sample file of the diagnosis; empty: not known.
    """
    sample_file = sample_file or "SAMPLE.toml"
    measured, folder = list(inputs) or [diagnosis.declared.data.source or "DATA.csv"], str(folder)
    code = diagnosis.verdict.code
    if code is VerdictCode.INPUT_MISTAKE:
        again = _command("diagnose", *measured, "--sample", sample_file, "--out", folder)
        return [NextStep("Correct the mistake named above and diagnose again:", again)]
    if code is VerdictCode.NOT_TESTABLE:
        return [NextStep("Fix parameters that you know, or measure more points, and diagnose again.")]
    steps = []
    if code is VerdictCode.UNFINISHED:
        again = _command("diagnose", *measured, "--sample", sample_file, "--out", folder, "--resume")
        steps.append(NextStep("Go on where the time limit ended the diagnosis:", again))
    steps += [
        NextStep(f"Measure {f.measurement}: it distinguishes {' from '.join(f.effects)}.")
        for f in diagnosis.further[:1]
    ]
    own = str(Path(folder) / "sample.toml")
    if code.structure_remains:
        again = _command("diagnose", *measured, "--sample", own, "--out", f"{folder}-2")
        steps.append(NextStep("Declare what is known of the remaining residual, and diagnose again:", again))
    if diagnosis.steps:
        fit = _command("fit", *measured, "--sample", own, "--out", f"{folder}-fit")
        steps.append(NextStep("Fit the corrected model, or change its sample file first:", fit))
    caution = " (the model does not fit yet)" if diagnosis.structure_remains else ""
    return [*steps, *_use(folder, caution)]


def fit_next_steps(
    result: FitResult, folder: str | Path, inputs: Sequence[str] = (), sample_file: str = ""
) -> list[NextStep]:
    """Steps after a fit, the most important first.

    Parameters
    ----------
    result
        The fit.
    folder
        Folder of its result.
    inputs
        See `next_steps`.
    sample_file
        The sample file of the fit; empty: that of the result.
    """
    folder = str(folder)
    measured = list(inputs) or [result.data.source or "DATA.csv"]
    sample = sample_file or str(Path(folder) / SAMPLE_FILE)
    verdict = result.verdict
    if not result.outcome.is_as_asked:
        on = _command("fit", *measured, "--sample", folder, "--out", f"{folder}-continued")
        return [NextStep("Go on from where the search ended, or by another method (--method):", on)]
    if any(mistake.is_named for mistake in result.mistakes):
        again = _command("fit", *measured, "--sample", sample, "--out", folder)
        return [NextStep("Correct the mistake named above and fit again:", again)]
    if not verdict.is_misfit:
        caution = "" if verdict.code == "consistent" else " (whether the model fits is not known)"
        return _use(folder, caution)
    look = _command("diagnose", *measured, "--sample", sample, "--out", f"{folder}-report")
    return [NextStep("Find what the model lacks:", look)]


def joint_next_steps(result: JointResult, folder: str | Path) -> list[NextStep]:
    """Steps after a joint fit, the most important first.

    Parameters
    ----------
    result
        The fit.
    folder
        Folder of its result.
    """
    places = Path(folder) / MEASUREMENTS
    bsdfs = [name for name, one in result.measurements.items() if isinstance(one, FitResult)]
    if not result.outcome.is_as_asked:
        return [NextStep("Start elsewhere, or use another method (--method), and fit again.")]
    if result.agreement is not None and result.agreement.outlier is not None:
        odd = result.agreement.outlier.name
        look = places / odd / "report.html"
        return [NextStep(f"Look at the measurement '{odd}' ({look}), correct or remove it, and fit again.")]
    caution = " (the model does not fit yet)" if result.verdict.is_misfit else ""
    if result.verdict.is_misfit and bsdfs:
        diagnose = _command("diagnose", "PROJECT.toml", "--out", f"{folder}-report")
        return [NextStep("Find what the model lacks:", diagnose)]
    if not bsdfs:
        sample = str(places / next(iter(result.measurements)) / SAMPLE_FILE)
        predict = _command("predict", sample, "OTHER.csv", "--out", "predicted.csv")
        return [NextStep(f"Predict a BSDF in the directions of a file{caution}:", predict)]
    further = NextStep(f"See what to measure next{caution}:", _command("plan", str(folder)))
    return [further, *_use(str(places / bsdfs[0]), caution)]


def _use(folder: str, caution: str) -> list[NextStep]:
    """What a model is good for."""
    predict = _command("predict", folder, "OTHER.csv", "--out", "predicted.csv")
    ink = ("--format", "mitsuba", "--allow-loss", "standard_errors", "--out", f"{folder}-export")
    words = "Export the ink to a ray tracer (other formats: jaxink export --help)"
    return [
        NextStep(f"Predict another measurement{caution}:", predict),
        NextStep(f"{words}{caution}:", _command("export", folder, *ink)),
    ]


def _command(*words: str) -> str:
    return shlex.join(["jaxink", *words])
