"""One dot against Mitsuba's volumetric path tracer, which shares nothing with the light guide's paths."""

import pytest

from benchmarks.validation.render.one_dot import by_mitsuba, by_paths

pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'jaxink[render]'")


def test_as_much_light_returns_from_a_dot_as_in_mitsuba(ink):
    one, error = by_paths(ink.medium, 0.25, 10_000, 1)
    other, error_there = by_mitsuba(ink.medium, 0.25, 4_000, 1)
    assert one == pytest.approx(other, abs=3.5 * (error**2 + error_there**2) ** 0.5)
