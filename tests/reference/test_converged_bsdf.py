"""Converged BSDF tables of the work units W1 to W3, up to 89 deg, at the sizes chosen for an accuracy.

W1, W2: matched slab, W2 at full azimuth. W3: the same slabs with index 1.5 in air.
"""

import numpy as np
import pytest

from jaxink.optics.directions import Directions
from jaxink.optics.layers import ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.resolution import choose_sizes
from jaxink.solver.stack import Stack
from tests.reference.conftest import bsdf_points, column, predict

OPTICS = {
    "W1": (0.35, 0.999, 8.0, 1.0),
    "W2": (0.85, 0.999, 40.0, 1.0),
    "W3a": (0.35, 0.999, 8.0, 1.5),
    "W3b": (0.85, 0.999, 40.0, 1.5),
}


@pytest.mark.parametrize("accuracy", [None, 1e-4, 1e-6])
@pytest.mark.parametrize("case", OPTICS)
def test_bsdf(case, accuracy, converged):
    rows = [row for row in converged[case] if float(row["theta_o_deg"]) <= 89]
    assert len(rows) >= 60
    theta_i, theta_o, phi, side = bsdf_points(rows)
    asymmetry, albedo, thickness, index = OPTICS[case]
    layer = ScatteringLayer(index, thickness, albedo, HenyeyGreenstein(asymmetry))
    stack = Stack((layer,), 1.0, 1.0)
    config = choose_sizes(stack) if accuracy is None else choose_sizes(stack, accuracy)
    found = predict(stack, Directions.from_degrees(theta_i, theta_o, phi, side), config)
    np.testing.assert_allclose(found, column(rows, "bsdf_per_sr"), rtol=accuracy or 1e-4)
