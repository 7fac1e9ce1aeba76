"""The verdict: what is the case, in a code and in words."""

import dataclasses
import enum


class VerdictCode(enum.StrEnum):
    """What a diagnosis can end with; the value stands in ``report.json``."""

    meaning: str

    NO_MISFIT = (
        "no_misfit",
        "the residual of the declared model is consistent with noise, and no effect is significant",
    )
    EXPLAINED = "explained", "with the effects found, the residual is consistent with noise"
    EXPLAINED_BY_ONE_OF = "explained_by_one_of", "the same, but the data cannot distinguish several effects"
    INSTRUMENT = "instrument", "explained by instrument effects alone"
    NOT_TESTABLE = "not_testable", "there are not more points than parameters"
    PARTLY_EXPLAINED = "partly_explained", "effects were found, but structure remains"
    UNEXPLAINED_STRUCTURE = "unexplained_structure", "structure remains, and no effect passed the tests"

    def __new__(cls, code: str, meaning: str):
        """A code, with its meaning beside it."""
        member = str.__new__(cls, code)
        member._value_ = code
        member.meaning = meaning
        return member

    @property
    def structure_remains(self) -> bool:
        """Whether the model that was ended with misses the data."""
        return self in (VerdictCode.PARTLY_EXPLAINED, VerdictCode.UNEXPLAINED_STRUCTURE)

    @property
    def is_met(self) -> bool:
        """Whether the model that was ended with leaves nothing to look for."""
        return not self.structure_remains and self is not VerdictCode.NOT_TESTABLE


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What is the case.

    Parameters
    ----------
    code
        What kind of case.
    effects
        Names, best first.
    sentence
        In words.
    """

    code: VerdictCode
    effects: tuple[str, ...]
    sentence: str
