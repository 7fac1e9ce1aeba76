"""The command that says what a sample's description lacks."""

from pathlib import Path
from typing import Any

import typer

import jaxink
from jaxink.cli.commands import FIGURES, read_data
from jaxink.cli.folder import require_folder
from jaxink.cli.session import (
    EXIT_FITTED,
    EXIT_NOT_CONVERGED,
    EXIT_UNEXPLAINED,
    prepare_jax,
    progress,
)
from jaxink.files.encoding import json_text


def run_diagnose(
    files: tuple[Path, Path, Path],
    choices: dict[str, Any],
    accuracy: float,
    columns: dict[str, Any],
    with_figures: bool,
    output: str,
) -> int:
    """Diagnose a measurement and write the report.

    Parameters
    ----------
    files
        Measurement, sample file, and the folder for the report.
    choices
        Fields of `DiagnosisOptions`.
    accuracy
        Of the discretisation.
    columns
        What the CSV file does not state, as `read_csv` takes it.
    with_figures
        Whether figures are drawn.
    output
        ``tables``, ``json`` or ``quiet``.

    Returns
    -------
    int
        Exit code.
    """
    data_file, sample_file, out = files
    require_folder(out, (FIGURES,))
    data, sample = read_data(data_file, columns), jaxink.load_sample(sample_file)
    prepare_jax()
    fit = jaxink.FitOptions(profile="none", accuracy=accuracy)
    options = jaxink.DiagnosisOptions(**choices, fit=fit)
    with progress(quiet=output != "tables") as follow:
        found = jaxink.diagnose(data, sample, options, follow)
    from jaxink.report import write_report

    written = write_report(found, out, with_figures)
    if output == "json":
        typer.echo(json_text(found.to_dict()))
    elif output == "tables":
        from jaxink.cli.diagnosis_tables import show_diagnosis
        from jaxink.cli.tables import console

        show_diagnosis(console(), found, written)
    if not found.result.converged:
        return EXIT_NOT_CONVERGED
    return EXIT_UNEXPLAINED if found.structure_remains else EXIT_FITTED
