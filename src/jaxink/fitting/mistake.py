"""A mistake in the input of a fit that was considered."""

import dataclasses
from collections.abc import Sequence

# Statements say what the input reads like; of a rejected one, only what was supposed may be said.
_SUPPOSED = {
    " reads as if it were ": " is ",
    " read as if they were ": " are ",
    " reads as if it had been ": " has been ",
    " reads like ": " is ",
    " read like ": " are ",
}


@dataclasses.dataclass(frozen=True)
class Mistake:
    """A mistake in the input, as a hypothesis that was tested by one refit of the corrected input.

    Parameters
    ----------
    name
        Key of the hypothesis.
    statement, remedy
        What the input reads like, and what would be right.
    reduced_chi_square, delta_chi_square
        After the refit, and the decrease in chi-square; None if no refit is needed to tell.
    is_named
        Whether the data say that the mistake was made.
    """

    name: str
    statement: str
    remedy: str
    reduced_chi_square: float | None
    delta_chi_square: float | None
    is_named: bool

    @property
    def needs_no_refit(self) -> bool:
        """Whether the data alone tell."""
        return self.reduced_chi_square is None

    @property
    def supposition(self) -> str:
        """What was supposed, without the claim of the statement that the input reads like it."""
        words = self.statement
        for claimed, supposed in _SUPPOSED.items():
            words = words.replace(claimed, supposed)
        return words

    def sentence(self, before: float | None) -> str:
        """Description, given the reduced chi-square of the input as it is."""
        change = ""
        if self.reduced_chi_square is not None and before is not None:
            change = f": reduced chi-square {before:.4g} -> {self.reduced_chi_square:.3g} after one refit"
        return f"{self.statement}{change}. If so, {self.remedy}."


def rejected(mistakes: Sequence[Mistake]) -> list[Mistake]:
    """The mistakes that were tried by a refit and that the data do not name."""
    return [mistake for mistake in mistakes if not mistake.is_named and not mistake.needs_no_refit]


def rejection(mistakes: Sequence[Mistake], before: float | None, *, is_misfit: bool) -> str:
    """What became of the mistakes that are rejected, given the reduced chi-square of the input as it is."""
    words = "Each was tested by one refit of the input corrected for it, and rejected."
    if not is_misfit or any(mistake.is_named for mistake in mistakes):
        return words
    as_is = "" if before is None else f", whose reduced chi-square is {before:.4g}"
    return f"{words} None of them explains the misfit of the input as it is{as_is}."


def mistakes_sentence(mistakes: tuple[Mistake, ...], before: float | None) -> str:
    """What the named mistakes read like; empty if there are none."""
    named = [mistake for mistake in mistakes if mistake.is_named]
    if not named:
        return ""
    refitted = [mistake for mistake in named if not mistake.needs_no_refit]
    # A mistake that a refit confirms also says what to do about what the data alone tell.
    said = [f"{mistake.statement}." for mistake in named if mistake.needs_no_refit]
    said.append(" Or: ".join(mistake.sentence(before) for mistake in refitted or named))
    if len(refitted) > 1:
        said.append("These data cannot tell these mistakes apart.")
    return " ".join(
        [*(said if refitted else said[-1:]), "Nothing was changed: correct the input and fit again."]
    )
