"""``jaxink fit PROJECT.toml``."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.fit import write_with_page
from jaxink.cli.fit_tables import console, show_files, show_lines, show_minima, show_parameters
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import json_text
from jaxink.files.result_folder import JOINT_FILE, MEASUREMENTS, PAGE_FILE, require_not_replaced
from jaxink.files.writing import require_folder
from jaxink.numerics.failures import Failures

if TYPE_CHECKING:
    from jaxink import JointResult


def require_project_alone(files: Sequence[Path], columns: dict[str, Any], sample_file: Path | None) -> Path:
    """The project file of a command; what the file itself states is rejected beside it."""
    if len(files) != 1:
        raise InputRefusedError(
            f"{files[0]} is a project file, which names its measurements; leave out the other files."
        )
    if sample_file is not None:
        raise InputRefusedError(f"{files[0]} is a project file, which names its sample; leave out --sample.")
    if columns:
        # Which rows are read is stated beside how.
        reading = [name for name in columns if name != "rows"]
        where = [f"{', '.join(reading)} in the table `reading`"] if reading else []
        where += ["`rows`"] if "rows" in columns else []
        raise InputRefusedError(
            f"{files[0]} is a project file; state {' and '.join(where)} of its measurements."
        )
    return files[0]


def run_joint_fit(
    project_file: Path, out: Path, options: dict[str, Any], formats: Sequence[str], output: str
) -> ExitCode:
    """Fit a project and write the result to the folder ``out``; other parameters as for `run_fit`."""
    require_folder(out)
    project = jaxink.load_project(project_file)
    require_not_replaced(out, [project_file], JOINT_FILE)
    session.prepare_jax()
    session.import_meanwhile("xarray", *(["jaxink.plots.overview"] if formats else []))
    chosen = jaxink.FitOptions(**options)
    with session.progress(quiet=output != "tables") as follow:
        result = jaxink.fit(project, options=chosen, progress=follow)
    files = write_joint_result(result, out, formats)
    if output == "json":
        typer.echo(json_text({**result.to_dict(), "files": [str(file) for file in files]}))
    elif output == "tables":
        show_joint_result(result, out, files)
    if not result.outcome.is_as_asked:
        return ExitCode.NOT_CONVERGED
    disagrees = result.agreement is not None and result.agreement.disagrees
    return ExitCode.UNEXPLAINED if result.verdict.is_misfit or disagrees else ExitCode.FITTED


def write_joint_result(result: "JointResult", out: Path, formats: Sequence[str]) -> list[Path]:
    """Write a result, all of its files or none; then its pages. What fails of these is said on stderr."""

    def write_page(failures: Failures) -> list[Path]:
        from jaxink.report import write_joint_page

        return write_joint_page(result, out, formats, failures)

    return write_with_page(result, out, (MEASUREMENTS, PAGE_FILE), write_page)


def show_joint_result(result: "JointResult", out: Path, files: Sequence[Path]) -> None:
    """Print a joint fit, the files that were written, and what to do next."""
    from jaxink.report import joint_next_steps

    to = console()
    style = "bold red" if result.verdict.code.needs_warning else "bold"
    to.print(result.verdict.sentence, style=style, soft_wrap=True)
    if result.agreement is not None:
        style = "bold red" if result.agreement.disagrees else "bold"
        to.print(result.agreement.sentence, style=style, soft_wrap=True)
    to.print("\n".join(["", *result.measurement_table().lines()]), soft_wrap=True)
    show_parameters(to, result)
    show_minima(to, result)
    show_lines(to, "Notes", result.notes)
    # Those of the measurements are many; their pages lead to them.
    show_files(to, [file for file in files if file.parent == out or file.name == PAGE_FILE])
    show_lines(to, "Next", [line for step in joint_next_steps(result, out) for line in step.lines()])
