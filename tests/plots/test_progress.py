"""Progress of searches: what is drawn is what was kept."""

import dataclasses

import numpy as np
import pytest

import jaxink
import jaxink.plots
from jaxink.data import simulated_example
from jaxink.plots.progress import way_of


@pytest.fixture(scope="module")
def scanned(coarse):
    data, sample = simulated_example()
    sample = jaxink.load_sample(sample)
    table = sample.parameters.replace("ink.asymmetry_parameter", multimodal=True)
    options = jaxink.FitOptions(config=coarse, profile="all")
    return jaxink.fit(jaxink.read(data), dataclasses.replace(sample, parameters=table), options)


def test_way_counts_the_scan_first_and_no_profiles(scanned):
    way = way_of(scanned)
    scan = next(search for search in scanned.searches if search.method == "scan")
    counted = [search for search in scanned.searches if search.method != "profile"]
    assert way[0, 2] == scan.loss_start
    assert way[-1, 2] == min(search.loss for search in counted)
    assert way[-1, 0] == pytest.approx(sum(search.run_seconds for search in counted))
    assert way[-1, 1] == sum(search.jacobians for search in counted)
    assert np.all(np.diff(way[:, 0]) >= 0)
    assert np.all(np.diff(way[:-1, 2]) < 0)


def test_figure_draws_each_fit_twice_from_a_saved_result_as_well(scanned, tmp_path):
    saved = jaxink.load_result(scanned.save(tmp_path / "out"))
    page = jaxink.plots.progress_figure({"first": scanned, "second": saved})
    for column, axes in enumerate(page.axes):
        first, _, second, _ = axes.get_lines()
        way = way_of(scanned)
        assert np.array_equal(first.get_xdata(), way[:, column])
        assert np.array_equal(first.get_ydata(), way[:, 2])
        assert np.allclose(second.get_ydata(), way[:, 2])
    assert [text.get_text() for text in page.legends[0].get_texts()] == ["first", "second"]


def test_methods_name_several_fits(scanned):
    page = jaxink.plots.progress_figure([scanned, scanned])
    assert [text.get_text() for text in page.legends[0].get_texts()] == ["gradient", "gradient 2"]


def test_a_fit_without_a_path_is_refused(scanned, refused):
    searches = tuple(dataclasses.replace(search, path=None) for search in scanned.searches)
    with refused("path"):
        jaxink.plots.progress_figure(dataclasses.replace(scanned, searches=searches))


def test_nothing_to_draw_is_refused(refused):
    with refused("fit"):
        jaxink.plots.progress_figure([])


@pytest.mark.parametrize("count", [2, 12])
def test_the_legend_is_whole_and_beside_nothing(scanned, count):
    page = jaxink.plots.progress_figure([scanned] * count)
    page.draw_without_rendering()
    (legend,) = page.legends
    assert len(legend.get_texts()) == count
    box = legend.get_window_extent()
    assert box.x0 >= 0
    assert box.y0 >= 0
    assert box.x1 <= page.bbox.x1
    top = max(text.get_window_extent().y1 for text in legend.get_texts())
    assert all(top <= axes.xaxis.label.get_window_extent().y0 for axes in page.axes)
    # Each fit can be told from the others.
    looks = [(line.get_color(), line.get_linestyle()) for line in legend.get_lines()]
    assert len(set(looks)) == count
