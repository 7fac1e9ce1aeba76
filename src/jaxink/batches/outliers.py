"""Measurements that are far from the others."""

from collections.abc import Iterable

import numpy as np

from jaxink.batches.row import Row

# Iglewicz and Hoaglin 1993, How to detect and handle outliers: the modified z-score and its limit.
_LIMIT = 3.5
_NORMAL = 1.4826
_FEWEST = 5


def outlying(rows: Iterable[Row]) -> dict[str, set[str]]:
    """Names of the rows that are far from the median, by parameter; those without a minimum do not count."""
    values: dict[str, dict[str, float]] = {}
    for row in rows:
        for p in row.parameters:
            if p.value is not None and row.outcome == "done":
                values.setdefault(p.name, {})[row.name] = p.value
    return {name: _far(found) for name, found in values.items()}


def _far(found: dict[str, float]) -> set[str]:
    if len(found) < _FEWEST:
        return set()
    numbers = np.array(list(found.values()))
    apart = np.abs(numbers - np.median(numbers))
    scale = _NORMAL * np.median(apart)
    # With a scale of 0, more than half are equal, and every other one is apart from them.
    return {name for name, distance in zip(found, apart, strict=True) if distance > _LIMIT * scale}
