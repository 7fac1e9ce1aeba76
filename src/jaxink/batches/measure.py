"""The work on one measurement: a pure function from a task to its row and its files."""

import dataclasses
import platform
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import jaxink
from jaxink.batches.folder import Done, now, trouble
from jaxink.batches.row import RESULTS, Row, RowColour, RowOutcome, RowParameter
from jaxink.batches.task import MeasurementTask
from jaxink.colour import colours_if_any, shown_colour
from jaxink.diagnosis import Diagnosis, DiagnosisOptions
from jaxink.errors import JaxinkError
from jaxink.fitting import FitOptions, FitResult, check_input
from jaxink.measurement import GonioData, option_words
from jaxink.numerics.failures import Failures
from jaxink.plots import FIGURE_FOLDER
from jaxink.report import fit_drawings, fit_page
from jaxink.sample import sample_from_dict

DIAGNOSIS = "diagnosis"
FIT_PAGE, DIAGNOSIS_PAGE = "fit.html", "report.html"


def measure(task: MeasurementTask) -> Done:
    """Fit or diagnose one measurement; whatever goes wrong is a row with its sentence."""
    start = time.perf_counter()
    try:
        done = _worked(task)
    except JaxinkError as problem:
        done = trouble(task, RowOutcome.REFUSED, str(problem))
    except MemoryError as problem:
        done = trouble(task, RowOutcome.FAILED, f"not enough memory ({_line(problem)}).")
    except Exception as problem:
        what = f"unexpected error ({type(problem).__name__}: {_line(problem)}); please report it."
        done = trouble(task, RowOutcome.FAILED, what)
    seconds = round(time.perf_counter() - start, 3)
    return Done(dataclasses.replace(done.row, seconds=seconds), done.files)


def _line(problem: BaseException) -> str:
    return " ".join(str(problem).split())[:200]


def _worked(task: MeasurementTask) -> Done:
    data, sample = _read(task), sample_from_dict(task.sample)
    sample.parameters.require_ranges()
    result, files = None, dict[str, bytes]()
    if task.work != "diagnose":
        result = jaxink.fit(data, sample, FitOptions(**task.fit))
        result = check_input(result) if task.checks_input else result
        files |= _fit_files(result, task)
    if task.work == "fit":
        assert result is not None
        return Done(_row_of_fit(task, result), files)
    options = DiagnosisOptions(**task.diagnosis, fit=FitOptions(**{"profile": "none"} | task.fit))
    found = jaxink.diagnose(data, sample, options, fitted=result)
    inside = "" if task.work == "diagnose" else f"{DIAGNOSIS}/"
    place = f"{RESULTS}/{task.name}/{inside}".rstrip("/")
    files |= {f"{inside}{name}": content for name, content in _diagnosis_files(found, task, place).items()}
    return Done(_row_of_diagnosis(task, found, f"{inside}{DIAGNOSIS_PAGE}"), files)


def _read(task: MeasurementTask) -> GonioData:
    """The measurement; sentences name the files where the user has them."""
    with _in_folder(task) as (folder, files):
        try:
            return jaxink.read(files[0] if len(files) == 1 else files, **task.reading)
        except JaxinkError as problem:
            sentence = str(problem)
            for path, file in zip(task.paths, files, strict=True):
                sentence = sentence.replace(str(file), path)
            raise type(problem)(sentence.replace(f"{folder}/", "")) from None


@contextmanager
def _in_folder(task: MeasurementTask) -> Iterator[tuple[Path, list[Path]]]:
    """The files of a task with their own names, for readers that open files."""
    with tempfile.TemporaryDirectory(prefix="jaxink-batch-") as folder:
        files, names = [], [Path(path).name for path in task.paths]
        for i, (name, content) in enumerate(zip(names, task.contents, strict=True)):
            place = Path(folder)
            if names.count(name) > 1:
                place = place / str(i)
                place.mkdir()
            (place / name).write_bytes(content)
            files.append(place / name)
        yield Path(folder), files


def _fit_files(result: FitResult, task: MeasurementTask) -> dict[str, bytes]:
    """Files of a fit as ``jaxink fit --out`` writes them, and its page."""
    files = dict(result.files())
    failures = Failures()
    drawn, picture = fit_drawings(result, ("png",) * task.with_figures, None, failures)
    files |= {f"{FIGURE_FOLDER}/{name}": content for name, content in drawn.items()}
    text = fit_page(result, picture, (), failures.found, task.name)
    return files | {FIT_PAGE: text.encode()}


def _diagnosis_files(found: Diagnosis, task: MeasurementTask, place: str) -> dict[str, bytes]:
    """Files of a diagnosis as ``jaxink diagnose --out`` writes them; ``place`` is from the batch's folder."""
    from jaxink.report import write_report

    with tempfile.TemporaryDirectory(prefix="jaxink-batch-") as folder:
        root = Path(folder) / task.name
        written = write_report(found, root, task.with_figures, [*task.paths, *option_words(task.reading)])
        files = {file.relative_to(root).as_posix(): file.read_bytes() for file in written}
        # Commands on the page name the folder where the user will have it.
        return files | {DIAGNOSIS_PAGE: files[DIAGNOSIS_PAGE].replace(str(root).encode(), place.encode())}


def _parameters(result: FitResult) -> tuple[RowParameter, ...]:
    return tuple(
        RowParameter(p.name, p.unit, _known(p.value), p.standard_error, p.flag)
        for p in result.parameters.free
    )


def _known(value: float | None) -> float | None:
    return value if value is not None and abs(value) < float("inf") else None


def _row(task: MeasurementTask, result: FitResult, verdict: str, sentence: str, page: str) -> Row:
    outcome = RowOutcome.DONE if result.outcome.is_as_asked else RowOutcome.NOT_CONVERGED
    merit = result.merit
    return Row(
        name=task.name,
        files=task.paths,
        inputs=task.inputs,
        outcome=outcome,
        sentence=sentence,
        verdict=verdict,
        points=merit.points,
        chi_square=_known(merit.chi_square),
        reduced_chi_square=_known(merit.reduced_chi_square),
        parameters=_parameters(result),
        host=platform.node(),
        finished=now(),
        page=f"{RESULTS}/{task.name}/{page}",
        colour=_colour(result),
    )


def _colour(result: FitResult) -> RowColour | None:
    found = colours_if_any(result.data, result.predicted_per_sr)
    one = None if found is None else shown_colour(found)
    return None if one is None else RowColour(one.direction, one.light, *one.fitted_lab)


def _row_of_fit(task: MeasurementTask, result: FitResult) -> Row:
    return _row(task, result, result.verdict.code, result.verdict.sentence, FIT_PAGE)


def _row_of_diagnosis(task: MeasurementTask, found: Diagnosis, page: str) -> Row:
    row = _row(task, found.corrected, found.verdict.code, found.verdict.sentence, page)
    return dataclasses.replace(row, effects=tuple(step.effect for step in found.steps))
