"""Progress of long computations."""

import logging
from collections.abc import Callable


class StepOf(int):
    """Number of a step of which the total is known; formatted as ``3 of 12``.

    Attributes
    ----------
    total
        Number of steps of the task.
    """

    total: int

    def __new__(cls, number: int, total: int) -> "StepOf":
        """Step of so many, counted from 1."""
        step = super().__new__(cls, number)
        step.total = max(number, total)
        return step

    def __str__(self) -> str:
        """Number and total."""
        return f"{int(self)} of {self.total}"


# Called with the name of the task, the step (a `StepOf` if it is known of how many), and the current misfit
# (nan of a task that has none).
Progress = Callable[[str, int, float], None]
_LOG = logging.getLogger("jaxink")


def log_progress(what: str, step: int, misfit: float) -> None:
    """Default `Progress`: write to the log."""
    _LOG.debug("%s: step %s, misfit %.6g", what, step, misfit)
