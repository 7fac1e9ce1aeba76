"""The light guide: its pattern, and what it refuses."""

import numpy as np
import pytest

from jaxink.render import Guide


def test_pattern_covers_what_it_states():
    guide = Guide()
    assert guide.n_dots >= 200
    random = np.random.default_rng(1)
    x, y = guide.length_mm * random.random(400_000), guide.width_mm * random.random(400_000)
    assert guide.is_printed(x, y).mean() == pytest.approx(guide.coverage, abs=0.003)
    # Every column has its own radius, and dots are in the middle of their cells.
    for k, radius in enumerate(guide.radii_mm):
        middle = np.array([guide.columns_mm[k]] * 2)
        assert guide.is_printed(middle + [0.99 * radius, 1.01 * radius], np.full(2, 2.5)).tolist() == [
            True,
            False,
        ]


def test_a_point_is_in_the_cell_of_its_dot():
    guide = Guide()
    middle, radius = guide.dot_at(np.array([[0.1, 0.1, 0.0], [99.9, 59.9, 0.0], [12.4, 7.6, 0.0]]))
    assert middle.tolist() == [[2.5, 2.5, 0.0], [97.5, 57.5, 0.0], [12.5, 7.5, 0.0]]
    assert radius.tolist() == [guide.radii_mm[0], guide.radii_mm[-1], guide.radii_mm[2]]


def test_clear_is_the_face_without_its_dots():
    guide = Guide()
    x, y = np.array([0.1, 2.5, -0.1, 100.1]), np.array([0.1, 2.5, 3.0, 3.0])
    assert guide.is_clear(x, y).tolist() == [True, False, False, False]


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"columns": 10}, "120 dots"),
        ({"last_radius_mm": 2.6}, "2.6 mm"),
        ({"first_radius_mm": 0.0}, "0 to"),
        ({"edge_reflectance": 1.2}, "1.2"),
    ],
)
def test_impossible_guides_are_refused(changes, named, refused):
    with refused(named):
        Guide(**changes)
