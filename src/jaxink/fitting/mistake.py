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
    said = " Or: ".join(mistake.sentence(before) for mistake in named)
    several = " These data cannot tell these mistakes apart." if len(named) > 1 else ""
    return f"{said}{several} Nothing was changed: correct the input and fit again."
