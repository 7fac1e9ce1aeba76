"""Diffuse reflectance of a measured BRDF."""

import numpy as np
import pytest

import jaxink
from jaxink.colour import Geometry, SampleSpectra
from jaxink.errors import InputRefusedError
from jaxink.measurement.reflectance_of_bsdf import diffuse_reflectance
from tests.samples import PRINTED_INK, edited


def lambertian(reflectance):
    theta_i, theta_o = (grid.ravel() for grid in np.meshgrid([0.0, 40.0], np.arange(0, 86, 5.0)))
    phi = np.tile([0.0, 180.0], theta_i.size // 2)
    flat = np.full(theta_i.size, reflectance / np.pi)
    side = np.zeros(theta_i.size, bool)
    return jaxink.GonioData(theta_i, theta_o, phi, np.full(theta_i.size, 550.0), side, flat)


def test_a_diffuser_reflects_its_reflectance():
    found = diffuse_reflectance(lambertian(0.6))
    np.testing.assert_allclose(found.value, [0.6], rtol=1e-9)
    assert found.incidences == 2
    # k = -lambda ln K_d / (4 pi d)
    k = found.absorption_index(2.0)
    np.testing.assert_allclose(np.exp(-4 * np.pi * k * 2000 / 550), [0.6], rtol=1e-9)


def test_scans_of_one_plane_give_the_total_within_four_per_cent():
    text = edited(PRINTED_INK, ("wavelength_nm = 550", "wavelength_nm = [500, 600]"))
    text = edited(text, ("value = 1 }", "value = [1, 20], per_wavelength = true }"))
    sample, waves = jaxink.parse_sample(text), np.array([500.0, 600.0])
    incidences = np.array([0.0, 15, 30, 45, 60])[:, None, None]
    view = np.arange(-85.0, 86, 2.5)[:, None]
    found = diffuse_reflectance(jaxink.predict_at(sample, incidences, view, None, waves, "R"))
    nodes, weights = np.polynomial.legendre.leggauss(8)
    angles = np.rad2deg(np.arcsin(np.sqrt((1 + nodes) / 2)))
    at = [Geometry("x", "R_diffuse", float(angle), np.nan, np.nan) for angle in angles]
    total = weights / 2 @ SampleSpectra(sample, at, waves).at()
    # Beyond 60 degrees of incidence and 85 of view, where nothing was read, the true values fall to 0.
    np.testing.assert_allclose(found.value, total, rtol=0.04)
    assert np.all(found.value > total)
    assert found.scattering_shape.mean() == pytest.approx(1)


def test_what_has_no_diffuse_reflectance(told):
    data = lambertian(0.6)
    with pytest.raises(InputRefusedError) as refused:
        diffuse_reflectance(data.replace(is_transmission=np.ones(len(data), bool)))
    told(str(refused.value), "reflection")
    with pytest.raises(InputRefusedError) as refused:
        diffuse_reflectance(lambertian(1.2)).absorption_index(1.0)
    told(str(refused.value), "550")
