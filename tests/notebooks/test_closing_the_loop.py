"""Closing the loop: with the measured samples where they are, else with simulated ones."""

import pytest


@pytest.mark.slow
def test_closing_the_loop(run):
    names = run("closing_the_loop")
    assert names["diagnosis"].verdict.effects[0] == "stray_light"
    assert names["rms_percent"](names["after"], names["PREDICTED"]) < 2
    assert names["waves"].merit.relative_rms < names["smooth"].merit.relative_rms / 3
