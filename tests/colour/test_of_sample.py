"""Spectra of a sample in geometries and arrangements."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.colour import Arrangement, Geometry, SampleSpectra, colours_at_points, read_card, read_illuminant
from jaxink.errors import InputRefusedError
from tests.samples import PRINTED_INK, edited

WAVES = (500.0, 550.0, 600.0)


@pytest.fixture(scope="module")
def sample():
    text = edited(
        PRINTED_INK,
        (
            "wavelength_nm = 550",
            "wavelength_nm = [500, 550, 600]",
            "value = 1 }",
            "value = [1, 3, 20], per_wavelength = true }",
            "scan_relative = 0.002",
            "scan_relative = 0.002\n[instrument]\ndetector_half_angle_deg = 1",
        ),
    )
    return jaxink.parse_sample(text)


@pytest.fixture(scope="module")
def spectra(sample):
    return SampleSpectra(sample, ["45:0", "T 0:20", "8:di"], WAVES)


def test_pairs_of_directions_are_those_of_the_forward_model(sample, spectra):
    ideal = dataclasses.replace(sample, detector_half_angle_deg=0.0)
    found = spectra.at()
    assert found.shape == (3, len(WAVES))
    front = jaxink.predict_at(ideal, 45.0, 0.0, 180.0, np.array(WAVES), "R").bsdf_per_sr
    behind = jaxink.predict_at(ideal, 0.0, 20.0, 180.0, np.array(WAVES), "T").bsdf_per_sr
    np.testing.assert_allclose(found[:2], np.pi * np.stack([front, behind]), rtol=2e-3)
    assert np.all(found[2] > found[0] * 0.5)


def test_slopes_are_those_of_differences(sample, spectra):
    names = ["ink.scattering_per_mm", "ink.absorption_per_mm@600", "ink.absorption_per_mm@500"]
    slopes = spectra.slopes(names)
    for name, slope in zip(names, slopes, strict=True):
        value, step = sample.parameters[name].value, 1e-3
        change = spectra.at({name: value + step}) - spectra.at({name: value - step})
        np.testing.assert_allclose(slope, change / (2 * step), rtol=1e-5, atol=1e-8)
    # Absorption at 600 nm changes nothing at 500 nm.
    assert np.all(slopes[1][:, 0] == 0)


def test_an_ink_of_no_thickness_shows_its_card(sample):
    bare = Arrangement(thickness_um=0.0, over=0.6, contact=True, free=True).of(sample)
    found = SampleSpectra(bare, ["45:0"], WAVES).at()
    # Lambert's card seen through a face of n = 1.5 at 45 and 0 degrees.
    internal, face = 0.5963, (1 - 0.0502) * (1 - 0.04)
    np.testing.assert_allclose(found, face * 0.6 / 1.5**2 / (1 - 0.6 * internal), rtol=2e-3)


def test_arrangements_change_what_they_say(sample):
    both = Arrangement(thickness_um=120.0, over={500.0: 0.1, 600.0: 0.3}, lit_from="back").of(sample)
    assert [layer.name for layer in both.layers] == ["ink", "plate"]
    assert both.parameters["ink.thickness_um"].value == 120
    assert both.parameters["backing.reflectance@550"].value == pytest.approx(0.2)
    assert Arrangement(over="nothing").of(both).backing is None
    assert [layer.name for layer in Arrangement(free=True).of(sample).layers] == ["ink"]


def test_thicker_ink_hides_the_card(sample):
    over = [SampleSpectra(Arrangement(over=r).of(sample), ["8:di"], WAVES) for r in (0.0, 0.8)]
    gaps = [np.ptp([one.at({"ink.thickness_um": t}) for one in over], axis=0) for t in (20.0, 200.0)]
    assert np.all(gaps[1] < gaps[0])
    assert np.all(gaps[0] > 0.01)


def test_measured_colours_of_a_perfect_fit_do_not_differ(sample):
    theta = np.array([20.0, 40.0, 60.0])
    data = jaxink.predict_at(sample, 0.0, theta[:, None], 90.0, np.array(WAVES), "R")
    same = colours_at_points(data, data.bsdf_per_sr)
    np.testing.assert_allclose(same.differences, 0, atol=1e-9)
    red = np.where(data.wavelength_nm == 600, 1.1, 1.0)
    assert np.all(colours_at_points(data, data.bsdf_per_sr * red).differences > 0.2)
    assert same.to_dict()["reflection"]["directions"] == 3


def test_files_of_spectra(tmp_path, told):
    lamp = tmp_path / "lamp.csv"
    lamp.write_text("wavelength_nm,power\n400,1\n700,3\n")
    assert read_illuminant(lamp).power.tolist() == [1, 3]
    card = tmp_path / "card.csv"
    card.write_text("wavelength_nm,reflectance\n400,0.1\n700,0.3\n")
    assert read_card(card) == {400.0: 0.1, 700.0: 0.3}
    for text, named in (
        ("wavelength_nm,energy\n400,1\n700,3\n", "power"),
        ("wavelength_nm,power\n400,1\n390,3\n", "row 3"),
        ("wavelength_nm,power\n400,1\n700,-3\n", "row 3"),
        ("wavelength_nm,power\n400,1\n", "one row"),
    ):
        lamp.write_text(text)
        with pytest.raises(InputRefusedError) as refused:
            read_illuminant(lamp)
        told(str(refused.value), "lamp.csv", named)


def test_wrong_geometries_and_arrangements(sample, told):
    for text, named in (("45/0", "45/0"), ("95:0", "95"), ("30:0:270", "270")):
        with pytest.raises(InputRefusedError) as refused:
            Geometry.of(text)
        told(str(refused.value), named)
    opaque = edited(PRINTED_INK, ("thickness_um = 60", 'thickness_um = "opaque"'))
    for wrong, named in (
        (lambda: Arrangement(over=1.2), "1.2"),
        (lambda: Arrangement(over="paper"), "paper"),
        (lambda: Arrangement(contact=True), "contact"),
        (lambda: Arrangement(lit_from="top"), "top"),
        (lambda: Arrangement(thickness_um=-1.0), "-1"),
        (lambda: Arrangement(thickness_um=1.0).of(jaxink.parse_sample(opaque)), "opaque"),
        (lambda: Arrangement(lit_from="back").of(jaxink.parse_sample(opaque)), "opaque"),
        (lambda: Arrangement(thickness_um=1.0, layer="plate").of(sample), "plate"),
        (lambda: Arrangement(over={550.0: 0.1}).of(sample), "550"),
        (lambda: SampleSpectra(sample, [], WAVES), "45:0"),
    ):
        with pytest.raises(InputRefusedError) as refused:
            wrong()
        told(str(refused.value), named)
