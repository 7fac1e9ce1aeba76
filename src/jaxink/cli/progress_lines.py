"""Progress as plain lines, for a log file or a continuous-integration job."""

import math
import re
import threading
import time
from collections.abc import Callable

# A line at each new task, otherwise at most one in so many seconds.
_BETWEEN_S = 5.0
# The first sign of life comes soon, but not before an invalid input is rejected.
_FIRST_S = 10.0
# Without any step for so long, a line says that the task still runs.
_SILENCE_S = 30.0
# What stands between a kind of task and the effect or parameter of one of them.
_BEFORE_NAME = re.compile(" with | of |, ")


def far(step: int, misfit: float) -> str:
    """How far a task is; a task without a misfit has nan."""
    return f"step {step}" if math.isnan(misfit) else f"step {step}, misfit {misfit:.6g}"


class ProgressLines:
    """Writes a line for a new task, and then now and then; a `jaxink.numerics.progress.Progress`.

    Parameters
    ----------
    write
        Called with each line.
    clock
        Monotonic time in seconds.
    silence_s
        A line is written at the latest after this time, even without a step.
    """

    def __init__(
        self,
        write: Callable[[str], object],
        clock: Callable[[], float] = time.monotonic,
        silence_s: float = _SILENCE_S,
    ):
        self._echo, self._clock, self._silence_s = write, clock, silence_s
        self._start = clock()
        self._written = self._start - silence_s + min(_FIRST_S, silence_s)
        self._task, self._kind = "compiling", ""
        self._lock, self._over = threading.Lock(), threading.Event()
        self._watch = threading.Thread(target=self._say_it_runs, daemon=True)

    def __enter__(self) -> "ProgressLines":
        self._watch.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._watch.join()

    def __call__(self, what: str, step: int, misfit: float) -> None:
        """Note a step of a task."""
        # Refits with one effect after the other, or one profile after the other, are one task.
        kind = _BEFORE_NAME.split(what)[0]
        with self._lock:
            is_new, self._kind, self._task = kind != self._kind, kind, what
            if is_new or self._clock() - self._written >= _BETWEEN_S:
                self._write(f"{what}: {far(step, misfit)}")

    def _write(self, text: str) -> None:
        self._written = self._clock()
        self._echo(f"jaxink: {self._written - self._start:5.0f} s  {text}")

    def _say_it_runs(self) -> None:
        while not self._over.wait(self._silence_s / 10):
            with self._lock:
                if self._clock() - self._written >= self._silence_s:
                    self._write(f"{self._task}: still running")
