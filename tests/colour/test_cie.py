"""Colours against published numbers, and of bands."""

import subprocess
import sys

import numpy as np
import pytest

from jaxink.colour import Colour, Illuminant, Viewing
from jaxink.colour.cie import difference
from jaxink.errors import InputRefusedError

NM = np.arange(360.0, 781.0, 10.0)


@pytest.mark.parametrize(
    ("illuminant", "observer", "white"),
    # ASTM E308, table 5: tristimulus values of the perfect diffuser.
    [
        ("D65", 2, (95.047, 100, 108.883)),
        ("D65", 10, (94.811, 100, 107.304)),
        ("D50", 2, (96.422, 100, 82.521)),
        ("A", 2, (109.850, 100, 35.585)),
        ("E", 2, (100, 100, 100)),
    ],
)
def test_white_is_that_of_the_cie(illuminant, observer, white):
    np.testing.assert_allclose(Viewing.of(NM, illuminant, observer).white, white, atol=0.05)


def test_published_pairs_of_ciede2000():
    # Sharma, Wu, Dalal 2005 Color Res. Appl. 30, 21, table 1, pairs 1, 7, 17 and 25.
    one = [[50, 2.6772, -79.7751], [50, 0, 0], [50, 2.5, 0], [60.2574, -34.0099, 36.2677]]
    other = [[50, 0, -82.7485], [50, -1, 2], [73, 25, -18], [60.4626, -34.1751, 39.4387]]
    found = difference(np.array(one), np.array(other))
    np.testing.assert_allclose(found, [2.0425, 2.3669, 27.1492, 1.2644], atol=1e-4)


def test_grey_is_neutral_in_any_band():
    for low, high in ((360, 780), (400, 700), (570, 630)):
        wave = np.arange(low, high + 1, 10.0)
        grey = Colour("grey", Viewing.of(wave), np.full(len(wave), 0.184187))
        np.testing.assert_allclose(grey.lab, [50, 0, 0], atol=1e-4)
        assert grey.luminance_factor == pytest.approx(0.184187)
        assert grey.display_code == "#777777"


def test_a_band_has_the_light_of_that_band_only():
    wave = np.arange(570.0, 631.0, 10.0)
    viewing = Viewing.of(wave, "E", 2)
    assert viewing.range_nm == (570, 630)
    assert viewing.white[1] == pytest.approx(100)
    # Light of 570 to 630 nm has no blue.
    assert viewing.white[2] < 1
    assert "570 to 630 nm only" in viewing.sentence


def test_standard_errors_are_the_spread_of_noisy_spectra():
    viewing = Viewing.of(NM)
    spectrum = 0.3 + 0.2 * np.sin(NM / 60)
    covariance = 4e-6 * (np.eye(len(NM)) + 0.5)
    errors = Colour("x", viewing, spectrum, covariance).standard_errors
    draws = np.random.default_rng(5).multivariate_normal(spectrum, covariance, 4000)
    found = [list(Colour("x", viewing, one).values.values()) for one in draws]
    np.testing.assert_allclose(np.std(found, axis=0), list(errors.values()), rtol=0.05)


def test_an_illuminant_of_ones_own():
    flat = Illuminant("lamp", np.array([300.0, 900.0]), np.array([2.0, 2.0]))
    own, equal = Viewing.of(NM, flat), Viewing.of(NM, "E")
    np.testing.assert_allclose(own.weights, equal.weights, rtol=1e-12)


def test_what_has_no_colour(told):
    with pytest.raises(InputRefusedError) as refused:
        Viewing.of(np.array([550.0, 900.0]))
    told(str(refused.value), "550", "360 to 780")
    with pytest.raises(InputRefusedError) as refused:
        Viewing.of(np.arange(600.0, 701.0, 10.0), observer_deg=10)
    told(str(refused.value), "600 to 700")
    with pytest.raises(InputRefusedError) as refused:
        Viewing.of(NM, "D64")
    told(str(refused.value), "D64", "D65")
    with pytest.raises(InputRefusedError) as refused:
        Viewing.of(NM, observer_deg=5)
    told(str(refused.value), "5", "2 or 10")
    with pytest.raises(InputRefusedError) as refused:
        Viewing.of(NM, Illuminant("lamp", np.array([400.0, 700.0]), np.ones(2)))
    told(str(refused.value), "lamp", "400", "780")
    with pytest.raises(InputRefusedError) as refused:
        Colour("soot", Viewing.of(NM), np.zeros(len(NM)))
    told(str(refused.value), "soot")
    one, other = (Colour("x", Viewing.of(NM, name), np.ones(len(NM))) for name in ("D65", "A"))
    with pytest.raises(InputRefusedError) as refused:
        one.difference(other)
    told(str(refused.value), "D65", "A")


def test_numpy_writes_numbers_as_before():
    """The import of colour-science sets print options for the whole process."""
    code = (
        "import numpy as np; before = np.get_printoptions(); "
        "from jaxink.colour.cie import science; science(); "
        "assert np.get_printoptions() == before; print(repr(float(str(np.float64(0.1) + 0.2))))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "0.30000000000000004"
