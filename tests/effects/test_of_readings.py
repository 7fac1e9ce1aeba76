"""Effects that a sample declares, in readings of spheres and of collimated light."""

import numpy as np
import pytest

import jaxink
from jaxink.effects import readings_model
from jaxink.errors import InputRefusedError
from jaxink.measurement import Readings
from jaxink.model import evaluate
from tests.samples import PRINTED_INK, edited


def readings() -> Readings:
    """Reflected, transmitted and collimated light of one incidence."""
    names = np.array(["R_total", "T_total", "T_collimated"])
    empty = np.full(3, np.nan)
    return Readings(names, np.full(3, 8.0), empty, empty, np.full(3, 550.0), np.full(3, 0.5))


def predicted(effects: str = "", ink: str = PRINTED_INK):
    return evaluate(readings_model(jaxink.parse_sample(ink + effects), readings()))


def test_a_gain_scales_all_readings_and_a_side_gain_those_in_reflection():
    plain = predicted()
    np.testing.assert_allclose(predicted("[effects]\ngain.relative = 0.1"), 1.1 * plain, rtol=1e-12)
    both = predicted("[effects]\ngain.relative = 0.1\nside_gain.relative = -0.2")
    np.testing.assert_allclose(both, plain * [1.1 * 0.8, 1.1, 1.1], rtol=1e-12)


def test_an_effect_of_the_sample_is_the_sample_that_has_it():
    # Half of the ink away from the light scatters more than the other by 0.8 of their mean.
    one = """thickness_um = 60
scattering_per_mm = { free = true, min = 1, max = 500, value = 60 }"""
    near = one.replace("= 60\n", "= 30\n").replace("value = 60", "value = 36")
    start, end = PRINTED_INK.index('[[layers]]\nname = "ink"'), PRINTED_INK.index("[noise]")
    ink = PRINTED_INK[start:end]
    first = edited(ink, (one, near))
    second = edited(ink, (one, near.replace("36", "84"), 'name = "ink"', 'name = "far"'))
    halves = PRINTED_INK[:start] + first + second + PRINTED_INK[end:]
    np.testing.assert_allclose(
        predicted("[effects]\ndepth_gradient.slope = 0.8"), predicted(ink=halves), rtol=1e-9
    )


def test_an_effect_of_a_goniometer_is_refused(told):
    with pytest.raises(InputRefusedError) as refused:
        predicted("[effects]\nstray_light.level_per_sr = 0.01")
    told(str(refused.value), "stray_light")
