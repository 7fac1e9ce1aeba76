"""What stands in for a fit: an answer by the content of the measurement, at once."""

import dataclasses
import os
import signal
import sys
import time

from jaxink.batches.folder import Done, trouble
from jaxink.batches.row import RowOutcome, RowParameter
from jaxink.batches.task import MeasurementTask


def answered(task: MeasurementTask) -> Done:
    """A result whose one parameter is the number in the file."""
    value = float(task.contents[0])
    row = trouble(task, RowOutcome.DONE, "it is fitted.").row
    parameter = RowParameter("ink.scattering_per_mm", "1/mm", value, 0.5)
    page = f"results/{task.name}/fit.html"
    row = dataclasses.replace(row, verdict="consistent", parameters=(parameter,), page=page)
    return Done(row, {"fit.html": b"<p>page</p>", "figures/cut.png": b"png"})


def with_faults(task: MeasurementTask) -> Done:
    """As `answered`, apart from files that say what goes wrong."""
    match task.contents[0]:
        case b"hang":
            time.sleep(1000)
        case b"die":
            os.kill(os.getpid(), signal.SIGKILL)
        case b"die once":
            marker = f"{task.paths[0]}.died"
            if not os.path.exists(marker):
                open(marker, "w").close()
                os.kill(os.getpid(), signal.SIGKILL)
            return answered(dataclasses.replace(task, contents=(b"7",)))
        case b"eat":
            held = bytearray(800_000_000)
            held[::4096] = b"1" * len(held[::4096])
            time.sleep(1000)
        case b"broken":
            return trouble(task, RowOutcome.REFUSED, f"{task.paths[0]}: is broken.")
        case b"print":
            sys.stdout.write("this must not reach the answers")
            sys.stdout.flush()
            return answered(dataclasses.replace(task, contents=(b"8",)))
    return answered(task)


def interrupted_at_three(task: MeasurementTask) -> Done:
    """As `answered`, and Ctrl-C at the sheet with the number 3."""
    if task.contents[0] == b"3":
        raise KeyboardInterrupt
    return answered(task)


def never(task: MeasurementTask) -> Done:
    raise AssertionError(f"{task.name} was done already")


def slowly(task: MeasurementTask) -> Done:
    """As `answered`, after half a second."""
    time.sleep(0.5)
    return answered(task)
