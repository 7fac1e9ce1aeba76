"""A density on the unit square, given at a grid, and the map that turns uniform points into it.

The density is bilinear between the entries (Dupuy and Jakob 2018 ACM Trans. Graph. 37, 274, section 5).
"""

import numpy as np
from jaxtyping import Float


def warped(
    density: Float[np.ndarray, "ny nx"], x: Float[np.ndarray, " points"], y: Float[np.ndarray, " points"]
) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, " points"]]:
    """Points with the given density, of uniform points (x, y) of the unit square.

    The row is chosen by y from the density of all rows, then the column by x from the density along that row.
    """
    density = np.asarray(density, float)
    row_powers = (density[:, :-1] + density[:, 1:]).sum(axis=1) / 2
    row, v = _inverse_cdf(np.broadcast_to(row_powers, (y.size, row_powers.size)), y)
    along = (1 - v)[:, None] * density[row] + v[:, None] * density[row + 1]
    column, u = _inverse_cdf(along, x)
    ny, nx = density.shape
    return (column + u) / (nx - 1), (row + v) / (ny - 1)


def interpolated(
    table: Float[np.ndarray, "ny nx"], x: Float[np.ndarray, "*points"], y: Float[np.ndarray, "*points"]
) -> Float[np.ndarray, "*points"]:
    """A table over the unit square between its entries, bilinearly."""
    ny, nx = table.shape
    column, row = (np.clip(np.floor(p * (n - 1)).astype(int), 0, n - 2) for p, n in ((x, nx), (y, ny)))
    u, v = x * (nx - 1) - column, y * (ny - 1) - row
    below = (1 - u) * table[row, column] + u * table[row, column + 1]
    above = (1 - u) * table[row + 1, column] + u * table[row + 1, column + 1]
    return (1 - v) * below + v * above


def _inverse_cdf(nodes: Float[np.ndarray, "points nodes"], share: Float[np.ndarray, " points"]):
    """Interval, and place within it, up to which a piecewise linear density holds the given share."""
    steps = (nodes[:, :-1] + nodes[:, 1:]) / 2
    cumulative = np.concatenate([np.zeros((len(nodes), 1)), np.cumsum(steps, axis=1)], axis=1)
    wanted = np.clip(share, 0, 1) * cumulative[:, -1]
    interval = np.clip((cumulative[:, 1:] < wanted[:, None]).sum(axis=1), 0, steps.shape[1] - 1)
    points = np.arange(len(nodes))
    first, last = nodes[points, interval], nodes[points, interval + 1]
    rest = wanted - cumulative[points, interval]
    # Of first t + (last - first) t^2 / 2 = rest, the root within the interval, without cancellation.
    root = np.sqrt(np.maximum(first**2 + 2 * rest * (last - first), 0))
    total = first + root
    place = np.where(total > 0, 2 * rest / np.where(total > 0, total, 1), 0.0)
    return interval, np.clip(place, 0, 1)
