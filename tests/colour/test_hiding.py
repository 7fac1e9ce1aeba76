"""Drawdowns, and the two fluxes of Kubelka and Munk."""

import numpy as np
import pytest

import jaxink
from jaxink.colour import Arrangement, SampleSpectra, drawdown, two_flux, two_flux_errors
from jaxink.colour.kubelka_munk import saunderson
from jaxink.errors import InputRefusedError
from jaxink.plots import drawdown_figure
from tests.samples import PRINTED_INK, edited

WAVES = (500.0, 600.0)


@pytest.fixture(scope="module")
def sample():
    several = ("wavelength_nm = 550", "wavelength_nm = [500, 600]")
    value = ("value = 1 }", "value = [1, 20], per_wavelength = true }")
    # Light that is scattered evenly stays diffuse, as two fluxes take it.
    return jaxink.parse_sample(edited(PRINTED_INK, (*several, *value, "value = 0.5", "value = 0")))


@pytest.fixture(scope="module")
def drawn(sample):
    return drawdown(sample, WAVES, [5.0, 20.0, 80.0, 320.0])


def test_ink_hides_as_it_thickens(drawn):
    assert np.all(np.diff(drawn.contrast_ratio) > 0)
    assert np.all(np.diff(drawn.difference) < 0)
    assert drawn.contrast_ratio[-1] > 0.999
    assert len(drawn.card().tables[0].rows) == 4
    assert drawn.to_dict()["cards"] == [0.01, 0.8]


def test_the_figure_shows_both_cards_at_each_thickness(drawn):
    figure = drawdown_figure(drawn)
    swatches, lab, ratio = figure.axes
    assert len(swatches.patches) == 2 * len(drawn.thickness_um)
    assert len(lab.lines) == 6
    np.testing.assert_allclose(ratio.lines[0].get_ydata(), drawn.contrast_ratio)
    assert figure.png().startswith(b"\x89PNG")


def test_thickness_for_a_contrast_ratio_has_it(sample, drawn):
    found = drawn.thickness_for(0.9)
    np.testing.assert_allclose(drawdown(sample, WAVES, [found, 300.0]).contrast_ratio[0], 0.9, rtol=1e-4)
    assert drawn.thickness_for(1.0, "CIEDE2000") > found


def test_thicknesses_that_cannot_be(sample, drawn, told):
    for wrong, named in (
        (lambda: drawn.thickness_for(0.01), "below"),
        (lambda: drawn.thickness_for(1.01), "above"),
        (lambda: drawn.thickness_for(0.5, "L"), "L"),
        (lambda: drawdown(sample, WAVES, [20.0, 5.0]), "ascending"),
    ):
        with pytest.raises(InputRefusedError) as refused:
            wrong()
        told(str(refused.value), named)


def test_faces_are_those_of_the_books():
    # n = 1.5: 0.0401 near the normal; 0.596 for diffuse light from inside (Saunderson 1942).
    outside, inside = saunderson(np.array([1.5]))
    assert outside[0] == pytest.approx(0.0400, abs=2e-4)
    assert inside[0] == pytest.approx(0.5963, abs=3e-4)


def test_two_fluxes_are_exact_for_what_they_are_derived_from(sample):
    found = two_flux(sample, WAVES)
    assert found.wavelength_nm.tolist() == [500, 600]
    # K near 2 mu_a where little is absorbed, S near 3/4 mu_s (Gate 1974 Appl. Opt. 13, 236).
    assert found.absorption_per_mm[0] == pytest.approx(2.0, rel=0.1)
    assert found.scattering_per_mm[0] == pytest.approx(45.0, rel=0.1)
    own = found.inside(60.0, 0.0)
    angles = np.rad2deg(np.arcsin(np.sqrt((1 + np.polynomial.legendre.leggauss(8)[0]) / 2)))
    assert len(angles) == 8
    assert np.all((own > 0) & (own < 1))
    # Without absorption and without a card, a layer of path S d reflects S d / (1 + S d).
    thin = found.inside(1e-3, 0.0)
    np.testing.assert_allclose(thin, found.scattering_per_mm * 1e-6, rtol=1e-3)


def test_two_fluxes_err_by_what_the_model_knows_better(sample):
    found = two_flux(sample, WAVES)
    (white,) = two_flux_errors(sample, found, [60.0], [0.8])
    assert white.model.shape == (2,)
    # Collimated light is not diffuse: a few per cent where little is absorbed, more where much is.
    relative = np.abs(white.two_flux / white.model - 1)
    assert relative[0] < 0.1
    assert white.largest == pytest.approx(relative.max())
    free = Arrangement(thickness_um=60.0, over=0.8, contact=True, free=True).of(sample)
    np.testing.assert_allclose(SampleSpectra(free, ["8:di"], WAVES).at()[0], white.model, rtol=1e-6)
