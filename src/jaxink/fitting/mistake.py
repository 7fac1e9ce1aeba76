"""A mistake in the input of a fit that was considered."""

import dataclasses


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

    def sentence(self, before: float | None) -> str:
        """Description, given the reduced chi-square of the input as it is."""
        change = ""
        if self.reduced_chi_square is not None and before is not None:
            change = f": reduced chi-square {before:.4g} -> {self.reduced_chi_square:.3g} after one refit"
        return f"{self.statement}{change}. If so, {self.remedy}."


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
