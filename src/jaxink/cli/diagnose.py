"""The command that says what a sample's description lacks."""

import json
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
from jaxink.errors import InputRefusedError


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
    options = _options(choices, accuracy)
    with progress(quiet=output != "tables") as follow:
        found = jaxink.diagnose(data, sample, options, follow)
    from jaxink.report import write_report

    written = write_report(found, out, with_figures)
    if output == "json":
        typer.echo(json.dumps(found.to_dict(), indent=1, allow_nan=False))
    elif output == "tables":
        from jaxink.cli.diagnosis_tables import show_diagnosis
        from jaxink.cli.tables import console

        show_diagnosis(console(), found, written)
    if not found.result.converged:
        return EXIT_NOT_CONVERGED
    return EXIT_UNEXPLAINED if found.structure_remains else EXIT_FITTED


def _options(choices: dict[str, Any], accuracy: float) -> "jaxink.DiagnosisOptions":
    """Choices, refused before anything is computed."""
    from jaxink.diagnosis import ScreenOptions

    for name in ("max_effects", "max_parameters"):
        if choices[name] is not None and choices[name] < 0:
            raise InputRefusedError(f"{name} is {choices[name]}; it must not be negative.")
    ScreenOptions(**{name: choices[name] for name in ("n_bootstrap", "level", "seed")})
    fit = jaxink.FitOptions(profile="none", accuracy=accuracy)
    return jaxink.DiagnosisOptions(**choices, fit=fit)
