"""How a long computation tells how far it is."""

import logging
from collections.abc import Callable

# Called with what is done, the step, and the misfit there.
Progress = Callable[[str, int, float], None]
_LOG = logging.getLogger("jaxink")


def log_progress(what: str, step: int, misfit: float) -> None:
    """Tell the log, where nobody else is to be told.

    Parameters
    ----------
    what
        What is done.
    step
        Its step.
    misfit
        What it minimises.
    """
    _LOG.debug("%s: step %d, misfit %.6g", what, step, misfit)
