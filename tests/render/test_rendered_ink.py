"""The ink of a sample as a renderer takes it."""

import numpy as np

from jaxink.render import RenderedInk
from jaxink.sample import load_sample
from tests.render.inks import PRINTED

GAP = PRINTED + "[effects.air_gap]\nposition = 1\nshare = 0.5\n"


def test_an_effect_belongs_to_the_table_but_not_to_the_volume(ink, tmp_path):
    (tmp_path / "gap.toml").write_text(GAP, encoding="utf-8")
    sample = load_sample(tmp_path / "gap.toml")
    with_gap, alone = RenderedInk.of(sample), RenderedInk.of(sample, alone=True)
    assert with_gap.medium is None
    assert "air_gap" in with_gap.why_no_volume
    assert alone.identity == ink.identity != with_gap.identity
    assert np.allclose(alone.medium.scattering_per_mm, 400)


def test_the_plate_may_have_another_index(ink_file):
    other = RenderedInk.of(ink_file, plate_index=1.59)
    assert other.table.index_inside.tolist() == [1.59]
    assert other.medium.indices[0].tolist() == [1.59]
    assert other.medium.refractive_index.tolist() == [1.5]
