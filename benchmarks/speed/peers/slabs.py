"""What peers that solve slabs share: each class is made for a unit and a size, and solves sets of optics."""

import numpy as np

from benchmarks.speed.peers.units import FORWARD_STEPS, OUTGOING, SLABS

COSINES = np.cos(np.deg2rad(OUTGOING))
# cdisort wants ascending cosines, transmitted (negative) ones first.
BOTH_SIDES = np.concatenate([-COSINES, COSINES[::-1]])


def n_moments(sets, streams: int) -> int:
    """Moments that describe the sharpest phase function to 1e-10, and one more than delta-M keeps."""
    return max(streams + 1, int(np.ceil(np.log(1e-10) / np.log(np.max(sets[:, 0])))))


def forward_differences(solve, centre):
    """Value and derivatives from four solves."""
    steps = np.diag(FORWARD_STEPS)
    values = solve(np.vstack([centre, centre + steps]))
    return values[:1], (values[1:] - values[0]) / np.diag(steps)[:, None]


def build(solver, unit: str, size):
    """One run of a unit by a solver class."""
    slab = SLABS[unit]
    n_sets = 1 + len(FORWARD_STEPS) if unit == "W4" else len(slab.sets)
    made = solver(slab, size, n_sets)
    name = getattr(solver, "gives", "values")
    if unit != "W4":
        return lambda: {name: made.solve(slab.sets)}

    def with_derivatives():
        values, derivatives = forward_differences(made.solve, slab.sets[0])
        return {name: values, "derivatives": derivatives}

    return with_derivatives
