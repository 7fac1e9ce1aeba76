"""The strength of a smoothness by wavelengths that are held out."""

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.fitting.smoothness import choose_smoothness
from tests.samples import PRINTED_INK, edited

WAVES = (500, 520, 540, 560, 580)


def fitted(absorption, coarse, change=1.0):
    """A fit of simulated values with noise of 2 % for an absorption spectrum."""
    smooth = f"per_wavelength = true, smoothness = {{ change = {change}, over_nm = 20 }} }}"
    text = edited(
        PRINTED_INK,
        (
            "wavelength_nm = 550",
            f"wavelength_nm = {list(WAVES)}",
            "value = 1 }",
            f"value = 5, {smooth}",
            "scattering_per_mm = { free = true, min = 1, max = 500, value = 60 }",
            "scattering_per_mm = 60",
            "asymmetry_parameter = { free = true, min = -0.9, max = 0.95, value = 0.5 }",
            "asymmetry_parameter = 0.5",
            "relative = 0.005",
            "relative = 0.02",
        ),
    )
    sample = jaxink.parse_sample(text)
    truth = sample.replace({f"ink.absorption_per_mm@{w}": a for w, a in zip(WAVES, absorption, strict=True)})
    view = np.array([10.0, 25.0, 40.0])[:, None]
    data = jaxink.predict_at(truth, 0.0, view, None, np.array(WAVES, float), "R", accuracy=1e-2)
    noise = 0.02 * np.random.default_rng(8).standard_normal(len(data))
    data = data.replace(bsdf_per_sr=data.bsdf_per_sr * (1 + noise))
    return jaxink.fit(data, sample, jaxink.FitOptions(profile="none", config=coarse))


def test_a_straight_spectrum_is_smoothed(coarse):
    found = choose_smoothness(fitted((4.0, 4.5, 5.0, 5.5, 6.0), coarse), (0.3, 10.0))
    assert found.best == 0.3
    assert found.is_open
    assert found.sample.parameters["ink.absorption_per_mm@520"].smoothness.change == pytest.approx(0.3)
    assert len(found.card().tables[0].rows) == 2


def test_a_spectrum_with_steps_is_not(coarse):
    found = choose_smoothness(fitted((2.0, 2.0, 2.0, 20.0, 20.0), coarse), (0.03, 3.0))
    assert found.best == 3.0


def test_what_cannot_be_chosen(coarse, example_result, told):
    with pytest.raises(InputRefusedError) as refused:
        choose_smoothness(example_result)
    told(str(refused.value), "smoothness")
    with pytest.raises(InputRefusedError) as refused:
        choose_smoothness(example_result, (0.0, 1.0))
    told(str(refused.value), "above 0")
