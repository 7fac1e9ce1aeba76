"""Readings that must be equal, compared under the noise in use."""

import numpy as np
import pytest

from jaxink.diagnosis.findings.consistency import consistency_of
from jaxink.measurement import FitNoise, GonioData

NOISE = 0.01


def measured(asymmetry, factors, seed=3):
    """A sample whose BSDF is symmetric and reciprocal, with noise; a tilt makes +phi brighter."""
    rng = np.random.default_rng(seed)
    angles = np.array([10.0, 25.0, 40.0, 55.0, 70.0])
    theta_i, theta_o, phi = (
        a.ravel() for a in np.meshgrid(angles, angles, [-150.0, -90.0, 90.0, 150.0], indexing="ij")
    )
    f = 0.3 * (1 + 0.2 * np.cos(np.deg2rad(theta_i)) * np.cos(np.deg2rad(theta_o)))
    f = (
        f
        * (1 + asymmetry * np.sign(phi))
        * (1 + factors * rng.standard_normal(5)[np.searchsorted(angles, theta_i)])
    )
    f = f * (1 + NOISE * rng.standard_normal(f.size))
    n = f.size
    return GonioData(theta_i, theta_o, phi, np.full(n, 550.0), np.zeros(n, bool), f)


def noise(data, scan_relative=0.0):
    return FitNoise(NOISE * data.bsdf_per_sr, scan_relative, "stated", True)


def test_readings_within_the_noise_agree():
    data = measured(0.0, 0.0)
    found = {c.kind: c for c in consistency_of(data, noise(data))}
    assert set(found) == {"mirror", "reciprocal"}
    assert found["mirror"].pairs == 50
    for one in found.values():
        assert one.expected == pytest.approx(NOISE, rel=1e-6)
        assert one.relative == pytest.approx(NOISE, rel=0.3)
        assert not one.exceeds_noise


def test_a_tilted_sample_breaks_the_symmetry_but_not_the_reciprocity(told):
    data = measured(0.015, 0.0)
    broken = [c for c in consistency_of(data, noise(data)) if c.exceeds_noise]
    assert [c.kind for c in broken] == ["mirror"]
    told(broken[0].sentence, "+phi", "-phi", numbers=False)


def test_factors_of_scans_break_reciprocity_unless_they_are_stated():
    data = measured(0.0, 0.04)
    assert [c.kind for c in consistency_of(data, noise(data)) if c.exceeds_noise] == ["reciprocal"]
    assert not any(c.exceeds_noise for c in consistency_of(data, noise(data, 0.04)))
