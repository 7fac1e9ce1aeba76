"""The content of a file, and its words one after the other with the row of each."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from jaxink.errors import InputRefusedError
from jaxink.measurement.checks import LARGEST_PER_SR, impossible_per_sr
from jaxink.measurement.table import refusal
from jaxink.measurement.text_file import lines_of

_LONGEST_SHOWN = 40
# Far beyond any quantity; products and quotients of such numbers do not overflow.
_LARGEST = 1e100


@dataclass(frozen=True)
class Content:
    """Bytes of a file, with its name for messages."""

    source: str
    data: bytes

    @cached_property
    def lines(self) -> list[str]:
        """The lines of a text; the first one is row 1."""
        return lines_of(self.source, self.data, [])

    def unfinished_note(self) -> list[str]:
        """Note on a text whose last line has no end: it may have been cut within its last number."""
        if self.data.endswith((b"\n", b"\r", b"\0")):
            return []
        return [
            "The last line of the file has no end. If the file was cut off, its last value may lack "
            "digits: the format does not tell."
        ]

    def refusal(self, text: str, row: int | None = None, column: int | None = None) -> InputRefusedError:
        """Error that names the file, the row and the column."""
        return refusal(self.source, text, row, column)

    def require_numbers(self, words: Sequence[str], what: str, rows: Iterable[int]) -> None:
        """Reject words of which one is not a number to compute with; ``rows`` has the row of each."""
        for word, row in zip(words, rows, strict=True):
            if not _is_number(word):
                raise self.refusal(f"{shown(word.strip())} in {what} is not a finite number", int(row))


def shown(word: str) -> str:
    """A word of the file for a message."""
    return repr(word if len(word) <= _LONGEST_SHOWN else f"{word[:_LONGEST_SHOWN]}...")


class Words:
    """The words of a text, from the first to the last; lines that start with ``comment`` are left out."""

    def __init__(self, content: Content, first_row: int = 1, comment: str = "#"):
        self.content = content
        words: list[str] = []
        rows: list[int] = []
        columns: list[int] = []
        for row, line in enumerate(content.lines[first_row - 1 :], first_row):
            if not line.lstrip().startswith(comment):
                here = line.split()
                words += here
                rows += [row] * len(here)
                columns += range(1, len(here) + 1)
        self._words, self._rows, self._columns = words, np.array(rows, int), np.array(columns, int)
        self._next = 0

    @property
    def row(self) -> int:
        """Row of the next word; at the end, of the last one."""
        if not self._words:
            return 1
        return int(self._rows[min(self._next, len(self._words) - 1)])

    def require_over(self, last: str) -> None:
        """Reject words below what should be the end."""
        if not self.is_over():
            text = f"{shown(self._words[self._next])} follows {last}; the header has other numbers of values"
            raise self.content.refusal(text, self.row)

    def is_over(self) -> bool:
        """Whether no word is left."""
        return self._next >= len(self._words)

    @property
    def next(self) -> str:
        """The next word in small letters, which is not read by this; empty at the end."""
        return "" if self.is_over() else self._words[self._next].lower()

    def rest_of_row(self, row: int) -> list[str]:
        """The words that are left of this row, in small letters."""
        first = self._next
        while self._next < len(self._words) and self._rows[self._next] == row:
            self._next += 1
        return [word.lower() for word in self._words[first : self._next]]

    def go_to(self, row: int) -> None:
        """Skip to the first word in this row or below it."""
        self._next = int(np.searchsorted(self._rows, row))

    def word(self, what: str) -> str:
        """The next word, which should be ``what``."""
        if self.is_over():
            raise self.content.refusal(
                f"the file ends where {what} should follow; it is incomplete", self.row
            )
        self._next += 1
        return self._words[self._next - 1]

    def number(self, what: str) -> float:
        """The next word as a finite number."""
        return float(self.numbers(1, what)[0][0])

    def count(self, what: str, least: int = 1) -> int:
        """The next word as a number of things, each of which is at least one further word."""
        row, word = self.row, self.word(what)
        if not (word.isascii() and word.isdigit()):
            raise self.content.refusal(f"{what} is {shown(word)}; it must be a whole number", row)
        left = len(self._words) - self._next
        # Longer ones are beyond any file, and slow to convert.
        if len(word) > 12 or int(word) > left:
            text = f"{what} is {word[:12]}, but only {left} values follow; the file is incomplete"
            raise self.content.refusal(text, row)
        if int(word) < least:
            raise self.content.refusal(f"{what} is {word}; it must be at least {least}", row)
        return int(word)

    def numbers(self, n: int, what: str) -> tuple[Float[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """The next words as numbers that an angle, a share or a BSDF can be, and the row of each."""
        words = self._words[self._next : self._next + n]
        rows = self._rows[self._next : self._next + n]
        if len(words) < n:
            text = f"the file ends after {len(words)} of {n} values of {what}; it is incomplete"
            raise self.content.refusal(text, self.row)
        self._require_all_numbers(words, rows, what)
        self.content.require_numbers(words, what, rows.tolist())
        self._next += n
        values = np.array([float(word) for word in words])
        for position in np.flatnonzero(np.abs(values) > LARGEST_PER_SR)[:1]:
            text = f"{shown(words[position])} in {what} {impossible_per_sr(values[position])}"
            raise self.content.refusal(text, int(rows[position]), int(self.last_columns(n)[position]))
        return values, rows

    def _require_all_numbers(self, words: list[str], rows: Int[np.ndarray, " n"], what: str) -> None:
        """Reject a keyword among the values: there are fewer than the header counts."""
        place = next((k for k, word in enumerate(words) if word.isalpha() and not _is_float(word)), None)
        if place is not None and len(words) > 1:
            text = (
                f"{shown(words[place])} stands after {place} of {len(words)} values of {what}; the "
                f"counts in the "
            )
            raise self.content.refusal(f"{text}header do not agree", int(rows[place]))

    def last_columns(self, n: int) -> Int[np.ndarray, " n"]:
        """Place of each of the last n words in its row, from 1."""
        return self._columns[self._next - n : self._next]


def _is_float(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _is_number(word: str) -> bool:
    # float() reads 1_0 as 10.
    if "_" in word:
        return False
    try:
        return abs(float(word)) <= _LARGEST
    except ValueError:
        return False
