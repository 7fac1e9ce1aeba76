"""The work on a sheet, with faults of the process itself at sheets of certain names.

No text file hangs a fit or kills its process; what a damaged driver or a far too large file would do is done
here on purpose.
"""

import dataclasses
import os
import signal
import time

from benchmarks.batch.sheets import DIES, EATS, FEW_STEPS, HANGS, RAISES
from jaxink.batches.folder import Done
from jaxink.batches.measure import measure
from jaxink.batches.task import MeasurementTask


def measure_with_faults(task: MeasurementTask) -> Done:
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
        # An option that no plan can state: an error that is not the user's.
        task = dataclasses.replace(task, fit={"no_such_option": 1})
    if task.name.endswith(FEW_STEPS):
        task = dataclasses.replace(task, fit={**task.fit, "max_steps": 1})
    return measure(task)
