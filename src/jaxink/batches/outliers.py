"""Measurements that are far from the others."""

from collections.abc import Iterable
from statistics import NormalDist

import numpy as np

from jaxink.batches.row import Row
from jaxink.batches.verdicts import standard_errors_hold

# Iglewicz and Hoaglin 1993, How to detect and handle outliers: the modified z-score and its limit.
_LIMIT = 3.5
_NORMAL = 1.4826
_FEWEST = 5
# Probability that noise alone brings any of the measurements as far as this from the median (Bonferroni).
_LEVEL = 0.05


def outlying(rows: Iterable[Row]) -> dict[str, set[str]]:
    """Names of the rows that are far from the median, by parameter; those without a minimum do not count.

    Far is a distance beyond the scatter of the others, and beyond what the standard error of the value itself
    allows among so many; one that does not hold allows nothing.
    """
    found: dict[str, dict[str, tuple[float, float]]] = {}
    for row in rows:
        for p in row.parameters:
            if p.value is not None and row.outcome == "done":
                error = (p.standard_error or 0.0) if standard_errors_hold(row) else 0.0
                found.setdefault(p.name, {})[row.name] = p.value, error
    return {name: _far(values) for name, values in found.items()}


def errors_allowed(n: int) -> float:
    """Distance in standard errors that noise alone exceeds in any of ``n`` values in 5 % of cases."""
    return NormalDist().inv_cdf(1 - _LEVEL / (2 * n))


def _far(found: dict[str, tuple[float, float]]) -> set[str]:
    if len(found) < _FEWEST:
        return set()
    numbers, errors = np.array(list(found.values())).T
    apart = np.abs(numbers - np.median(numbers))
    scale = _NORMAL * np.median(apart)
    # With a scale of 0, more than half are equal, and every other one is apart from them.
    least = np.maximum(_LIMIT * scale, errors_allowed(len(found)) * errors)
    return {name for name, distance, most in zip(found, apart, least, strict=True) if distance > most}
