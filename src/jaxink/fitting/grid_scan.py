"""A scan over a grid of two parameters whose misfit has many minima together."""

from collections.abc import Callable, Sequence

import numpy as np

from jaxink.fitting.gradient import GradientSearch, together
from jaxink.fitting.limits import Budget
from jaxink.fitting.outcome import Search
from jaxink.fitting.scanning import DIRECT_JACOBIANS, RANKING_DECREMENT, Scan
from jaxink.sample import Parameter

# Values of the radius and of the index. A grid of 12 by 5 misses minima that one of 16 by 6 finds.
_SHAPE = (16, 6)
_HELD_JACOBIANS, _RELEASED_JACOBIANS = 4, 8
# Share of the fits at grid points, the lowest ones, that go on with all parameters.
_RELEASED = 1 / 3
# So many are searched to their end: the lowest minimum, and the rivals that a result lists.
_KEPT = 8
# Of ends that are closer in both unit variables, the lowest one is searched.
_SAME = 0.04


def index_beside(free: Sequence[Parameter], radius: int) -> int | None:
    """Position of the refractive index of the particles whose radius is free, if it is free, too.

    Parameters
    ----------
    free
        The free parameters.
    radius
        Position of the radius.
    """
    particles = free[radius].name.rpartition(".")[0]
    names = [parameter.name for parameter in free]
    index = f"{particles}.particle_index"
    return names.index(index) if index in names else None


def scan_grid(
    engine: GradientSearch,
    first: np.ndarray,
    positions: tuple[int, int],
    progress: Callable[[int, float], None] | None = None,
    within: Budget | None = None,
) -> Scan:
    """Find starts at the lowest minima over two parameters.

    Scattering by a sphere varies with its size and with its refractive index through their product, so that
    minima lie side by side in the plane of both; a scan along the radius, which follows one value of the
    index continuously, passes by some of them. Here each point of a grid is a start of its own, from the
    middle of all other ranges: a few steps with both parameters held, then, from the lowest third, a few
    steps of all parameters. A search from the start values comes first.

    Parameters
    ----------
    engine
        The search.
    first
        Start values, scaled to [0, 1].
    positions
        The radius and the index.
    progress
        Called with the number of the fit and the loss there.
    within
        Limits of the fit that the scan belongs to; it ends where they are reached.
    """
    every = [engine.run(first, max_jacobians=DIRECT_JACOBIANS, within=within)]
    direct = every[0]

    def run(start: np.ndarray, held: dict[int, float] | None, jacobians: int) -> Search | None:
        if within is not None and within.is_spent(min(one.loss for one in every)):
            return None
        every.append(engine.run(start, held, None, jacobians, within, RANKING_DECREMENT))
        if progress is not None:
            progress(len(every) - 1, every[-1].loss)
        return every[-1]

    sides = [np.linspace(0.0, 1.0, count).tolist() for count in _SHAPE]
    points = [dict(zip(positions, (x, y), strict=True)) for x in sides[0] for y in sides[1]]
    middle = np.full_like(first, 0.5)
    held = _by_loss([run(middle, point, _HELD_JACOBIANS) for point in points])
    best = held[: round(len(points) * _RELEASED)]
    ends = _apart(_by_loss([direct, *(run(one.unit, None, _RELEASED_JACOBIANS) for one in best)]), positions)
    whole = together("scan", every, ends[0] if ends else direct)
    # Along a valley, ends that are left elsewhere are no minima of their own: only searches tell.
    return Scan([one.unit for one in ends[:_KEPT]] or [direct.unit], whole, direct, (), {})


def _by_loss(found: Sequence[Search | None]) -> list[Search]:
    finite = [one for one in found if one is not None and np.isfinite(one.loss)]
    return sorted(finite, key=lambda one: one.loss)


def _apart(ends: Sequence[Search], positions: tuple[int, int]) -> list[Search]:
    """The lowest one of each group of ends that are close to each other."""
    chosen = list[Search]()
    for end in ends:
        here = end.unit[list(positions)]
        if all(np.max(np.abs(here - other.unit[list(positions)])) >= _SAME for other in chosen):
            chosen.append(end)
    return chosen
