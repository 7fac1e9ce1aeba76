"""Limits of a search, and what its searches have used of them."""

import dataclasses

from jaxink.fitting.outcome import Outcome


@dataclasses.dataclass(frozen=True)
class SearchLimits:
    """Where searches end before they have found a minimum; None: no limit.

    Parameters
    ----------
    steps
        Of each search.
    evaluations
        Of all searches together; a Jacobian counts as one.
    seconds
        Run time of all searches together, without compilation.
    goal_loss
        Loss at which they stop.
    """

    steps: int | None = None
    evaluations: int | None = None
    seconds: float | None = None
    goal_loss: float | None = None

    @property
    def is_open(self) -> bool:
        """Whether the effort of a search is not limited."""
        return self.steps is None and self.evaluations is None and self.seconds is None


class Budget:
    """Limits, and how much of them the searches of a fit have used up; shared by these searches.

    Parameters
    ----------
    limits
        The limits.
    """

    def __init__(self, limits: SearchLimits):
        self.limits = limits
        self.evaluations = 0
        self.seconds = 0.0

    def reached(self, steps: int, evaluations: int, seconds: float, loss: float) -> Outcome | None:
        """The limit that a search with this effort and loss has reached, if any."""
        limits = self.limits
        if limits.goal_loss is not None and loss <= limits.goal_loss:
            return Outcome.GOAL
        if limits.steps is not None and steps >= limits.steps:
            return Outcome.MAX_STEPS
        if limits.evaluations is not None and self.evaluations + evaluations >= limits.evaluations:
            return Outcome.MAX_EVALUATIONS
        if limits.seconds is not None and self.seconds + seconds >= limits.seconds:
            return Outcome.MAX_SECONDS
        return None

    def spend(self, evaluations: int, seconds: float) -> None:
        """Take note of a search that has ended."""
        self.evaluations += evaluations
        self.seconds += seconds

    def narrowed(self, own: SearchLimits) -> "Budget":
        """What is left for one search that has limits of its own, besides the ones of the fit."""
        evaluations = None if own.evaluations is None else self.evaluations + own.evaluations
        of_fit = self.limits
        limits = dataclasses.replace(
            of_fit,
            steps=_least(of_fit.steps, own.steps),
            evaluations=_least(of_fit.evaluations, evaluations),
        )
        left = Budget(limits)
        left.evaluations, left.seconds = self.evaluations, self.seconds
        return left

    def is_spent(self, loss: float) -> bool:
        """Whether nothing is left for another search, or the lowest loss so far is the goal."""
        return self.reached(0, 0, 0.0, loss) is not None


def _least(*limits: int | None) -> int | None:
    return min((limit for limit in limits if limit is not None), default=None)
