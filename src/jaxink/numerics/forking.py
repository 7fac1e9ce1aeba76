"""Guard against the use of JAX in a process that was forked off one that had used it."""

import os

from jaxink.errors import ForkedProcessError

# The process in which jaxink first computed, as a forked one inherits it.
_home: int | None = None


def refuse_in_fork() -> None:
    """Refuse to compute in a fork of a process that has computed: JAX hangs without its threads.

    Raises
    ------
    ForkedProcessError
        With the ways of starting a process that work.
    """
    if _home not in (None, os.getpid()):
        raise ForkedProcessError(
            f"this process was forked off process {_home}, which had computed with JAX; JAX would hang here. "
            'Start processes by "spawn" or "forkserver": multiprocessing.get_context("spawn"), or '
            'concurrent.futures.ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")).'
        )


def claim_process() -> None:
    """Take note that this process computes from now on; refused as by `refuse_in_fork`."""
    global _home
    refuse_in_fork()
    _home = os.getpid()
