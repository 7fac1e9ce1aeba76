"""The time that a diagnosis may take, and what it leaves out for lack of it."""

import dataclasses
import enum
import threading
import time
from collections.abc import Callable, Iterable
from typing import NamedTuple

from jaxink.display.brief import brief_repr


class OptionalTask(enum.StrEnum):
    """Part of a diagnosis that a time limit may leave out; the value appears in ``report.json``.

    ``words`` say what it is, with a place for the names that it concerns; ``is_decisive``: the verdict rests
    on it.
    """

    words: str
    is_decisive: bool

    INPUT_CHECK = "input_check", "the test for mistakes in the input", True
    SCREEN = "screen", "the screen for {}", True
    REFIT = "refit", "refits with {}", True
    CONVERGENCE = "convergence", "the end of the refits with {}", True
    PAIR = "second_effect", "the combination of {} with a second effect", True
    ACCEPTANCE = "acceptance", "the test of {} on held-out points", True
    REPETITION = "repetition", "the search for a further effect", True
    COMPARISON = "comparison", "the comparison of {} with others in the presence of all effects found", True
    SINGLE = "single_cause", "the fit with {} alone, in place of several effects,", True
    HELD_OUT = "held_out", "predictions of held-out points by the {} model", False
    LIMIT = "detection_limit", "the verification of the detection limits of {}", False
    FURTHER = "further_measurements", "the search for measurements that would distinguish {}", False

    def __new__(cls, name: str, words: str, is_decisive: bool):
        """A task with its words."""
        member = str.__new__(cls, name)
        member._value_ = name
        member.words, member.is_decisive = words, is_decisive
        return member


class Omission(NamedTuple):
    """A task that was not done, and the effects or models that it concerns."""

    task: OptionalTask
    names: tuple[str, ...]

    def described(self, most_names: int | None = None) -> str:
        """What was not done; of more names than ``most_names``, only their number."""
        many = most_names is not None and len(self.names) > most_names
        return self.task.words.format(f"{len(self.names)} effects" if many else ", ".join(self.names))


@dataclasses.dataclass(frozen=True)
class TimeLimit:
    """A time limit and what it left out.

    Parameters
    ----------
    limit_s
        In seconds.
    elapsed_s
        Seconds that the diagnosis took.
    not_done
        Tasks that were left out.
    """

    limit_s: float
    elapsed_s: float
    not_done: tuple[Omission, ...]

    __repr__ = brief_repr

    @property
    def is_decisive(self) -> bool:
        """Whether something was left out that the verdict rests on."""
        return any(omission.task.is_decisive for omission in self.not_done)


class Deadline:
    """The time that a diagnosis may take, counted from now; it may be used by several threads.

    It is looked at between tasks only: a fit or a compilation that has begun is ended.

    Parameters
    ----------
    limit_s
        In seconds; None for no limit.
    clock
        Monotonic time in seconds.
    """

    def __init__(self, limit_s: float | None = None, clock: Callable[[], float] = time.monotonic):
        self.limit_s = limit_s
        self._clock, self._began = clock, clock()
        self._left_out: dict[OptionalTask, dict[str, None]] = {}
        self._lock = threading.Lock()

    @property
    def elapsed_s(self) -> float:
        """Seconds so far."""
        return self._clock() - self._began

    @property
    def is_over(self) -> bool:
        """Whether the time is up."""
        return self.limit_s is not None and self.elapsed_s >= self.limit_s

    def permits(self, task: OptionalTask, names: Iterable[str] = ()) -> bool:
        """Whether there is time for a task; if not, it is noted as left out."""
        if not self.is_over:
            return True
        with self._lock:
            self._left_out.setdefault(task, {}).update(dict.fromkeys(names))
        return False

    def outcome(self) -> TimeLimit | None:
        """The limit, and what was left out so far; None without a limit."""
        return None if self.limit_s is None else TimeLimit(self.limit_s, self.elapsed_s, self._omissions())

    def _omissions(self) -> tuple[Omission, ...]:
        found = (
            Omission(task, tuple(self._left_out[task])) for task in OptionalTask if task in self._left_out
        )
        # An empty catalogue leaves nothing out.
        return tuple(omission for omission in found if omission.names or "{}" not in omission.task.words)
