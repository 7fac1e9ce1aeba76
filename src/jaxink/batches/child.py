"""A process for the measurements of one worker, within limits of time and memory.

Whatever happens in it, the worker stays: a measurement that ends its process is tried once more in a new
one, and then is a row that says so. The process is started by a command, never forked, because JAX hangs in
a fork; and without the caller's main module, which therefore need not be guarded.
"""

import dataclasses
import os
import pickle
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from jaxink.batches.row import RowOutcome
from jaxink.errors import JaxinkError

MEASURE = "jaxink.batches.measure:measure"
MOST_TRIES = 2
# One BLAS thread for each worker; the matrices are small.
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_DEVICES = "CUDA_VISIBLE_DEVICES"
_POLL_S, _START_S = 0.05, 300.0
_GIB = 2**30


@dataclasses.dataclass(frozen=True)
class ProcessLimits:
    """Limits of one measurement: seconds, and memory of its process in GiB, None for no limit."""

    seconds: float
    memory_gib: float | None = None


class EndedError(JaxinkError):
    """The process was ended, or has ended, without an answer."""

    def __init__(self, outcome: RowOutcome, sentence: str, attempts: int = 1):
        super().__init__(sentence)
        self.outcome, self.attempts = outcome, attempts


class Child:
    """The process; it is started when it is first needed, and anew after it has ended.

    Parameters
    ----------
    limits
        Of each task.
    function
        What it calls with a task, as ``module:function``.
    device
        Its graphics processor, as in ``CUDA_VISIBLE_DEVICES``; None: as this process.
    """

    def __init__(self, limits: ProcessLimits, function: str = MEASURE, device: str | None = None):
        self.limits, self.function, self._device = limits, function, device
        self.is_over, self._is_new = False, True
        self._process: subprocess.Popen[bytes] | None = None
        self._answers: queue.Queue[Any] = queue.Queue()

    def ask(self, task: Any) -> tuple[Any, int]:
        """Answer to a task, and the number of processes that have tried it.

        Raises
        ------
        EndedError
            If the task was ended at a limit of time (in a new process, twice) or memory, or has ended its
            process twice.
        """
        for attempt in range(1, MOST_TRIES + 1):
            was_new = self._is_new
            try:
                return self._asked(task), attempt
            except EndedError as problem:
                self.end()
                # A new process may have spent its time on compilation, which is stored now.
                again = problem.outcome is RowOutcome.KILLED
                again |= problem.outcome is RowOutcome.TIME_LIMIT and was_new
                if not again or attempt == MOST_TRIES:
                    raise EndedError(problem.outcome, str(problem), attempt) from None
        raise AssertionError

    def start(self) -> None:
        """Start the process, unless it runs, and wait until it has imported what it needs."""
        if self._process is not None and self._process.poll() is None:
            return
        self._answers = queue.Queue()
        # Without a console of its own, Ctrl-C would end it before its worker knows.
        apart: dict[str, Any] = {"start_new_session": True} if os.name == "posix" else {}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "jaxink.batches.child_main", self.function],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=None if os.environ.get("JAXINK_DEBUG") else subprocess.DEVNULL,
            env=_environment(self._device),
            **apart,
        )
        threading.Thread(target=_listen, args=(self._process, self._answers), daemon=True).start()
        self._answer(_START_S)

    def close(self) -> None:
        """Kill the process for good."""
        self.is_over = True
        self.end()

    def end(self) -> None:
        """Kill the process, if it runs."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for stream in (self._process.stdin, self._process.stdout):
                if stream is not None:
                    _close(stream)
        self._process, self._is_new = None, True

    def _asked(self, task: Any) -> Any:
        self.start()
        assert self._process is not None
        assert self._process.stdin is not None
        try:
            pickle.dump(task, self._process.stdin, protocol=pickle.HIGHEST_PROTOCOL)
            self._process.stdin.flush()
        except OSError:
            raise self._ended() from None
        answer = self._answer(self.limits.seconds)
        self._is_new = False
        return answer

    def _answer(self, seconds: float) -> Any:
        until = time.monotonic() + seconds
        while True:
            try:
                answer = self._answers.get(timeout=_POLL_S)
            except queue.Empty:
                self._require_limits(until, seconds)
                continue
            if answer is _OVER:
                raise self._ended()
            return answer

    def _require_limits(self, until: float, seconds: float) -> None:
        if time.monotonic() > until:
            sentence = (
                f"was ended after its time limit of {seconds:g} s; raise limits.seconds, or simplify it."
            )
            raise EndedError(RowOutcome.TIME_LIMIT, sentence)
        most = self.limits.memory_gib
        assert self._process is not None
        if most is not None and (used := _resident_gib(self._process.pid)) > most:
            raise EndedError(
                RowOutcome.MEMORY_LIMIT,
                f"was ended because it took {used:.2g} GiB of memory; the limit is {most:.2g} GiB, so raise "
                "limits.memory_gib, take fewer workers, or simplify it.",
            )

    def _ended(self) -> EndedError:
        assert self._process is not None
        code = self._process.wait()
        how = f"by signal {-code}" if code < 0 else f"with code {code}"
        return EndedError(
            RowOutcome.KILLED,
            f"its process ended {how} without an answer, {MOST_TRIES} times; perhaps the machine ran out of "
            "memory.",
        )


_OVER = object()


def _listen(process: "subprocess.Popen[bytes]", answers: "queue.Queue[Any]") -> None:
    assert process.stdout is not None
    try:
        while True:
            answers.put(pickle.load(process.stdout))
    except Exception:
        # A process that ends in the middle of an answer leaves any part of it.
        answers.put(_OVER)


def _close(stream: Any) -> None:
    with suppress(OSError):
        stream.close()


def _environment(device: str | None) -> Mapping[str, str]:
    paths = os.pathsep.join(path for path in sys.path if path)
    environment = {**os.environ, **dict.fromkeys(_ONE_THREAD, "1"), "PYTHONPATH": paths}
    environment.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    return environment if device is None else environment | {_DEVICES: device}


def _resident_gib(pid: int) -> float:
    """Memory of a process; 0 if it is unknown."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / _GIB
    except (OSError, ValueError, IndexError):
        return 0.0 if os.path.isdir("/proc/self") else _resident_elsewhere_gib(pid)


def _resident_elsewhere_gib(pid: int) -> float:
    # Comes with dask.distributed.
    import psutil

    try:
        return psutil.Process(pid).memory_info().rss / _GIB
    except psutil.Error:
        return 0.0
