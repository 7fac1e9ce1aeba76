"""Progress as a bar in a terminal."""

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from jaxink.cli.progress_lines import far


class ProgressBar:
    """Shows the task, how far it is, the misfit and the elapsed time; a `jaxink.numerics.progress.Progress`.

    Parameters
    ----------
    to
        Console; None for stderr.
    """

    def __init__(self, to: Console | None = None):
        to = to or Console(stderr=True, markup=False, highlight=False)
        columns = (
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=24),
            TextColumn("{task.fields[far]}", markup=False),
            TimeElapsedColumn(),
        )
        self._bars = Progress(*columns, console=to, transient=True, refresh_per_second=4)
        # Without a total, the bar only shows that something is going on.
        self._line = self._bars.add_task("compiling", total=None, far="")

    def __enter__(self) -> "ProgressBar":
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.stop()

    def __call__(self, what: str, step: int, misfit: float) -> None:
        """Show a step of a task."""
        self._bars.tasks[0].total = getattr(step, "total", None)
        self._bars.update(self._line, description=what, completed=int(step), far=far(step, misfit))
