"""The forward model alone: derivatives, a designed measurement, a designed thickness."""

import math

import pytest


@pytest.mark.slow
def test_forward_model(run):
    names = run("forward_model")
    errors = names["errors"]
    assert errors["R and T at 0 to 60 deg"][1] < 0.01 < errors["T at 0 deg"][1]
    assert math.isclose(float(names["powers"](names["thickness"])[1]), 0.1, rel_tol=1e-5)
