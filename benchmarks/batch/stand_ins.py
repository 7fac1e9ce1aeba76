"""Work of a known duration, to see what the engine itself takes."""

import time

from jaxink.batches.folder import Done, trouble
from jaxink.batches.row import RowOutcome
from jaxink.batches.task import MeasurementTask

# About as much as comes back from a short fit.
_BYTES = b"0" * 60_000


def nothing(task: MeasurementTask) -> Done:
    """An answer at once."""
    row = trouble(task, RowOutcome.FAILED, "a stand-in.").row
    return Done(row, {"result.nc": _BYTES})


def tenth(task: MeasurementTask) -> Done:
    """An answer after a tenth of a second without any work, as on processors of their own."""
    time.sleep(0.1)
    return nothing(task)
