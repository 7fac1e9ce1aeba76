"""``jaxink demo``: fits the embedded simulated measurement twice and compares the fits."""

import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

import jaxink
from jaxink.cli import session
from jaxink.cli.fit import OWNED, write_result
from jaxink.cli.fit_tables import console, merit_lines, parameter_notes, show_files
from jaxink.cli.session import ExitCode
from jaxink.data import SIMULATED_TRUTH, simulated_example
from jaxink.files.writing import require_folder
from jaxink.numerics.digits import with_uncertainty

if TYPE_CHECKING:
    from jaxink import FitResult


def run_demo(out: Path, formats: Sequence[str], quiet: bool) -> ExitCode:
    """Fit the embedded simulated measurement with both methods; write inputs and results to ``out``."""
    require_folder(out, OWNED)
    inputs = simulated_example()
    data, sample = jaxink.read(inputs[0]), jaxink.load_sample(inputs[1])
    session.prepare_jax()
    with session.progress(quiet) as follow:
        gradient, simplex = (
            jaxink.fit(data, sample, jaxink.FitOptions(method=method), follow)
            for method in ("gradient", "simplex")
        )
    files = write_result(gradient, out, formats, inputs, simplex)
    if not quiet:
        _show_fits(gradient, simplex, files)
    return ExitCode.FITTED if gradient.converged and simplex.converged else ExitCode.NOT_CONVERGED


def _show_fits(gradient: "FitResult", simplex: "FitResult", files: Iterable[Path]) -> None:
    """Print both fits beside the values with which the measurement was simulated."""
    to = console()
    to.print(f"SIMULATED measurement ({gradient.data.source}), {gradient.merit.points} points:", style="bold")
    to.print("a known ink, computed by an independent Monte Carlo program, with added noise.")
    to.print("Both fits start from the same values and minimise the same chi-square.")
    to.print(_comparison_table(gradient, simplex))
    for line in (*parameter_notes(gradient), *(f"gradient: {line}" for line in merit_lines(gradient)[:3])):
        to.print(line, soft_wrap=True)
    to.print()
    files = list(files)
    show_files(to, files)
    _show_next(to, files)


def _comparison_table(gradient: "FitResult", simplex: "FitResult") -> Table:
    """Values and effort of both fits, one column each."""
    from rich.box import SIMPLE_HEAD

    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    for head in ("", "true value", "start", "gradient", "simplex"):
        table.add_column(head, justify="right" if head else "left", no_wrap=True)
    for name, truth in SIMULATED_TRUTH.items():
        fitted = (with_uncertainty(r[name].value, r[name].standard_error) for r in (gradient, simplex))
        table.add_row(name, f"{truth:g}", f"{gradient[name].start:.4g}", *fitted)
    table.add_section()
    efforts = [r.searches[0] for r in (gradient, simplex)]
    for label, text in (
        ("chi-square", lambda s: f"{s.loss:.2f}"),
        ("Jacobians", lambda s: str(s.jacobians)),
        ("evaluations", lambda s: str(s.evaluations)),
        ("compilation, s", lambda s: f"{s.compile_seconds:.2f}"),
        ("run time, s", lambda s: f"{s.run_seconds:.2f}"),
        ("outcome", lambda s: s.outcome),
    ):
        table.add_row(label, "", "", *(text(s) for s in efforts))
    return table


def _show_next(to: Console, files: list[Path]) -> None:
    """Print the command that repeats the gradient fit."""
    data, sample = (str(next(f for f in files if f.suffix == suffix)) for suffix in (".csv", ".toml"))
    to.print("To repeat the gradient fit:")
    line = shlex.join([session.program(), "fit", data, "--sample", sample, "--out", "my-fit"])
    to.print(f"  {line}", soft_wrap=True)
