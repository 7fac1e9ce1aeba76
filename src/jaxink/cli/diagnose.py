"""``jaxink diagnose``."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.session import ExitCode
from jaxink.files.encoding import json_text
from jaxink.files.result_folder import CORRECTED, DECLARED, SAMPLE_FILE
from jaxink.files.writing import require_folder
from jaxink.plots import FIGURE_FOLDER


def run_diagnose(
    data_files: Sequence[Path],
    sample_file: Path,
    out: Path,
    choices: dict[str, Any],
    accuracy: float,
    columns: dict[str, Any],
    with_figures: bool,
    output: str,
) -> ExitCode:
    """Diagnose a measurement and write the report to the folder ``out``.

    ``choices`` are fields of `DiagnosisOptions`, ``columns`` keywords of `jaxink.read`; ``output`` is
    ``tables``, ``json`` or ``quiet``.
    """
    require_folder(out, (FIGURE_FOLDER, DECLARED, CORRECTED))
    data, sample = jaxink.read(data_files, **columns), jaxink.load_sample(sample_file)
    session.prepare_jax()
    fit = jaxink.FitOptions(profile="none", accuracy=accuracy)
    options = jaxink.DiagnosisOptions(**choices, fit=fit)
    with session.progress(quiet=output != "tables") as follow:
        found = jaxink.diagnose(data, sample, options, follow)
    from jaxink.report import write_report

    written = write_report(found, out, with_figures)
    if output == "json":
        typer.echo(json_text(found.to_dict()))
    elif output == "tables":
        from jaxink.cli.diagnosis_tables import show_diagnosis
        from jaxink.cli.fit_tables import console

        show_diagnosis(console(), found, written, next_commands(found, data_files, out))
    if not found.declared.converged:
        return ExitCode.NOT_CONVERGED
    return ExitCode.UNEXPLAINED if found.structure_remains else ExitCode.FITTED


def next_commands(found: "jaxink.Diagnosis", data_files: Sequence[Path], out: Path) -> list[str]:
    """Commands that go on from the folder of a diagnosis."""
    if any(mistake.is_named for mistake in found.declared.mistakes):
        return []
    export = [session.program(), "export", str(out), "--format", "zemax", "--out", "ink-files"]
    export += ["--allow-loss", "regular,beyond_critical,standard_errors"]
    if not found.steps:
        return [shlex.join(export)]
    fit = [session.program(), "fit", *map(str, data_files), "--sample", str(out / SAMPLE_FILE)]
    return [shlex.join(export), shlex.join([*fit, "--out", "fit"])]
