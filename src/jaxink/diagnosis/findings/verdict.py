"""The verdict: a code and a sentence."""

import dataclasses

from jaxink.display.brief import brief_repr
from jaxink.display.codes import CodeWithMeaning


class VerdictCode(CodeWithMeaning):
    """Possible results of a diagnosis; the value appears in ``report.json``."""

    NO_MISFIT = (
        "no_misfit",
        "the residual of the declared model is consistent with noise, and no effect is significant",
    )
    EXPLAINED = "explained", "with the effects found, the residual is consistent with noise"
    EXPLAINED_BY_ONE_OF = (
        "explained_by_one_of",
        "with any one of several effects, which the data cannot distinguish, the residual is consistent with "
        "noise",
    )
    INSTRUMENT = "instrument", "explained by instrument effects alone"
    INPUT_MISTAKE = (
        "input_mistake",
        "a mistake in the input explains the misfit, and no effect does so as well",
    )
    NOT_TESTABLE = "not_testable", "there are not more points than parameters"
    ORDER_REMAINS = (
        "order_remains",
        "the residual is within the accuracy of the noise, but has an order that no effect explains",
    )
    IMITATED = (
        "imitated",
        "effects fit the residual, but with values at the end of a range or outside the validity of their "
        "theory, or no more closely than a smooth function without a cause: they may imitate its cause",
    )
    PARTLY_EXPLAINED = "partly_explained", "effects were found, but structure remains"
    UNEXPLAINED_STRUCTURE = "unexplained_structure", "structure remains, and no effect passed the tests"
    UNFINISHED = "unfinished", "a time limit left out tests that any other verdict would rest on"

    @property
    def structure_remains(self) -> bool:
        """Whether the final model does not fit the data; False if the code does not say."""
        return self in (
            VerdictCode.INPUT_MISTAKE,
            VerdictCode.IMITATED,
            VerdictCode.PARTLY_EXPLAINED,
            VerdictCode.UNEXPLAINED_STRUCTURE,
        )

    @property
    def fits_noise(self) -> bool:
        """Whether the final model fits the data."""
        unsure = (VerdictCode.NOT_TESTABLE, VerdictCode.ORDER_REMAINS, VerdictCode.UNFINISHED)
        return not self.structure_remains and self not in unsure


@dataclasses.dataclass(frozen=True)
class Verdict:
    """The result of a diagnosis: its code, the names of effects (best first), and a sentence."""

    __repr__ = brief_repr

    code: VerdictCode
    effects: tuple[str, ...]
    sentence: str
