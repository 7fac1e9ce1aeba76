"""Numbers of a light guide."""

import numpy as np
import pytest

from jaxink.render import Effort, Guide, RenderedInk, render_guide
from jaxink.render.lightguide import GuideLight
from jaxink.sample import load_sample
from tests.render import inks

GUIDE = Guide()


def light(columns, wavelengths=(550.0,), noise=1e-3):
    """A light that is the same in all rows, with batches that scatter."""
    random, columns = np.random.default_rng(1), np.asarray(columns, float)
    cells = columns[None, None] * (1 + noise * random.normal(size=(6, GUIDE.rows, *columns.shape)))
    hemisphere = cells.mean(axis=(1, 2))
    return GuideLight("sheet", np.array(wavelengths), cells, hemisphere, cells.mean(axis=0), GUIDE)


def test_numbers_of_a_falling_luminance():
    falls = np.linspace(0.02, 0.01, GUIDE.columns)[:, None]
    found = light(falls)
    assert found.uniformity.value == pytest.approx(0.5, abs=3 * found.uniformity.error + 1e-3)
    assert 0.5 < found.nine_points.value < 1
    assert found.mean_luminance.value == pytest.approx(0.015, rel=1e-3)
    # All that leaves the face, over what arrives at the edge.
    areas = GUIDE.length_mm * GUIDE.width_mm / (GUIDE.width_mm * GUIDE.thickness_mm)
    assert found.efficiency.value == pytest.approx(0.015 * areas, rel=1e-3)
    assert found.colour_shift is None


def test_a_grey_guide_has_no_colour_shift_and_a_yellowing_one_has():
    wavelengths = 450.0, 500.0, 550.0, 600.0, 650.0
    grey = light(np.full((GUIDE.columns, 5), 0.01), wavelengths)
    assert np.all(np.abs(grey.colour_shift.value) < 4 * grey.colour_shift.error + 1e-9)
    blue = np.linspace(1, 0.8, GUIDE.columns)[:, None] ** np.array([1.0, 0.5, 0, 0, 0])
    yellow = light(0.01 * blue, wavelengths)
    assert np.all(yellow.colour_shift.value > 10 * yellow.colour_shift.error)
    assert yellow.chromaticity.value.shape == (GUIDE.columns, 2)


def test_a_rendering_with_its_uncorrected_model(ink, tmp_path):
    text = inks.PRINTED.replace("absorption_per_mm = 4", "absorption_per_mm = 40")
    (tmp_path / "dark.toml").write_text(text, encoding="utf-8")
    darker = RenderedInk.of(tmp_path / "dark.toml")
    effort = Effort(batches=3, paths=2, hemisphere_paths=1)
    found = render_guide(ink, tmp_path, None, darker, effort, with_volume=False)
    change, columns = found.relative("uncorrected", "sheet")
    assert change.value < -5 * change.error
    assert columns.value.shape == (GUIDE.columns,)
    assert found.relative("sheet", "volume") is None
    again = render_guide(ink, tmp_path, None, darker, effort, with_volume=False)
    assert again.to_dict() == found.to_dict()


def test_what_cannot_be_rendered_is_refused(tmp_path, refused):
    rough = inks.PRINTED + '[layers.back_roughness]\ndensity = "cauchy"\nsigma_deg = 5\n'
    (tmp_path / "rough.toml").write_text(rough, encoding="utf-8")
    with refused("rough"):
        RenderedInk.of(load_sample(tmp_path / "rough.toml"))
    with refused("paths"):
        Effort(paths=0)


def test_the_picture_is_small(ink, tmp_path):
    from jaxink.render.guide_figure import save_guide_figure

    effort = Effort(batches=2, paths=1, hemisphere_paths=1)
    found = render_guide(ink, tmp_path, effort=effort, with_volume=False)
    save_guide_figure(found, tmp_path / "guide.png")
    assert (tmp_path / "guide.png").stat().st_size < 150_000
