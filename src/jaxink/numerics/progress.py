"""Progress of long computations."""

import logging
from collections.abc import Callable

# Called with the name of the task, the step, and the current misfit.
Progress = Callable[[str, int, float], None]
_LOG = logging.getLogger("jaxink")


def log_progress(what: str, step: int, misfit: float) -> None:
    """Default `Progress`: write to the log."""
    _LOG.debug("%s: step %d, misfit %.6g", what, step, misfit)
