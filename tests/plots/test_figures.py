"""What the figures show, read back from their artists."""

import dataclasses
import subprocess
import sys

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from jaxink.measurement import GonioData
from jaxink.plots import (
    comparison_figure,
    corner_figure,
    cut_figure,
    figures,
    lobe_figure,
    overview_figure,
    residual_map,
    save_figures,
)
from jaxink.plots.cuts import FITTED, MASKED, MEASURED
from jaxink.plots.scan_views import overview_words, scan_views
from jaxink.sample import ResidualWeight


def lines(axes, style):
    """Points of the lines of one style."""
    marker = style.get("marker", "None")
    found = [
        line.get_xydata()
        for line in axes.lines
        if line.get_color() == style["color"] and line.get_marker() == marker
    ]
    return np.concatenate(found)


def panels(figure, rows=2):
    """Axes by incidence: of values, logarithmic first if there are three rows, and of residuals."""
    return [figure.axes[i : i + rows] for i in range(0, len(figure.axes), rows)]


def texts(figure):
    return " ".join(t.get_text() for t in [*figure.texts, *(t for a in figure.axes for t in a.texts)])


def of_points(result):
    """Residual of each point in units of its own noise."""
    return (result.data.bsdf_per_sr[result.data.used] - result.predicted_per_sr) / result.sigma_per_sr


def with_residual(result, residual):
    """The result whose points lie so many standard deviations from the curve."""
    measured = result.predicted_per_sr + residual * result.sigma_per_sr
    return dataclasses.replace(result, data=result.data.replace(bsdf_per_sr=measured))


def scattered(result, directions, **changes):
    """The result with directions of view all over the hemisphere in the place of its own."""
    theta_i, theta_o, phi = map(np.concatenate, zip(*directions, strict=True))
    count = theta_i.size
    measured = 0.3 + 0.001 * np.arange(count)
    data = GonioData(
        theta_i, theta_o, phi, np.full(count, 550.0), np.zeros(count, bool), measured, source="ball.csv"
    )
    residual = np.linspace(-3.9, 3.9, count)
    return dataclasses.replace(
        result,
        data=data,
        predicted_per_sr=measured - 0.003 * residual,
        sigma_per_sr=np.full(count, 0.003),
        whitened=residual,
        sample=dataclasses.replace(result.sample, title=""),
        **changes,
    )


@pytest.fixture(scope="session")
def ball():
    """Directions of view out of the plane, and four in it, at two incidences."""
    phi = np.concatenate([np.tile([30.0, -60.0, 90.0, 135.0], 10), [0.0, 180.0, 179.5, -0.5]])
    theta_o = np.concatenate([np.repeat(np.linspace(5, 80, 10), 4), [10.0, 20.0, 30.0, 40.0]])
    return [(np.full(phi.size, theta_i), theta_o, phi) for theta_i in (0.0, 45.0)]


@pytest.fixture(scope="module")
def wide(example_result):
    """The same falling by two decades towards grazing."""
    data = example_result.data
    fall = 10 ** (-data.theta_o_deg / 45)
    return dataclasses.replace(
        example_result,
        data=data.replace(bsdf_per_sr=data.bsdf_per_sr * fall),
        predicted_per_sr=example_result.predicted_per_sr * fall,
        sigma_per_sr=example_result.sigma_per_sr * fall,
    )


def test_cuts_hold_the_measurement_the_fit_and_the_residual(wide):
    example_result = wide
    data, figure = example_result.data, cut_figure(example_result, 550.0, "R")
    assert len(figure.axes) == 15
    for theta_i, (log, linear, residual) in zip((0, 15, 30, 45, 60), panels(figure, 3), strict=True):
        here = (data.theta_i_deg == theta_i) & ~data.is_transmission
        # Negative on the source's side (phi 0), positive towards the peak (phi 180).
        signed = np.where(data.phi_deg[here] == 180, 1, -1) * data.theta_o_deg[here]
        order = np.argsort(signed, kind="stable")
        expected = np.column_stack([signed, data.bsdf_per_sr[here]])
        assert {tuple(p) for p in lines(log, MEASURED)} == {tuple(p) for p in expected}
        np.testing.assert_array_equal(lines(log, MEASURED), lines(linear, MEASURED))
        fitted = lines(linear, FITTED)
        fitted = fitted[np.isfinite(fitted[:, 0])]
        np.testing.assert_array_equal(
            fitted, np.column_stack([signed, example_result.predicted_per_sr[here]])[order]
        )
        shown = lines(residual, MEASURED)
        assert {tuple(p) for p in shown} <= {
            tuple(p) for p in np.column_stack([signed, of_points(example_result)[here]])
        }
        assert log.get_yscale() == "log"
        assert linear.get_yscale() == "linear"
        assert any(line.get_xdata()[0] == theta_i for line in log.lines)


def test_within_a_decade_there_is_no_logarithmic_panel(example_result, wide):
    for result, rows in ((example_result, 2), (wide, 3)):
        figure = cut_figure(result, 550.0, "R")
        assert len(figure.axes) == 5 * rows
        assert sum(axes.get_yscale() == "log" for axes in figure.axes) == 5 * (rows - 2)


def test_all_incidences_have_one_linear_scale(example_result, wide):
    for result, rows in ((example_result, 2), (wide, 3)):
        linear = [axes[rows - 2] for axes in panels(cut_figure(result, 550.0, "R"), rows)]
        (ends,) = {axes.get_ylim() for axes in linear}
        assert ends[0] == 0
        assert ends[1] > result.data.bsdf_per_sr[~result.data.is_transmission].max()


def test_a_residual_beyond_the_axis_is_explained(example_result):
    residual = np.sin(np.arange(len(example_result.data)))
    quiet = with_residual(example_result, residual)
    assert "beyond" not in legend_of(cut_figure(quiet, 550.0, "R"))
    residual[np.flatnonzero(~example_result.data.is_transmission)[7]] = 50.0
    figure = cut_figure(with_residual(example_result, residual), 550.0, "R")
    assert "beyond" in legend_of(figure)
    drawn = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "^"]
    assert sum(line.get_xdata().size for line in drawn) == 1


def legend_of(figure):
    return " ".join(text.get_text() for text in figure.legends[0].get_texts())


def test_line_is_broken_at_the_peak(example_result):
    axes = panels(cut_figure(example_result, 550.0, "T"))[2][0]
    fitted = lines(axes, FITTED)
    gap = np.flatnonzero(np.isnan(fitted[:, 0]))
    assert [(fitted[i - 1, 0], fitted[i + 1, 0]) for i in gap] == [(25.0, 35.0)]


def test_title_and_legend_say_what_is_drawn(example_result, told):
    figure = cut_figure(example_result, 550.0, "T")
    title = figure.texts[0].get_text()
    told(title, "SIMULATED", "550 nm", numbers=False)
    for entry in figure.legends[0].get_texts():
        told(entry.get_text())
    told(panels(figure)[0][1].get_ylabel(), "[σ]")


def test_real_data_are_not_called_simulated(example_result, ball, told):
    title = residual_map(scattered(example_result, ball), 550.0, "R").texts[0].get_text()
    assert "SIMULATED" not in told(title, "550 nm", numbers=False)


def test_masked_points_are_shown_but_not_fitted(example_result, told):
    data = example_result.data
    off = (data.theta_i_deg == 30) & ~data.is_transmission & (data.theta_o_deg > 80)
    masked = dataclasses.replace(
        example_result,
        data=data.with_masks(user=off),
        predicted_per_sr=example_result.predicted_per_sr[~off],
        sigma_per_sr=example_result.sigma_per_sr[~off],
        whitened=example_result.whitened[~off],
    )
    figure = cut_figure(masked, 550.0, "R")
    values = panels(figure)[2][0]
    assert sorted(lines(values, MASKED)[:, 0]) == [-85, -82.5, 82.5, 85]
    assert np.nanmax(lines(values, FITTED)[:, 0]) == 80
    told(" ".join(t.get_text() for t in figure.legends[0].get_texts()))


def test_maps_where_data_leave_the_plane(example_result, ball, refused, told):
    result = scattered(example_result, ball)
    # The drawn residuals are far beyond noise, so the shape is drawn, too.
    assert [name for name, _ in figures(result)] == ["residual_map_R_550nm", "residual_shape_R_550nm"]
    figure = residual_map(result, 550.0, "R")
    told(texts(figure), numbers=False)
    discs = [axes for axes in figure.axes if axes.name == "polar"]
    assert len(discs) == 2
    views = scan_views(result, 550.0, "R")
    scales = set()
    for axes, view in zip(discs, views, strict=True):
        up, down = axes.collections
        scales |= {up.get_clim(), down.get_clim()}
        drawn = np.concatenate([np.column_stack([c.get_offsets(), c.get_array()]) for c in (up, down)])
        expected = np.column_stack([np.deg2rad(view.phi_deg), view.theta_o_deg, view.residual])
        assert {tuple(row) for row in drawn} == {tuple(row) for row in expected}
        assert (np.asarray(up.get_array()) >= 0).all()
        assert (np.asarray(down.get_array()) < 0).all()
        # phi 0, the source, lies on the left, as in the cuts.
        assert axes.transData.transform((0.0, 60.0))[0] < axes.transData.transform((np.pi, 60.0))[0]
        assert (
            axes.transData.transform((np.pi / 2, 60.0))[1] > axes.transData.transform((-np.pi / 2, 60.0))[1]
        )
    assert scales == {(-4.0, 4.0)}
    with refused("residual_map"):
        cut_figure(result, 550.0, "R")


def test_a_scan_without_a_cut_says_so_on_the_page(example_result, ball, told):
    plane = (np.zeros(30), np.tile(np.linspace(5, 75, 15), 2), np.repeat([0.0, 180.0], 15))
    result = scattered(example_result, [plane, ball[1]])
    names = [name for name, _ in figures(result)]
    assert names == ["cuts_R_550nm", "residual_map_R_550nm", "residual_shape_R_550nm"]
    told(texts(cut_figure(result, 550.0, "R")), "4 of 44", numbers=False)


def test_unknown_noise_gives_residuals_in_per_cent(example_result, told):
    data = example_result.data
    result = dataclasses.replace(example_result, whitened=None)
    residual = panels(cut_figure(result, 550.0, "R"))[0][1]
    told(residual.get_ylabel(), "[%]")
    here = (data.theta_i_deg == 0) & ~data.is_transmission
    expected = 100 * (data.bsdf_per_sr / result.predicted_per_sr - 1)[here]
    np.testing.assert_allclose(np.sort(lines(residual, MEASURED)[:, 1]), np.sort(expected), rtol=1e-12)


def test_a_factor_of_a_scan_is_drawn_where_the_points_are(example_result):
    # All points of a scan 2.3 % above the curve: a factor of the scan explains most of that to the noise, but
    # the residual below must be the distance that the eye sees above.
    data, noise = example_result.data, {**example_result.noise, "scan_relative": 0.0034}
    here = (data.theta_i_deg == 45) & ~data.is_transmission
    predicted = np.where(here, data.bsdf_per_sr / 1.023, data.bsdf_per_sr)
    result = dataclasses.replace(
        example_result,
        predicted_per_sr=predicted,
        sigma_per_sr=predicted * 0.023 / 4.4,
        whitened=np.where(here, 0.08, 0.0),
        noise=noise,
    )
    (view,) = [v for v in scan_views(result, 550.0, "R") if v.theta_i_deg == 45]
    np.testing.assert_allclose(view.residual, 4.4, rtol=1e-9)
    drawn = lines(overview_figure(result).axes[1], {**MEASURED, "color": "#c22f2f"})[:, 1]
    np.testing.assert_allclose(drawn, 4.4, rtol=1e-9)
    assert "standard deviation 0.34 %, is part of the noise and not removed here" in overview_words(result)
    plain = dataclasses.replace(result, noise={**noise, "scan_relative": 0.0})
    assert "factor" not in overview_words(plain)


def test_corner_holds_the_covariance(example_result):
    figure, found = corner_figure(example_result), example_result.covariance
    assert len(figure.axes) == 6
    # Second row, first column: absorption over scattering; the outer ellipse is two standard deviations.
    axes = figure.axes[1]
    outer = max(
        (line.get_xydata() for line in axes.lines), key=lambda xy: np.ptp(xy[:, 0]) * np.ptp(xy[:, 1])
    )
    errors = np.sqrt(np.diag(found.matrix))
    np.testing.assert_allclose(np.ptp(outer, axis=0), 4 * errors[:2], rtol=1e-3)
    centre = [example_result[name].value for name in found.names[:2]]
    np.testing.assert_allclose((outer.max(axis=0) + outer.min(axis=0)) / 2, centre, rtol=1e-6)
    assert axes.get_ylabel() == "ink\nabsorption_per_mm\n[1/mm]"


def test_corner_of_samples_draws_them(example_result, refused):
    names = example_result.covariance.names[:2]
    values = {name: example_result[name].value * np.linspace(0.99, 1.01, 50) for name in names}
    figure = corner_figure(example_result, names, values)
    assert len(figure.axes) == 3
    dots = next(line for line in figure.axes[1].lines if line.get_marker() == ".")
    np.testing.assert_array_equal(dots.get_xdata(), values[names[0]])
    with refused("ink.haze"):
        corner_figure(example_result, ["ink.haze"])
    with refused(names[1]):
        corner_figure(example_result, names, {names[0]: values[names[0]]})


def test_corner_marks_the_truth_and_reaches_beyond_it(example_result, refused):
    names = example_result.covariance.names[:2]
    value, error = (getattr(example_result[names[0]], name) for name in ("value", "standard_error"))
    truth = {names[0]: value + 8 * error}
    figure = corner_figure(example_result, names, truth=truth)
    for axes in (figure.axes[0], figure.axes[1]):
        marked = [line for line in axes.lines if line.get_color() == "black"]
        assert [set(line.get_xdata()) for line in marked] == [{truth[names[0]]}]
        assert axes.get_xlim()[1] > truth[names[0]]
    assert not [line for line in figure.axes[2].lines if line.get_color() == "black"]
    with refused("ink.haze"):
        corner_figure(example_result, names, truth={"ink.haze": 1.0})


def test_comparison_draws_each_fit_and_its_residuals(example_result, ball, refused):
    other = dataclasses.replace(
        example_result,
        predicted_per_sr=1.1 * example_result.predicted_per_sr,
        sigma_per_sr=0.5 * example_result.sigma_per_sr,
    )
    figure = comparison_figure({"Mie": example_result, "HG": other}, 550.0, "R")
    values, first, second = panels(figure, 3)[0]
    data = example_result.data
    here = (data.theta_i_deg == 0) & ~data.is_transmission
    drawn = [np.sort(line.get_ydata()) for line in values.lines if line.get_linewidth() in (1.2, 1.3)]
    predicted = np.sort(example_result.predicted_per_sr[here])
    assert {round(float(np.nanmax(y) / predicted[-1]), 6) for y in drawn} == {1.0, 1.1}
    assert first.get_ylabel() == "Mie [σ]"
    assert second.get_ylabel() == "HG [σ]"
    for axes, result in ((first, example_result), (second, other)):
        np.testing.assert_allclose(
            np.sort(lines(axes, MEASURED)[:, 1]), np.sort(of_points(result)[here]), rtol=1e-12
        )
    assert first.get_ylim() == second.get_ylim()
    with refused("ball"):
        comparison_figure({"Mie": example_result, "ball": scattered(example_result, ball)}, 550.0, "R")
    with refused("results"):
        comparison_figure({"Mie": example_result}, 550.0, "R")
    # A list names its fits by their methods, as in the figure of the progress.
    _, first, second = panels(comparison_figure([example_result, other], 550.0, "R"), 3)[0]
    assert (first.get_ylabel(), second.get_ylabel()) == ("gradient [σ]", "gradient 2 [σ]")


def test_title_has_the_chi_square_that_was_minimised(example_result, told):
    weighed = dataclasses.replace(example_result.sample, weights=(ResidualWeight(0.0, side="R"),))
    result = dataclasses.replace(example_result, sample=weighed)
    side_t = example_result.data.is_transmission[example_result.data.used]
    freedom = side_t.sum() - 3
    expected = np.sum(example_result.whitened[side_t] ** 2) / freedom
    told(texts(cut_figure(result, 550.0, "T")), f"weighted reduced χ² {expected:.4g}")


def test_lobes_are_those_in_the_plane(example_result, refused):
    data = example_result.data
    (axes,) = lobe_figure(example_result, 550.0, "R").axes
    shown = [line.get_xydata() for line in axes.lines if line.get_marker() == MEASURED["marker"]]
    assert len(shown) == 5
    here = (data.theta_i_deg == 30) & ~data.is_transmission
    signed = np.deg2rad(np.where(data.phi_deg[here] == 180, 1, -1) * data.theta_o_deg[here])
    expected = {tuple(p) for p in np.column_stack([signed, data.bsdf_per_sr[here]])}
    assert {tuple(p) for p in shown[2]} == expected
    with refused("633"):
        lobe_figure(example_result, 633.0, "R")


def test_many_incidences_share_pages_of_equal_bands(example_result):
    plane = np.tile(np.linspace(5, 75, 8), 2), np.repeat([0.0, 180.0], 8)
    result = scattered(example_result, [(np.full(16, theta), *plane) for theta in range(0, 77, 7)])
    figure = cut_figure(result, 550.0, "R")
    places = [axes[0].get_position() for axes in panels(figure)]
    assert len(places) == 11
    assert len({round(p.x0, 6) for p in places}) == 4
    assert len({round(p.y0, 6) for p in places}) == 3
    for i, one in enumerate(figure.axes):
        for other in figure.axes[:i]:
            assert not one.get_position().overlaps(other.get_position())


def test_nothing_on_a_page_overlaps_or_leaves_it(example_result):
    figure = cut_figure(example_result, 550.0, "R")
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    boxes = [t.get_window_extent(renderer) for t in figure.texts]
    boxes += [axes.get_tightbbox(renderer) for axes in figure.axes]
    boxes += [legend.get_window_extent(renderer) for legend in figure.legends]
    for i, box in enumerate(boxes):
        assert figure.bbox.x0 <= box.x0
        assert figure.bbox.y0 <= box.y0
        assert box.x1 <= figure.bbox.x1
        assert box.y1 <= figure.bbox.y1
        for other in boxes[:i]:
            # Tick labels at the ends may touch the neighbour's frame by a pixel or two.
            width = min(box.x1, other.x1) - max(box.x0, other.x0)
            height = min(box.y1, other.y1) - max(box.y0, other.y0)
            assert min(width, height) < 3


def test_unknown_scans_and_formats_are_refused(example_result, tmp_path, refused):
    with refused("R", 600, "T", 550):
        cut_figure(example_result, 600.0, "R")
    with refused("bmp", "png", "pdf", "svg"):
        save_figures(example_result, tmp_path / "figures", ("bmp",))
    assert list(tmp_path.iterdir()) == []


def test_style_of_the_session_stays(example_result):
    with matplotlib.rc_context({"axes.facecolor": "black", "lines.linewidth": 9}):
        before = dict(matplotlib.rcParams)
        figure = cut_figure(example_result, 550.0, "R")
        assert dict(matplotlib.rcParams) == before
        assert figure.axes[0].get_facecolor() == (1, 1, 1, 1)
        assert figure._repr_png_().startswith(b"\x89PNG")


def test_pyplot_is_not_loaded(example_result, tmp_path):
    example_result.save(tmp_path)
    program = (
        "import sys, jaxink, jaxink.plots; jaxink.plots.save_figures(jaxink.load_result('.'), 'f', ['png']); "
        "sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    assert (
        subprocess.run([sys.executable, "-c", program], cwd=tmp_path, timeout=60, check=False).returncode == 0
    )
    assert sorted(p.name for p in (tmp_path / "f").iterdir()) == ["cuts_R_550nm.png", "cuts_T_550nm.png"]


def test_repeated_directions_do_not_break_the_line(example_result):
    plane = np.tile(np.linspace(5, 75, 15), 4), np.repeat([0.0, 180.0, 0.0, 180.0], 15)
    result = scattered(example_result, [(np.full(60, 20.0), *plane)])
    fitted = lines(panels(cut_figure(result, 550.0, "R"))[0][0], FITTED)
    assert not np.isnan(fitted).any()
