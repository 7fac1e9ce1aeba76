"""The row of one measurement: how it ended, and what was found."""

import dataclasses
import re
from typing import Any

from jaxink.display.codes import CodeWithMeaning
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.decoding import decode
from jaxink.files.encoding import plain

ROW_VERSION = 1
# Stands for the digest of files that could not be read.
ABSENT = "absent"
# Folder of the results, within that of the batch.
RESULTS = "results"
_BELOW = re.compile(r"(/[\w-][\w.-]*)+", re.ASCII)


class RowOutcome(CodeWithMeaning):
    """How a measurement of a batch ended."""

    DONE = "done", "with a result"
    NOT_CONVERGED = "not_converged", "with a result whose search did not end in a minimum"
    REFUSED = "refused", "invalid or missing input; the sentence says what is wrong"
    FAILED = "failed", "an unexpected error, which the sentence names"
    TIME_LIMIT = "time_limit", "ended at the time limit"
    MEMORY_LIMIT = "memory_limit", "ended at the memory limit"
    KILLED = "killed", "ended the process without an answer, twice"

    @property
    def has_result(self) -> bool:
        """Whether there is a folder with a result."""
        return self in (RowOutcome.DONE, RowOutcome.NOT_CONVERGED)

    @property
    def depends_on_machine(self) -> bool:
        """Whether another machine, or another time, could give another outcome."""
        return self not in (RowOutcome.DONE, RowOutcome.NOT_CONVERGED, RowOutcome.REFUSED)


@dataclasses.dataclass(frozen=True)
class RowParameter:
    """A free parameter of a measurement, as in its result."""

    name: str
    unit: str
    value: float | None
    standard_error: float | None
    flag: str = ""


@dataclasses.dataclass(frozen=True)
class Inputs:
    """Digests of what a row was computed from."""

    measurement: str
    sample: str
    options: str

    def changed_since(self, earlier: "Inputs") -> tuple[str, ...]:
        """What differs, as clauses; a measurement that cannot be read is not known to differ from another."""
        words = {"sample": "its sample changed", "options": "the options changed"}
        others = (text for key, text in words.items() if getattr(self, key) != getattr(earlier, key))
        return (*self._measurement_since(earlier), *others)

    def _measurement_since(self, earlier: "Inputs") -> tuple[str, ...]:
        if self.measurement in (earlier.measurement, ABSENT):
            return ()
        if earlier.measurement == ABSENT:
            return ("its measurement could not be read before, and now it can",)
        return ("its measurement changed",)


@dataclasses.dataclass(frozen=True)
class RowColour:
    """Colour of the fit of a measurement, in the measured direction nearest to 45:0.

    Parameters
    ----------
    direction
        Angles of incidence and view.
    light
        Illuminant, observer and band; colours in other light do not compare.
    L, a, b
        CIELAB.
    """

    direction: str
    light: str
    L: float
    a: float
    b: float


@dataclasses.dataclass(frozen=True)
class Row:
    """What a batch knows of one measurement.

    Parameters
    ----------
    name, files
        The measurement.
    inputs
        What the row was computed from.
    outcome, sentence
        How it ended, in a word and in a sentence.
    verdict
        Code of the verdict of the fit, or of the diagnosis if there is one; None without a result.
    effects
        Effects that a diagnosis has added.
    points, chi_square, reduced_chi_square
        Of the last model; None if unknown.
    parameters
        The free parameters of the last model.
    seconds
        Time of the measurement, reading and writing included.
    attempts
        Number of processes that have tried it.
    host, finished
        Where, and when (UTC).
    colour
        Colour of the fit; None of one wavelength, or without colour-science.
    page
        Its own page, from the folder of the batch; empty if there is none. The report links it, so it must
        be a file of the measurement's own folder in ``results``.
    """

    name: str
    files: tuple[str, ...]
    inputs: Inputs
    outcome: str
    sentence: str
    verdict: str | None = None
    effects: tuple[str, ...] = ()
    points: int | None = None
    chi_square: float | None = None
    reduced_chi_square: float | None = None
    parameters: tuple[RowParameter, ...] = ()
    seconds: float = 0.0
    attempts: int = 1
    host: str = ""
    finished: str = ""
    page: str = ""
    colour: RowColour | None = None

    def __post_init__(self):
        require_one_of("outcome", self.outcome, tuple(RowOutcome))
        own = f"{RESULTS}/{self.name}"
        if self.page and not (self.page.startswith(own) and _BELOW.fullmatch(self.page.removeprefix(own))):
            raise InputRefusedError(f"page is {self.page!r}; it must be a file within {own}.")

    @property
    def ended(self) -> RowOutcome:
        """The outcome as a `RowOutcome`."""
        return RowOutcome[self.outcome.upper()]

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in the file of the row."""
        return {"schema_version": ROW_VERSION, **plain(self)}


def row_from_dict(data: Any) -> Row:
    """Row from the data of `Row.to_dict`.

    Raises
    ------
    InputRefusedError
        If a key is missing, unknown or has a value of the wrong type, or for another version.
    """
    version = data.get("schema_version") if isinstance(data, dict) else None
    if version is True or version != ROW_VERSION:
        raise InputRefusedError(
            f"schema_version is {version!r}; this jaxink reads rows of version {ROW_VERSION}."
        )
    return decode(Row, {key: value for key, value in data.items() if key != "schema_version"})
