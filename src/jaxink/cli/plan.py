"""``jaxink plan``."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.fit_tables import console, show_files, show_lines
from jaxink.cli.one_measurement import is_described, is_of_many
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import json_text
from jaxink.files.reading import shown_path
from jaxink.files.result_folder import SAMPLE_FILE, result_file
from jaxink.files.writing import require_file, written_whole
from jaxink.measurement import write_csv
from jaxink.sample import text_of

if TYPE_CHECKING:
    from jaxink import FitResult, JointResult
    from jaxink.numerics.progress import Progress
    from jaxink.planning import MeasurementPlan


def run_plan(
    source: Path, targets: Sequence[str], readings: int, out: Path | None, seed: int, output: str
) -> ExitCode:
    """Rank further measurements for a fit, and write the project file of the first if asked to.

    Parameters
    ----------
    source
        Folder of a fit, of a joint fit or of a diagnosis; or a project file, which is fitted first.
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

    with session.progress(quiet=output != "tables") as follow:
        result = _fitted(source, follow)
        plan = plan_measurement(result, targets, readings, seed, follow)
    files = [] if out is None else _write(plan, result, source, out)
    if output == "json":
        typer.echo(json_text(plan.to_dict() | {"files": [str(file) for file in files]}))
    elif output == "tables":
        to, card = console(), plan.card()
        if is_described(source):
            to.print(f"The fit of {shown_path(source)}: {result.verdict.sentence}", soft_wrap=True)
        for sentence in card.sentences:
            to.print(sentence, style="bold", soft_wrap=True)
        to.print("\n".join(["", *plan.table().lines()]), soft_wrap=True)
        show_lines(to, "Notes", card.remarks)
        show_files(to, files)
    return ExitCode.FITTED


def _fitted(source: Path, follow: "Progress | None") -> "FitResult | JointResult":
    """The fit of a project file, or that in a folder."""
    if not is_described(source):
        return jaxink.load_joint_result(source) if is_of_many(source) else jaxink.load_result(source)
    if not is_of_many(source):
        raise InputRefusedError(
            f"{shown_path(source)}: is a sample file; a plan takes the folder of a fit, or a project file, "
            "which names measurements."
        )
    return jaxink.fit(jaxink.load_project(source), progress=follow)


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
    present, measured = dict[str, str](), dict[Path, jaxink.GonioData]()
    sample, project = "", ""
    if isinstance(result, jaxink.FitResult):
        # From the folder of the new file, as a project file names its files.
        place = result_file(source).parent / SAMPLE_FILE
        sample = os.path.relpath(place, out.parent)
        # As it was read: the file may need options to be read, and its name is from another folder.
        present = {"present": "present.csv"}
        measured = {out.parent / "present.csv": result.data}
    # Elsewhere, the files that the project names would not be found.
    if is_described(source) and source.resolve().parent == out.resolve().parent:
        project = text_of(source, "project")
    texts = next_project(candidate, present, sample, project)
    files = {out if name == "next.toml" else out.parent / name: text for name, text in texts.items()}
    for path in (*files, *measured):
        if path.exists():
            raise InputRefusedError(f"{path}: exists already; move it away, or choose another folder.")
    for path, data in measured.items():
        write_csv(data, path, [f"as read from {data.source}"] if data.source else [])
    for path, text in files.items():
        with written_whole(path) as part:
            part.write_text(text, encoding="utf-8")
    return [*files, *measured]
