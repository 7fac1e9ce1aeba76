"""``jaxink diagnose PROJECT.toml``."""

from pathlib import Path
from typing import Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.fit_tables import console, parameter_table, show_files
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import json_text
from jaxink.files.result_folder import JOINT_REPORT, require_not_replaced
from jaxink.files.writing import require_folder
from jaxink.numerics.failures import Failures

# Options of the diagnosis of one measurement, which the joint one does not heed.
_OF_ONE = {
    "--max-parameters": "max_parameters",
    "--level": "level",
    "--bootstrap": "n_bootstrap",
    "--seed": "seed",
    "--time-limit": "time_limit_s",
}


def require_searches_in_one_go(choices: dict[str, Any], is_resumed: bool) -> None:
    """Reject options of a diagnosis that only that of one measurement has."""
    usual = jaxink.DiagnosisOptions()
    stated = {option: choices[name] != getattr(usual, name) for option, name in _OF_ONE.items()}
    for option, is_given in (stated | {"--resume": is_resumed}).items():
        if is_given:
            raise InputRefusedError(f"{option} is for the diagnosis of one measurement; leave it out.")


def run_joint_diagnose(
    project_file: Path, out: Path, choices: dict[str, Any], accuracy: float, with_figures: bool, output: str
) -> ExitCode:
    """Diagnose a project and write the report to the folder ``out``; parameters as for `run_diagnose`."""
    require_folder(out)
    project = jaxink.load_project(project_file)
    require_not_replaced(out, [project_file], JOINT_REPORT)
    session.prepare_jax()
    fit = jaxink.FitOptions(profile="none", accuracy=accuracy)
    options = jaxink.DiagnosisOptions(**choices, fit=fit)
    with session.progress(quiet=output != "tables") as follow:
        found = jaxink.diagnose(project, options=options, progress=follow)
    report = found.save(out)
    failures, pages = Failures(), list[Path]()
    with failures.sparing("the page of the diagnosis", ""):
        from jaxink.report import write_joint_diagnosis_page

        pages = write_joint_diagnosis_page(found, out, ("png",) if with_figures else (), failures)
    session.show_failures(failures)
    if output == "json":
        typer.echo(json_text(found.to_dict()))
    elif output == "tables":
        to = console()
        style = "bold red" if found.structure_remains else "bold"
        to.print(found.sentence, style=style, soft_wrap=True)
        for step in found.steps:
            to.print(step.sentence, soft_wrap=True)
        to.print("\n".join(["", *found.misfit_table().lines()]), soft_wrap=True)
        rows = tuple(found.corrected.parameters.values())
        to.print(parameter_table(rows, found.corrected.verdict.standard_errors_hold))
        for failure in found.failures:
            to.print(failure.sentence, soft_wrap=True)
        # Those of the fits and of their measurements are many; the page leads to them.
        show_files(to, [report, *(page for page in pages if page.parent == out)])
    return ExitCode.UNEXPLAINED if found.structure_remains else ExitCode.FITTED
