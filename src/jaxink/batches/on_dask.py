"""Measurements on the workers of Dask: a local cluster, or any scheduler that runs."""

import dataclasses
import logging
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.metadata import version
from itertools import islice
from typing import TYPE_CHECKING, Any

from jaxink.batches.child import Child, EndedError, ProcessLimits
from jaxink.batches.folder import Done, trouble
from jaxink.batches.row import RowOutcome
from jaxink.batches.task import MeasurementTask
from jaxink.errors import InputRefusedError, JaxinkError

if TYPE_CHECKING:
    from distributed import Client

# Measurements on their way at the same time, for each thread of a worker, and at least.
_FOR_EACH_THREAD, _LEAST = 3, 32
# The first measurement compiles for all others, which wait for it, but not for ever.
_FIRST_ALONE_S = 60.0
_CONNECT_S = 20.0
_RECOUNT_S = 5.0
# Of the thread of a worker: its process.
_MINE = threading.local()
_ALL: list[Child] = []


class LostSchedulerError(JaxinkError):
    """The scheduler is gone; what it had not answered is unknown, and nobody's fault."""

    def __init__(self):
        super().__init__("the connection to the Dask scheduler was lost.")


@contextmanager
def local_client(n_workers: int) -> Iterator["Client"]:
    """A cluster in this process; each of its workers has a process of its own for the measurements."""
    distributed = _distributed()
    cluster = distributed.LocalCluster(
        n_workers=n_workers,
        threads_per_worker=1,
        processes=False,
        # Any free port: that of Dask may be in use by another batch.
        dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL,
        memory_limit=0,
    )
    with cluster, distributed.Client(cluster) as client:
        yield client


@contextmanager
def remote_client(address: str) -> Iterator["Client"]:
    """A connection to a scheduler that runs.

    Raises
    ------
    InputRefusedError
        If there is none at the address, or a worker has another version of jaxink, or none.
    """
    distributed = _distributed()
    from distributed.utils import silence_logging_cmgr

    try:
        client = distributed.Client(address, timeout=_CONNECT_S)
    except (OSError, ValueError, TypeError) as problem:
        raise InputRefusedError(
            f"there is no Dask scheduler at {address} ({' '.join(str(problem).split())[:100]}); give the "
            "address that `dask scheduler` prints, such as tcp://192.168.0.10:8786."
        ) from None
    # Of a lost scheduler, this process says one sentence; Dask would add its tracebacks.
    with silence_logging_cmgr(logging.CRITICAL, root="distributed.client"), client:
        _require_same_version(client)
        yield client


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputRefusedError(
            "several workers need the package dask.distributed, which is not installed; run `pip install "
            "'jaxink[cluster]'`, or take --workers 0 (one measurement after the other)."
        ) from None
    return distributed


def _require_same_version(client: "Client") -> None:
    try:
        found = client.run(version, "jaxink")
    except Exception as problem:
        raise InputRefusedError(
            f"a worker of the scheduler has no jaxink ({' '.join(str(problem).split())[:100]}); install "
            f"jaxink {version('jaxink')} where the workers run."
        ) from None
    for worker, other in found.items():
        if other != version("jaxink"):
            raise InputRefusedError(
                f"the worker {worker} has jaxink {other}, and this is jaxink {version('jaxink')}; install "
                "the same version everywhere."
            )


def measured_by(
    client: "Client",
    tasks: Iterable[MeasurementTask],
    limits: ProcessLimits,
    function: str,
    devices: Sequence[str] = (),
) -> Iterator[Done]:
    """Answers to tasks, in the order in which they end.

    Parameters
    ----------
    client
        Of `local_client` or `remote_client`.
    tasks
        They are taken only when workers will soon be free, so that few are in memory.
    limits
        Of each measurement.
    function
        What a worker's process calls with a task, as ``module:function``.
    devices
        Graphics processors, which the workers of a local cluster share out; empty: as the workers' own
        environment says.

    Raises
    ------
    LostSchedulerError
        If the scheduler ends, or the connection to it.
    """
    from distributed import as_completed, wait

    tasks, sent = iter(tasks), dict[str, MeasurementTask]()
    how = limits, function, tuple(devices)

    def submitted(count: int) -> list[Any]:
        futures = []
        for task in islice(tasks, max(count, 0)):
            key = f"jaxink-{task.name}-{time.time_ns()}"
            sent[key] = task
            futures.append(client.submit(_ask, task, *how, key=key, pure=False))
        return futures

    try:
        others = _started(client, how)
        first = submitted(1)
        with suppress(TimeoutError):
            wait(first, timeout=_FIRST_ALONE_S)
        del others
        room, counted = _room(client), time.monotonic()
        # With the first one, because nothing is awaited while nothing is on its way.
        waiting = as_completed(first + submitted(room if first else 0))
        for future in waiting:
            yield _answer(future, sent.pop(future.key))
            if time.monotonic() - counted > _RECOUNT_S:
                room, counted = _room(client), time.monotonic()
            waiting.update(submitted(room - len(sent)))
    except Exception as problem:
        # The client without its scheduler raises all sorts of exceptions.
        is_lost = client.status != "running" or isinstance(problem, OSError | TimeoutError)
        if isinstance(problem, JaxinkError) or not is_lost:
            raise
        raise LostSchedulerError from problem
    finally:
        _clear(client)


def _started(client: "Client", how: tuple[Any, ...]) -> list[Any]:
    """Let the workers that are there start their processes while the first measurement is compiled."""
    return [
        client.submit(_start, *how, key=f"jaxink-start-{i}-{time.time_ns()}", workers=[worker], pure=False)
        for i, worker in enumerate(client.nthreads())
    ]


def _room(client: "Client") -> int:
    return max(_FOR_EACH_THREAD * sum(client.nthreads().values()), _LEAST)


def _answer(future: Any, task: MeasurementTask) -> Done:
    from distributed import KilledWorker

    # Cancelled or lost, by nobody here.
    if future.status not in ("finished", "error"):
        raise LostSchedulerError
    try:
        return future.result()
    except KilledWorker:
        sentence = "its worker was lost again and again, so the scheduler gave it up."
        return trouble(task, RowOutcome.KILLED, sentence)
    except Exception as problem:
        if future.status != "error":
            raise LostSchedulerError from problem
        what = " ".join(str(problem).split())[:200]
        return trouble(task, RowOutcome.FAILED, f"the cluster failed ({type(problem).__name__}: {what}).")


def _clear(client: "Client") -> None:
    """End the workers' processes, which would keep their memory."""
    # Without a scheduler, these would wait for one.
    if client.status == "running":
        with suppress(Exception):
            client.cancel(list(client.futures.values()), force=True)
        with suppress(Exception):
            client.run(_end_all)
    _end_all()


def _ask(task: MeasurementTask, limits: ProcessLimits, function: str, devices: Sequence[str]) -> Done:
    """In a thread of a worker: the answer of its process."""
    start = time.perf_counter()
    try:
        done, attempts = _mine(limits, function, devices).ask(task)
    except EndedError as problem:
        return trouble(task, problem.outcome, str(problem), time.perf_counter() - start, problem.attempts)
    return Done(dataclasses.replace(done.row, attempts=attempts), done.files)


def _start(limits: ProcessLimits, function: str, devices: Sequence[str]) -> None:
    with suppress(EndedError):
        _mine(limits, function, devices).start()


def _mine(limits: ProcessLimits, function: str, devices: Sequence[str]) -> Child:
    """The process of this thread."""
    child = getattr(_MINE, "child", None)
    if child is None or child.is_over or (child.limits, child.function) != (limits, function):
        if child is not None:
            child.end()
        child = _MINE.child = Child(limits, function, _device(devices))
        _ALL.append(child)
    return child


def _device(devices: Sequence[str]) -> str | None:
    from distributed import get_worker

    if not devices:
        return None
    name = str(get_worker().name)
    return devices[(int(name) if name.isdigit() else hash(name)) % len(devices)]


def _end_all() -> None:
    while _ALL:
        _ALL.pop().close()
