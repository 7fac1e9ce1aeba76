"""``jaxink batch``."""

import time
from pathlib import Path
from typing import Any

import typer

import jaxink
from jaxink.batches import REPORT_PAGE, SUMMARY_CSV, Row, UnfinishedBatchError
from jaxink.cli import session
from jaxink.cli.session import ExitCode
from jaxink.files.encoding import json_text, plain

# A line at most so often, apart from those on trouble.
_BETWEEN_S = 5.0


def run_batch(plan_file: Path, out: Path, where: dict[str, Any], retry: bool, output: str) -> ExitCode:
    """Do what a plan says and write to the folder ``out``.

    ``where``: the keywords ``workers``, ``scheduler`` and ``devices`` of `jaxink.batch`; ``output`` is
    ``tables``, ``json`` or ``quiet``.
    """
    plan = jaxink.load_plan(plan_file)
    session.prepare_jax()
    lines = _Lines(len(plan.measurements), is_quiet=output != "tables")
    cut_off = None
    try:
        found = jaxink.batch(plan, out, **where, retry=retry, follow=lines)
    except KeyboardInterrupt:
        typer.echo(
            f"jaxink: the results of {lines.n_done} of {lines.n_all} measurements are kept; go on with the "
            "same command.",
            err=True,
        )
        raise
    except UnfinishedBatchError as problem:
        found, cut_off = problem.found, problem
    lines.end(len(found))
    if output == "json":
        typer.echo(
            json_text(
                {"columns": plain(found.columns()), "again": list(found.again), "absent": dict(found.absent)}
            )
        )
    elif output == "tables":
        for sentence in found.again:
            typer.echo(f"jaxink: {sentence}", err=True)
        for name, sentence in found.absent.items():
            typer.echo(f"jaxink: {name}: {sentence}", err=True)
        typer.echo(found.summary())
        typer.echo(
            f"\nWritten: {out / SUMMARY_CSV}, {out / REPORT_PAGE}, and a folder of each in {out}/results."
        )
    if cut_off is not None:
        typer.echo(f"jaxink: {cut_off}", err=True)
        return ExitCode.UNFINISHED
    if found.trouble or found.absent:
        return ExitCode.NOT_CONVERGED
    return ExitCode.UNEXPLAINED if found.misfits else ExitCode.FITTED


class _Lines:
    """Writes a line for each measurement without a result, and now and then how far the batch is."""

    def __init__(self, n_all: int, is_quiet: bool):
        self.n_done, self.n_all, self._is_quiet = 0, n_all, is_quiet
        self._start = self._written = time.monotonic()
        # The last number that was told.
        self._told: int | None = None

    def __call__(self, row: Row, n_done: int, n_all: int) -> None:
        """Note a row."""
        self.n_done, self.n_all = n_done, n_all
        now = time.monotonic()
        trouble = "" if row.ended.has_result else f"; {row.name}: {row.sentence}"
        if self._is_quiet or not (trouble or now - self._written >= _BETWEEN_S):
            return
        self._tell(n_done, trouble)

    def end(self, n_done: int) -> None:
        """Tell the last number, with the rows that were there before, if other numbers were told."""
        if self._told not in (None, n_done):
            self._tell(n_done)

    def _tell(self, n_done: int, trouble: str = "") -> None:
        self._written, self._told = time.monotonic(), n_done
        seconds = self._written - self._start
        typer.echo(f"jaxink: {seconds:5.0f} s  {n_done} of {self.n_all}{trouble}", err=True)
