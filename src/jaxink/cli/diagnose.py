"""``jaxink diagnose``."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.fit import input_words
from jaxink.cli.session import ExitCode
from jaxink.files.encoding import json_text
from jaxink.files.result_folder import REPORT_FILE, UNFINISHED, require_not_replaced
from jaxink.files.writing import require_folder
from jaxink.numerics.failures import Failures


def run_diagnose(
    data_files: Sequence[Path],
    sample_file: Path,
    out: Path,
    choices: dict[str, Any],
    accuracy: float,
    columns: dict[str, Any],
    with_figures: bool,
    output: str,
    is_resumed: bool,
) -> ExitCode:
    """Diagnose a measurement and write the report to the folder ``out``.

    ``choices`` are fields of `DiagnosisOptions`, ``columns`` keywords of `jaxink.read`; ``output`` is
    ``tables``, ``json`` or ``quiet``. ``is_resumed``: go on from what a stopped one left in ``out``.
    """
    require_folder(out)
    require_not_replaced(out, [*data_files, sample_file], REPORT_FILE)
    data, sample = jaxink.read(data_files, **columns), jaxink.load_sample(sample_file)
    session.prepare_jax()
    figures = ["jaxink.plots.diagnosis_pages"] if with_figures else []
    session.import_meanwhile("xarray", *figures)
    fit = jaxink.FitOptions(profile="none", accuracy=accuracy)
    options = jaxink.DiagnosisOptions(**choices, fit=fit)
    unfinished = jaxink.diagnosis.Unfinished(out / UNFINISHED, data, sample, options)
    if not is_resumed:
        unfinished.clear()
    elif output != "quiet":
        typer.echo(f"jaxink: {unfinished.sentence}", err=True)
    try:
        with session.progress(quiet=output != "tables") as follow:
            found = jaxink.diagnose(data, sample, options, follow, unfinished=unfinished)
    except KeyboardInterrupt:
        typer.echo("jaxink: what is finished is kept; go on with the same command and --resume.", err=True)
        raise
    from jaxink.report import next_steps, write_report

    inputs = input_words(data_files, columns)
    failures = Failures()
    stated = str(sample_file)
    written = write_report(found, out, with_figures, inputs, failures=failures, sample_file=stated)
    session.show_failures(failures)
    if found.time_limit is None or not found.time_limit.not_done:
        unfinished.clear()
    if output == "json":
        typer.echo(json_text(found.to_dict()))
    elif output == "tables":
        from jaxink.cli.diagnosis_tables import show_diagnosis
        from jaxink.cli.fit_tables import console

        show_diagnosis(console(), found, written, next_steps(found, out, inputs, stated))
    if not found.declared.converged:
        return ExitCode.NOT_CONVERGED
    if found.verdict.code is jaxink.diagnosis.VerdictCode.UNFINISHED:
        return ExitCode.UNFINISHED
    return ExitCode.UNEXPLAINED if found.structure_remains else ExitCode.FITTED
