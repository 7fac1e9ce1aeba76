"""Descriptions of a residual that name no cause: smooth functions of one variable, or of both polar angles.

A cause that is in no catalogue is often imitated by an effect that is. Such a description then needs a few
amplitudes more but comes closer, by more than these cost.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.residual import ResidualPoints
from jaxink.residual.modes import modes_for

_DEGREE = 3
_MODE_ORDER = 2


class Anonymous(NamedTuple):
    """A description: what the relative change depends on, its amplitudes, and its decrease in chi-square."""

    variable: str
    amplitudes: int
    delta_chi_square: float

    def penalised(self, n_points: int) -> float:
        """Decrease in chi-square minus ln(points) for each amplitude (Schwarz 1978)."""
        return self.delta_chi_square - self.amplitudes * np.log(n_points)


def best_anonymous(residual: ResidualPoints, points: Points, projection: Projection) -> Anonymous:
    """The best description of a residual, without what the free parameters reproduce."""
    found = []
    for variable, relative in _descriptions(residual, points):
        span = orthonormal_range(projection.unit(residual.whiten(relative)).unit)
        found.append(Anonymous(variable, span.shape[1], float(np.sum((span.T @ residual.whitened) ** 2))))
    return max(found, key=lambda one: one.penalised(len(points)))


def _descriptions(residual: ResidualPoints, points: Points) -> Iterator[tuple[str, np.ndarray]]:
    """What it depends on, in words, and the columns: the same on both sides, on one side only, or on each."""
    here = {side: residual.of_side(side)[:, None] for side in "RT"}
    variables = {
        "the angle of view": np.cos(np.deg2rad(points.theta_o_deg)),
        "the angle of incidence": np.cos(np.deg2rad(points.theta_i_deg)),
        "the order of measurement": points.order,
    }
    for name, values in variables.items():
        scaled = (values - values.mean()) / max(float(np.ptp(values)), 1e-300)
        yield from _by_side(name, np.vander(scaled, _DEGREE + 1), here)
    modes = [mode.values(residual) for mode in modes_for(residual, _MODE_ORDER)]
    yield from _by_side("the angles of incidence and view", np.stack(modes, axis=1), here)


def _by_side(name, columns, here) -> Iterator[tuple[str, np.ndarray]]:
    yield name, columns
    sides = [side for side, points in here.items() if points.any()]
    if len(sides) == 2:
        for side in sides:
            yield f"{name} on side {side}", columns * here[side]
        yield f"{name}, on each side", np.hstack([columns * here[side] for side in sides])
