"""The command that fits a sample to a measurement."""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.session import ExitCode
from jaxink.files.encoding import json_text
from jaxink.files.writing import require_folder, whole_folder
from jaxink.plots import FIGURE_FOLDER, save_figures

if TYPE_CHECKING:
    from jaxink import FitResult

SIMPLEX = "simplex"
# What would belong to an older result if it were not written anew.
OWNED = (FIGURE_FOLDER, SIMPLEX)


def run_fit(
    data_file: Path,
    sample_file: Path,
    out: Path,
    options: dict[str, Any],
    columns: dict[str, Any],
    formats: Sequence[str],
    output: str,
) -> ExitCode:
    """Fit a measurement and write the result.

    Parameters
    ----------
    data_file, sample_file
        Inputs.
    out
        Folder for the result.
    options
        Fields of `FitOptions`.
    columns
        What the CSV file does not state, as `read_csv` takes it.
    formats
        File formats of the figures.
    output
        ``tables``, ``json`` or ``quiet``.
    """
    require_folder(out, OWNED)
    data, sample = jaxink.read(data_file, **columns), jaxink.load_sample(sample_file)
    session.prepare_jax()
    chosen = jaxink.FitOptions(**options)
    with session.progress(quiet=output != "tables") as follow:
        result = jaxink.fit(data, sample, chosen, follow)
    files = write_result(result, out, formats)
    if output == "json":
        written = {**result.to_dict(), "files": [str(file) for file in files]}
        typer.echo(json_text(written))
    elif output == "tables":
        from jaxink.cli.fit_tables import console, show_result

        show_result(console(), result, files)
    return ExitCode.FITTED if result.converged else ExitCode.NOT_CONVERGED


def write_result(
    result: "FitResult",
    out: Path,
    formats: Sequence[str],
    inputs: Sequence[Path] = (),
    simplex: "FitResult | None" = None,
) -> list[Path]:
    """Write a result, its figures and what goes with it; all or nothing."""
    with whole_folder(out, owned=OWNED) as folder:
        result.write_into(folder)
        if simplex is not None:
            (folder / SIMPLEX).mkdir()
            simplex.write_into(folder / SIMPLEX)
        for file in inputs:
            shutil.copyfile(file, folder / file.name)
        if formats:
            save_figures(result, folder / FIGURE_FOLDER, formats)
        return [out / file.relative_to(folder) for file in sorted(folder.rglob("*")) if file.is_file()]
