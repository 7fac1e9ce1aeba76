"""Parts of a computation that may fail without taking the rest with them."""

import logging
import textwrap
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple, TypeVar

from jaxink.errors import ForkedProcessError, JaxinkError, PlatformError, PrecisionError, UnsafeVersionError

_LOG = logging.getLogger("jaxink")
# Wrong in the session, not in a part: everything would fail alike.
_OF_THE_SESSION = (PrecisionError, PlatformError, UnsafeVersionError, ForkedProcessError)
_LONGEST_REASON = 240
Item = TypeVar("Item")
Result = TypeVar("Result")


class Failure(NamedTuple):
    """A part that failed: what it was, the effect or parameter that it concerns, and why."""

    part: str
    name: str
    reason: str

    @property
    def sentence(self) -> str:
        """What failed and why."""
        return f"{self.part[0].upper()}{self.part[1:]} failed: {self.reason.rstrip('.')}."


class Failures:
    """Takes note of parts that fail; may be used by several threads."""

    def __init__(self):
        self._reasons: dict[tuple[str, str], str] = {}
        self._lock = threading.Lock()

    @property
    def found(self) -> tuple[Failure, ...]:
        """Those so far; sorted, because threads come to them in any order."""
        with self._lock:
            return tuple(sorted(Failure(*key, reason) for key, reason in self._reasons.items()))

    def names_with(self, part: str) -> set[str]:
        """Names of which a part, with a place for the name, has failed."""
        return {failure.name for failure in self.found if failure.part == part.format(failure.name)}

    def note(self, part: str, name: str, reason: str) -> None:
        """Take note of one; the first reason counts."""
        with self._lock:
            self._reasons.setdefault((part.format(name), name), reason)

    @contextmanager
    def sparing(self, part: str, name: str) -> Iterator[None]:
        """Go on after the block if anything fails in it.

        Parameters
        ----------
        part
            What the block does, with a place for the name, such as ``the refit with {}``.
        name
            The effect or parameter that it concerns.
        """
        try:
            yield
        except _OF_THE_SESSION:
            raise
        except Exception as problem:  # noqa: BLE001 - an effect of a user's own may raise anything
            self._spare(part, name, problem)

    def in_parts(
        self,
        work: Callable[[Sequence[Item]], list[Result]],
        items: Sequence[Item],
        part: str,
        name_of: Callable[[Item], str] = str,
    ) -> list[Result]:
        """Work on items together; where that fails, on halves, to leave out only those that fail alone.

        Parameters
        ----------
        work
            On any number of items; if it raises even for none, so does this.
        items
            The items.
        part, name_of
            See `sparing`, for one item.
        """
        try:
            return work(items)
        except _OF_THE_SESSION:
            raise
        except Exception as problem:  # noqa: BLE001 - as in `sparing`
            if not items:
                raise
            if len(items) == 1:
                nothing = work(())
                self._spare(part, name_of(items[0]), problem)
                return nothing
        middle = len(items) // 2
        halves = items[:middle], items[middle:]
        return [result for half in halves for result in self.in_parts(work, half, part, name_of)]

    def _spare(self, part: str, name: str, problem: Exception) -> None:
        _LOG.debug("%s failed", part.format(name), exc_info=problem)
        self.note(part, name, _reason_of(problem))


def _reason_of(problem: Exception) -> str:
    """An error in one line; the type of one of jaxink's own tells a user nothing."""
    words = str(problem)
    if "Traceback (most recent call last)" in words:
        # What a compiled program calls has raised: the error is the first line after its traceback.
        _, *lines = words.split("Traceback", 1)[1].splitlines()
        words = next((line for line in lines if line.strip() and not line.startswith(" ")), words)
    elif not isinstance(problem, JaxinkError):
        words = f"{type(problem).__name__}: {words}" if words else type(problem).__name__
    return textwrap.shorten(words, _LONGEST_REASON, placeholder=" ...")
