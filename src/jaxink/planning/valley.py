"""Where the truth may be along what the present measurements do not determine."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.fitting import COMPARABLE_RISE, GradientSearch
from jaxink.planning.known import RANGE_DEVIATION, KnownFit


def valley(known: KnownFit, undetermined: Sequence[str]) -> list[Float[np.ndarray, " parameters"]]:
    """The minimum, and minima with each undetermined parameter held to its left and right.

    Parameters
    ----------
    known
        The present measurements.
    undetermined
        Names of the parameters that they do not determine within their ranges.

    Returns
    -------
    list
        Points scaled to [0, 1], the minimum first; those which the measurements exclude are left out.
    """
    points = [known.unit]
    if not undetermined:
        return points
    engine = GradientSearch(known.objective)
    lowest = known.programs.residual(known.unit).loss
    for position in (known.free.index(name) for name in undetermined):
        for side in (-1, 1):
            at = float(np.clip(known.unit[position] + side * RANGE_DEVIATION, 0.0, 1.0))
            end = engine.run(known.unit, {position: at})
            if end.outcome.converged and end.loss - lowest < COMPARABLE_RISE:
                points.append(end.unit)
    return points
