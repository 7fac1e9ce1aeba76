"""Guard against using JAX in a process that was forked from one that had used it."""

import os

from jaxink.errors import ForkedProcessError

# The process in which jaxink first computed; forked processes inherit the value.
_home: int | None = None


def refuse_in_fork() -> None:
    """Raise `ForkedProcessError` in a fork of a process that has computed: JAX hangs without its threads."""
    if _home not in (None, os.getpid()):
        raise ForkedProcessError(
            f"this process was forked from process {_home}, which had computed with JAX, so JAX would hang; "
            'start processes by "spawn" or "forkserver", such as multiprocessing.get_context("spawn") or '
            'concurrent.futures.ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")).'
        )


def claim_process() -> None:
    """Register this process as computing; raises as `refuse_in_fork`."""
    global _home
    refuse_in_fork()
    _home = os.getpid()
