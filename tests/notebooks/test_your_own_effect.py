"""An effect of one's own is found, saved and loaded."""

import pytest


@pytest.mark.slow
def test_your_own_effect(run):
    names = run("your_own_effect")
    assert names["diagnosis"].verdict.effects == ("vignetting",)
    assert abs(names["corrected"]["vignetting.loss"].value - names["LOSS"]) < 0.01
