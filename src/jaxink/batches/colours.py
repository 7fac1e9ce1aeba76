"""Colours of the measurements of a batch, and how far each is from the first."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from jaxink.batches.row import Row
from jaxink.colour.cie import difference
from jaxink.errors import InputRefusedError


def colour_columns(rows: Sequence[Row]) -> dict[str, list[Any]]:
    """CIELAB of each row, and its CIEDE2000 to the first one that has a colour; no column if none has.

    A colour in another direction or light than that of the first has no difference.
    """
    first = next((row.colour for row in rows if row.colour is not None), None)
    if first is None:
        return {}
    colours = [row.colour for row in rows]
    columns: dict[str, list[Any]] = {
        f"lab_{name}": [None if one is None else getattr(one, name) for one in colours] for name in "Lab"
    }
    differences: list[float | None] = []
    for one in colours:
        same = one is not None and (one.direction, one.light) == (first.direction, first.light)
        if not same or one is None:
            differences.append(None)
            continue
        labs = (np.array([c.L, c.a, c.b]) for c in (one, first))
        try:
            differences.append(float(difference(*labs)))
        except InputRefusedError:
            # The rows are of a machine with colour-science, which this one lacks.
            differences.append(None)
    return columns | {"ciede2000_to_first": differences}
