"""``jaxink plan``."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.fit_tables import console, show_files, show_lines
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import json_text
from jaxink.files.result_folder import JOINT_FILE, SAMPLE_FILE, result_file
from jaxink.files.writing import require_file, written_whole

if TYPE_CHECKING:
    from jaxink import FitResult, JointResult
    from jaxink.planning import MeasurementPlan


def run_plan(
    source: Path, targets: Sequence[str], readings: int, out: Path | None, seed: int, output: str
) -> ExitCode:
    """Rank further measurements for the fit in a folder, and write the project file of the first if asked to.

    Parameters
    ----------
    source
        Folder of a fit, of a joint fit or of a diagnosis.
    targets
        Parameters that are to be determined; empty: all.
    readings
        Number of readings of each measurement.
    out
        Project file with the first of them; its table is written beside it. None for none.
    seed
        Of simulated fits.
    output
        ``tables``, ``json`` or ``quiet``.
    """
    if out is not None:
        _require_new(out)
    session.prepare_jax()
    from jaxink.planning import plan_measurement

    is_joint = os.path.lexists(source / JOINT_FILE) or source.name == JOINT_FILE
    result = jaxink.load_joint_result(source) if is_joint else jaxink.load_result(source)
    with session.progress(quiet=output != "tables") as follow:
        plan = plan_measurement(result, targets, readings, seed, follow)
    files = [] if out is None else _write(plan, result, source, out)
    if output == "json":
        typer.echo(json_text(plan.to_dict() | {"files": [str(file) for file in files]}))
    elif output == "tables":
        to, card = console(), plan.card()
        for sentence in card.sentences:
            to.print(sentence, style="bold", soft_wrap=True)
        to.print("\n".join(["", *plan.table().lines()]), soft_wrap=True)
        show_lines(to, "Notes", card.remarks)
        show_files(to, files)
    return ExitCode.FITTED


def _require_new(out: Path) -> None:
    """Reject a project file that exists, or has another suffix."""
    if out.suffix != ".toml":
        raise InputRefusedError(f"{out}: the suffix is '{out.suffix}'; a project file is a .toml file.")
    if out.exists():
        raise InputRefusedError(f"{out}: exists already; choose another name.")
    require_file(out)


def _write(plan: "MeasurementPlan", result: "FitResult | JointResult", source: Path, out: Path) -> list[Path]:
    """The project file with the first measurement, and the table to be filled in."""
    from jaxink.planning import next_project

    candidate = plan.candidates[plan.best.name]
    present, sample = dict[str, str](), ""
    if isinstance(result, jaxink.FitResult):
        # From the folder of the new file, as a project file names its files.
        place = result_file(source).parent / SAMPLE_FILE
        sample = os.path.relpath(place, out.parent)
        present = {"present": result.data.source or "DATA.csv"}
    texts = next_project(candidate, present, sample)
    paths = []
    for name, text in texts.items():
        path = out if name == "next.toml" else out.parent / name
        if path.exists():
            raise InputRefusedError(f"{path}: exists already; move it away, or choose another folder.")
        paths.append((path, text))
    for path, text in paths:
        with written_whole(path) as part:
            part.write_text(text, encoding="utf-8")
    return [path for path, _ in paths]
