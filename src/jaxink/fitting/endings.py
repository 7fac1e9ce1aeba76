"""Ends of searches sorted into distinct minima."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.fitting.minima import Minima, Minimum
from jaxink.fitting.outcome import Search

# Two ends are in one minimum if the linear model at one of them foresees less than this rise in chi-square at
# the other, with the noise scaled: they are less than a standard error apart.
_SAME = 1.0
# They are, too, at smaller distances in all unit variables; the second one is for searches that end without a
# Jacobian and by their own criterion.
_CLOSE, _CLOSE_WITHOUT_JACOBIAN = 1e-3, 1e-2
_MOST_KEPT = 50


@dataclasses.dataclass(frozen=True)
class Ending:
    """Where a search ended.

    Parameters
    ----------
    search
        The search.
    is_start
        Whether it began at a start: that of the sample, or a random one.
    swept
        For a minimum that a sweep has passed by: by the position of a swept parameter, the distance in its
        unit variable from which minima are surely others. None for a search that went on to its end.
    shift
        Change of the best minimum's loss by later refinements of the resolution.
    """

    __repr__ = brief_repr

    search: Search
    is_start: bool = False
    swept: Mapping[int, float] | None = None
    shift: float = 0.0

    @property
    def loss(self) -> float:
        """To be compared with losses at the final resolution."""
        return self.search.loss + self.shift

    @property
    def is_minimum(self) -> bool:
        """Whether there is a minimum here or nearby."""
        return np.isfinite(self.loss) and (self.swept is not None or self.search.outcome.converged)


def minima_of(
    endings: Sequence[Ending],
    best: Search,
    scale: float,
    named: Callable[[Float[np.ndarray, " parameters"]], dict[str, float]],
) -> Minima | None:
    """The distinct minima among the ends of searches; None if the best one is none.

    Parameters
    ----------
    endings
        Ends of all searches from starts, of others that are to count, and the minima of a sweep.
    best
        The lowest search, at the final resolution; a later form of one of the endings.
    scale
        See `noise_scale`.
    named
        Free parameters by name from unit variables.
    """
    if not best.outcome.converged:
        return None
    # Searches of all parameters come first: what a sweep has passed by joins the minimum found from there.
    known = sorted((e for e in endings if e.is_minimum), key=lambda e: (e.swept is not None, e.loss))
    groups: list[list[Ending]] = [[Ending(best)]]
    for ending in known:
        for group in groups:
            if _is_same(group[0], ending, scale):
                group.append(ending)
                break
        else:
            groups.append([ending])
    first, *others = groups
    kept = [first, *sorted(others, key=lambda group: group[0].loss)][:_MOST_KEPT]
    rises = np.array([max(group[0].loss - best.loss, 0.0) / scale for group in kept])
    weights = np.exp(-rises / 2)
    found = tuple(
        Minimum(
            values=named(group[0].search.unit),
            loss=best.loss + rise * scale,
            rise=rise,
            weight=weight,
            starts=sum(ending.is_start for ending in group),
            is_searched=group[0].swept is None,
        )
        for group, rise, weight in zip(kept, rises.tolist(), (weights / weights.sum()).tolist(), strict=True)
    )
    starts = [ending for ending in endings if ending.is_start]
    unfinished = sum(not ending.is_minimum for ending in starts)
    return Minima(len(starts), unfinished, scale, len(groups) - len(kept), found)


def noise_scale(loss: float, freedom: int, is_chi_square: bool) -> float:
    """Difference in loss that stands for one unit of chi-square, with the noise scaled to the misfit.

    Parameters
    ----------
    loss
        At the best minimum.
    freedom
        Degrees of freedom.
    is_chi_square
        Whether the loss is chi-square; noise is then at least what is stated.
    """
    return max(loss / freedom, 1.0 if is_chi_square else float(np.finfo(float).tiny))


def _is_same(one: Ending, other: Ending, scale: float) -> bool:
    """Whether an end is in the minimum of another, lower one."""
    apart = other.search.unit - one.search.unit
    if other.swept is not None:
        return all(abs(float(apart[at])) < distance for at, distance in other.swept.items())
    triangle = one.search.triangle
    if triangle is None:
        return _largest(apart) < _CLOSE_WITHOUT_JACOBIAN
    foreseen = float(np.sum((triangle @ apart) ** 2)) / scale
    return foreseen < _SAME or _largest(apart) < _CLOSE


def _largest(apart: Float[np.ndarray, " parameters"]) -> float:
    return float(np.max(np.abs(apart), initial=0.0))
