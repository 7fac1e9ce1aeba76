"""The work on a sheet, with faults of the process itself at sheets of certain names.

No text file hangs a fit or kills its process; what a damaged driver or a far too large file would do is done
here on purpose.
"""

import os
import signal
import time

from benchmarks.batch.sheets import DIES, EATS, HANGS, RAISES
from jaxink.batches.answer import Done
from jaxink.batches.measure import measure
from jaxink.batches.task import Task


def measure_with_faults(task: Task) -> Done:
    """As `measure`, apart from sheets named after a fault."""
    if task.name.endswith(HANGS):
        while True:
            time.sleep(1)
    if task.name.endswith(EATS):
        held = []
        while True:
            held.append(b"1" * 50_000_000)
            time.sleep(0.01)
    if task.name.endswith(DIES):
        os.kill(os.getpid(), signal.SIGKILL)
    if task.name.endswith(RAISES):
        task = _broken(task)
    return measure(task)


def _broken(task: Task) -> Task:
    """A task whose options no version would send: an error that is not one of the user's."""
    import dataclasses

    return dataclasses.replace(task, fit={"accuracy": ACCURACY_OF_NOTHING})


class _Nothing:
    def __repr__(self) -> str:
        raise RuntimeError("a fault of the benchmark")


ACCURACY_OF_NOTHING = _Nothing()
