"""The star product of the benchmarks against closed forms."""

import numpy as np
import pytest

from benchmarks.validation.published.joined import Channels, Last, Operator, series, smooth_face, summed

CHANNELS = Channels((1.0, 1.5), np.sin(np.deg2rad([0.0, 40.0])))
EXACT = slice(-2, None)


def fresnel(cosine, index):
    """Reflectance of a face from air."""
    beyond = np.sqrt(1 - (1 - cosine**2) / index**2)
    s = (cosine - index * beyond) / (cosine + index * beyond)
    p = (index * cosine - beyond) / (index * cosine + beyond)
    return (s**2 + p**2) / 2


def test_a_plate_reflects_and_transmits_as_airy_sums():
    plate = smooth_face(CHANNELS, 1.0, 1.5).on(smooth_face(CHANNELS, 1.5, 1.0))
    r = fresnel(np.cos(np.deg2rad([0.0, 40.0])), 1.5)
    np.testing.assert_allclose(plate.above.regular[EXACT], 2 * r / (1 + r), rtol=1e-12)
    np.testing.assert_allclose(plate.down.regular[EXACT], (1 - r) / (1 + r), rtol=1e-12)


def test_a_diffuser_behind_a_face_follows_saunderson():
    albedo, n = 0.8, len(CHANNELS.kappa)
    lambertian = np.full((1, n, n), albedo / np.pi / 1.5**2)
    nothing = np.zeros(n)
    diffuser = Last(
        Operator(lambertian, nothing, CHANNELS.weight), Operator(0 * lambertian, nothing, CHANNELS.weight)
    )
    found = smooth_face(CHANNELS, 1.0, 1.5).lit_on(diffuser).above.kernel[0, EXACT, EXACT]
    # Of diffuse light, a face of index 1.5 reflects 59.6 % back inside.
    inside = 1 - (1 - 0.0918) / 1.5**2
    passed = 1 - fresnel(np.cos(np.deg2rad([0.0, 40.0])), 1.5)
    expected = np.outer(passed, passed) * albedo / np.pi / 1.5**2 / (1 - albedo * inside)
    np.testing.assert_allclose(found, expected, rtol=5e-4)


def test_channels_integrate_the_hemisphere_of_the_densest_medium():
    assert CHANNELS.weight.sum() == pytest.approx(np.pi * 1.5**2, rel=1e-12)
    kappa, share = CHANNELS.parts
    np.testing.assert_allclose(share.sum(axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(share @ kappa**2, CHANNELS.kappa**2, atol=0.03)


def test_a_series_of_azimuths_is_summed_back():
    azimuth = np.linspace(0, np.pi, 19)
    values = 1 + 0.5 * np.cos(azimuth) - 0.2 * np.cos(4 * azimuth)
    np.testing.assert_allclose(summed(series(values[:, None]), azimuth), values, rtol=1e-12)
