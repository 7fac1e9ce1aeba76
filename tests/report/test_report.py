"""The report of a diagnosis and its command, on one small simulated measurement with stray light."""

import base64
import dataclasses
import json
import pickle
import re
import shlex

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.data import simulated_example
from jaxink.diagnosis import Omission, OptionalTask, TimeLimit, Verdict, VerdictCode, read_report
from jaxink.diagnosis.findings.candidates import inner_of_refit
from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.statistics.candidate import ScreenedCandidate, Testability
from jaxink.effects import Effect, declare
from jaxink.effects.geometry import Pinholes, UndeclaredBacking
from jaxink.effects.instrument import Blur, StrayLight
from jaxink.effects.kinds import Inapplicable
from jaxink.effects.surfaces import AirGap
from jaxink.effects.volume import SecondLobe
from jaxink.fitting.outcome import Outcome
from jaxink.ink.comparison import compare_tables
from jaxink.plots.cuts import BEFORE, FITTED, MEASURED
from jaxink.plots.diagnosis_pages import FROM_INSIDE, diagnosis_figures, drawn_wavelengths
from jaxink.report import next_steps, sections, write_report
from jaxink.report.html import tables
from jaxink.report.ink_table import inside_change, is_in_table
from tests.report.page_reader import Page
from tests.samples import STRAY_PER_SR, TRUTH

DATA, SAMPLE = map(str, simulated_example())
FILES = ("parameters.csv", "result.json", "result.nc", "sample.toml")
RESULTS = [f"{model}/{name}" for model in ("corrected", "declared") for name in FILES]
ALWAYS = [*RESULTS, "report.html", "report.json", "sample.toml"]
INSIDE = ["inside_corrected.nc", "inside_declared.nc"]


def test_it_names_the_stray_light(found):
    assert (found.verdict.code, found.verdict.effects) == (VerdictCode.INSTRUMENT, ("stray_light",))
    (step,) = found.steps
    assert abs(step.strength - STRAY_PER_SR) < 3 * step.standard_error
    for name, truth in TRUTH.items():
        value, error = found.parameters_after[name]
        assert abs(value - truth) < 3 * error
        assert abs(found.parameters_before[name].value - truth) > 3 * error


def test_files_and_one_page_without_a_network(found, written):
    folder, files = written
    names = ["candidates", "cuts_R_550nm", "cuts_T_550nm", "inside_550nm", "residuals_550nm"]
    names.append("residuals_after_550nm")
    expected = {folder / name for name in ALWAYS} | {folder / name for name in INSIDE}
    expected |= {folder / "figures" / f"{name}.png" for name in names}
    assert len(files) == len(expected)
    assert set(files) == expected == {p for p in folder.rglob("*") if p.is_file()}
    assert json.loads((folder / "report.json").read_text()) == found.to_dict()
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "http" not in text
    assert "url(" not in text
    page = Page(text)
    embedded = {base64.b64decode(i["src"].removeprefix("data:image/png;base64,")) for i in page.images}
    drawn = {(folder / "figures" / f"{name}.png").read_bytes() for name in names}
    assert embedded > drawn
    # Besides, one picture of measurement and model.
    assert len(page.images) == len(embedded) == len(drawn) + 1
    assert all(image["alt"] for image in page.images)


def test_page_says_everything(found, written, told):
    text = (written[0] / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert "Simulated: &lt;ink&gt; &amp; plate" in text
    told(page.words, numbers=False)
    for text in (
        "The measurement is SIMULATED",
        found.verdict.sentence,
        "small.csv: 84 of 84 points used, 6 scans, 550 nm",
        "0.2 %",
        "polydispersity",
        "seed 77",
        f"jax {found.declared.versions['jax']}",
        "stray_light",
    ):
        assert text in page.words, text
    # The verdict comes before all numbers.
    assert page.words.index(found.verdict.sentence) < page.words.index(page.tables[0][0][0])


def test_numbers_of_the_page_are_those_of_the_diagnosis(found, change, written):
    page = Page((written[0] / "report.html").read_text(encoding="utf-8"))
    states = [
        (figures, np.sqrt(np.mean((found.measured_per_sr / predicted - 1) ** 2)))
        for s in (found.before, found.after)
        for figures, predicted in ((s.fitted, s.predicted_per_sr), (s.held_out, s.held_out_per_sr))
    ]
    assert page.tables[0][0][4] == "rms of measured / model - 1"
    for row, (figures, rms) in zip(page.tables[0][1:], states, strict=True):
        assert float(row[2]) == pytest.approx(figures.rmsd_absolute, rel=1e-3)
        assert float(row[4].removesuffix(" %")) == pytest.approx(100 * rms, rel=5e-3)
        assert float(row[5]) == pytest.approx(figures.chi_square, rel=1e-5)
        assert int(row[6]) == figures.degrees_of_freedom
    biased = {p["name"]: p["bias_in_standard_errors"] for p in found.to_dict()["parameters"]}
    rows = {row[0]: row for row in page.table("ink.scattering_per_mm")[1:]}
    assert list(rows) == [*TRUTH, "stray_light.level_per_sr"]
    for name in TRUTH:
        assert float(rows[name][5]) == pytest.approx(biased[name], rel=5e-3)
        before, after = found.parameters_before[name].value, found.parameters_after[name].value
        assert float(rows[name][4].removesuffix(" %")) == pytest.approx(100 * (before / after - 1), rel=5e-3)
    (step,) = page.table(StrayLight.statement)[1:]
    assert step[1:3] == ["stray_light", StrayLight.statement]
    for last in ("strength", "detection limit"):
        (candidates,) = (table for table in page.tables if table[0][0] == "effect" and last in table[0])
        assert [row[0] for row in candidates[1:]] == [row.effect for row in found.candidates]
    for row, component in zip(page.table(f"R_II, {FROM_INSIDE['R_II']}")[1:], FROM_INSIDE, strict=True):
        assert float(row[2].removesuffix(" %")) == pytest.approx(change.of(component).rms_percent, rel=5e-3)


def test_verdict_then_next_commands_then_details(found, written):
    page = Page((written[0] / "report.html").read_text(encoding="utf-8"))
    places = [page.words.index(text) for text in (found.verdict.sentence, "jaxink predict", "Details")]
    assert places == sorted(places)
    assert f"jaxink fit small.csv --sample {written[0] / 'sample.toml'}" in page.words
    assert page.links == []


def test_it_prints_upright_without_split_tables(written):
    text = (written[0] / "report.html").read_text(encoding="utf-8")
    (style,) = re.findall("<style>(.*?)</style>", text, re.DOTALL)
    assert "size: A4 portrait" in style
    (table,) = re.findall(r"^table \{.*?\}", style, re.DOTALL | re.MULTILINE)
    assert "break-inside: avoid" in table
    assert max(map(len, Page(text).tables)) <= 21
    assert max(len(table[0]) for table in Page(text).tables) <= 9


def test_a_long_table_is_divided_with_its_heads():
    shown = tables(["a", "b"], ([str(i), "x"] for i in range(45)))
    parts = Page(shown).tables
    assert [len(part) for part in parts] == [21, 21, 6]
    assert all(part[0] == ["a", "b"] for part in parts)
    assert [row[0] for part in parts for row in part[1:]] == [str(i) for i in range(45)]


@pytest.mark.parametrize(
    ("code", "commands"),
    [
        (VerdictCode.INSTRUMENT, ["fit", "predict", "export"]),
        (VerdictCode.PARTLY_EXPLAINED, ["diagnose", "fit", "predict", "export"]),
        (VerdictCode.INPUT_MISTAKE, ["diagnose"]),
        (VerdictCode.NOT_TESTABLE, []),
    ],
)
def test_next_commands_follow_the_verdict(found, code, commands):
    judged = dataclasses.replace(found, verdict=Verdict(code, (), "A sentence."))
    todo = next_steps(judged, "a report", ["R.csv", "T.csv", "--side", "R"])
    typed = [shlex.split(step.command) for step in todo if step.command]
    assert [words[1] for words in typed] == commands
    for words in typed:
        assert words[0] == "jaxink"
        if words[1] in ("fit", "diagnose"):
            assert words[2:6] == ["R.csv", "T.csv", "--side", "R"]
        else:
            assert words[2] == "a report"


def test_nothing_is_said_or_drawn_twice_where_nothing_was_added(unchanged, tmp_path, told):
    files = write_report(unchanged, tmp_path)
    assert sorted(p.stem for p in files if p.suffix == ".png") == [
        "candidates",
        "cuts_R_550nm",
        "cuts_T_550nm",
        "residuals_550nm",
    ]
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    told(page.words, numbers=False)
    assert len(page.tables[0]) == 3
    plates = {plate.name: plate for plate in diagnosis_figures(unchanged)}
    assert len(plates["residuals_550nm"].figure.axes) == 2 + 1
    assert len(plates["cuts_R_550nm"].figure.axes) == 3 * 2
    told(plates["residuals_550nm"].caption, numbers=False)


def test_one_name_for_each_model_on_the_page_and_its_figures(found, written):
    folder = written[0]
    words = Page((folder / "report.html").read_text(encoding="utf-8"))
    heads = [cell for table in words.tables for cell in table[0]]
    for text in (words.words, " ".join(heads), found.summary(), *(one.caption for one in _figures(found))):
        assert not re.search(r"\b(before|after|extended|as declared)\b", text), text
    for one in _figures(found):
        drawn = [t.get_text() for t in one.figure.texts] + [a.get_title() for a in one.figure.axes]
        drawn += [a.get_ylabel() for a in one.figure.axes]
        drawn += [t.get_text() for legend in one.figure.legends for t in legend.get_texts()]
        assert not re.search(r"\b(before|after|extended|as declared)\b", " ".join(drawn))
    assert {"declared", "corrected"} <= {row[0] for row in words.tables[0]}


def _figures(found):
    return [one for one in diagnosis_figures(found) if one.name.startswith(("residuals", "cuts"))]


def test_masked_points_are_listed_with_their_reasons(found):
    data = found.declared.data
    assert sections.masked(data) is None
    off = data.theta_o_deg > 80
    shown = sections.masked(data.with_masks(user=off))
    assert shown.title == "Masked points"
    assert f"{off.sum()} of {len(data)} points are masked as user" in shown.content


def test_effects_that_do_not_apply_are_not_said_to_lack_data():
    found = sections.untested(
        {"ink_absorption": Inapplicable("already a free parameter"), "opposition": "no point is near"}
    )
    assert found == {
        "These effects do not apply to the sample as it is declared:": [
            "ink_absorption: already a free parameter"
        ],
        "The data do not constrain these effects:": ["opposition: no point is near"],
    }


def test_a_report_that_is_read_back_tells_apart_what_does_not_apply(found, tmp_path):
    known = dataclasses.replace(
        found,
        not_testable={"ink_absorption": Inapplicable("already free"), "opposition": "no point is near"},
    )
    known.save(tmp_path)
    again = sections.untested(read_report(tmp_path)["not_testable"])
    assert again == sections.untested(known.not_testable)
    assert len(again) == 2


def test_a_diagnosis_travels_between_processes(found):
    again = pickle.loads(pickle.dumps(found))
    assert again.to_dict() == found.to_dict()
    assert again.verdict == found.verdict
    np.testing.assert_array_equal(again.corrected.whitened, found.corrected.whitened)


def test_a_strength_and_its_detection_limit_are_of_one_term():
    # Blur: the screen found the variance of the core, the refit the share of the wings.
    forms = [Blur(False), Blur(True), Blur(True)]
    directions = [Direction(form, {}, np.zeros(1), 1.0) for form in forms]
    screened = ScreenedCandidate(
        "blur", Testability.TESTABLE, 0.1, np.array([1.0, 3.0, 2.0]), inner=0, critical_z=4.0
    )
    assert inner_of_refit(screened, directions, Blur(True)) == 2
    assert inner_of_refit(screened, directions, Blur(False)) == 0
    assert Blur(True).strength.unit != Blur(False).strength.unit


def test_the_order_of_rows_is_not_called_time(found):
    factor = next(f for f in found.location.factors if f.name == "time")
    assert all(level.endswith("quarter of the rows") for level in factor.levels)
    table = Page(sections.tests(found).content).table("order of rows")
    assert not any(row[0] == "time" for row in table)


def of_points(found, summary):
    """Residual of each point in units of its own noise."""
    return (found.measured_per_sr - summary.predicted_per_sr) / found.declared.sigma_per_sr


def panel(figure, title):
    return next(axes for axes in figure.axes if axes.get_title() == title)


def test_strips_hold_the_residuals_on_one_scale(found, plates, told):
    data, figure = found.declared.data, plates["residuals_550nm"]
    scales = set()
    for side, is_t in (("reflection", False), ("transmission", True)):
        for state, summary in (("declared", found.before), ("corrected", found.after)):
            (cells,) = panel(figure, f"{side}, {state}").collections
            np.testing.assert_array_equal(
                cells.get_array(), of_points(found, summary)[data.is_transmission == is_t]
            )
            scales.add(cells.get_clim())
            signed = np.where(data.phi_deg < 90, -1, 1)[data.is_transmission == is_t]
            centre = np.array([path.vertices[:4, 0].mean() for path in cells.get_paths()])
            assert (np.sign(centre)[np.abs(centre) > 5] == signed[np.abs(centre) > 5]).all()
    assert len(scales) == 1
    told(figure.texts[0].get_text(), "SIMULATED measurement", "550 nm", numbers=False)


def test_repeated_directions_share_a_strip(found):
    data = found.declared.data
    theta = np.where(data.theta_o_deg == 80, 70.0, data.theta_o_deg)
    twice = dataclasses.replace(
        found, declared=dataclasses.replace(found.declared, data=data.replace(theta_o_deg=theta))
    )
    figure = next(diagnosis_figures(twice)).figure
    cells = [p.vertices[:4] for p in panel(figure, "reflection, declared").collections[0].get_paths()]
    heights = sorted({round(float(np.ptp(cell[:, 1])), 3) for cell in cells})
    assert heights == [0.43, 0.86]
    boxes = {tuple(np.round([*cell.min(axis=0), *cell.max(axis=0)], 6)) for cell in cells}
    assert len(boxes) == len(cells)


def test_cuts_show_both_models_and_both_residuals(found, plates):
    data, figure = found.declared.data, plates["cuts_T_550nm"]
    here = data.is_transmission & (data.theta_i_deg == 35)
    # The second incidence; the values span less than a decade.
    linear, before, after, enlarged = figure.axes[4:8]
    signed = np.where(data.phi_deg < 90, -1, 1) * data.theta_o_deg
    for axes, summary in ((before, found.before), (after, found.after)):
        shown = next(line for line in axes.lines if line.get_marker() == MEASURED["marker"])
        expected = np.column_stack([signed, of_points(found, summary)])[here]
        assert {tuple(p) for p in shown.get_xydata()} == {
            tuple(p) for p in expected if abs(p[1]) <= axes.get_ylim()[1]
        }
    assert before.get_ylim() == after.get_ylim() == plates["cuts_R_550nm"].axes[1].get_ylim()
    # After the correction also on its own scale.
    top = np.abs(of_points(found, found.after)).max()
    assert top <= enlarged.get_ylim()[1] < max(2 * top, 3.1) < before.get_ylim()[1]
    own = next(line for line in enlarged.lines if line.get_marker() == MEASURED["marker"])
    assert own.get_xydata().shape[0] == here.sum()
    for style, summary in ((BEFORE, found.before), (FITTED, found.after)):
        curve = next(line for line in linear.lines if line.get_color() == style["color"]).get_ydata()
        np.testing.assert_array_equal(
            np.sort(curve[np.isfinite(curve)]), np.sort(summary.predicted_per_sr[here])
        )
    assert linear.get_ylim()[0] == 0


def test_bars_are_the_falls_of_chi_square(found, plates):
    axes = plates["candidates"].axes[0]
    assert axes.get_xscale() == "log"
    falls = sorted(
        fall
        for row in found.candidates
        for fall in (row.predicted_delta_chi_square, row.refit_delta_chi_square)
        if (fall or 0) > 1
    )
    ends = sorted(bar.get_x() + bar.get_width() for bar in axes.patches)
    assert [end for end in ends if end > 1] == pytest.approx(falls, rel=1e-12)
    (bold,) = (t.get_text() for t in axes.get_yticklabels() if t.get_fontweight() == "bold")
    assert bold == "stray_light"


def test_inside_panels_hold_both_tables_and_their_ratio(change, plates):
    above, below = plates["inside_550nm"].axes[2:4]
    first, second = (line.get_xydata() for line in above.lines)
    for curve, table in ((first, change.before), (second, change.after)):
        view = curve[:, 0]
        expected = table.interpolated("R_II", 30.0, np.abs(view), np.where(view < 0, 0.0, 180.0))
        np.testing.assert_allclose(curve[:, 1], expected, rtol=1e-12)
    ratio = next(line for line in below.lines if len(line.get_xdata()) > 2).get_ydata()
    np.testing.assert_allclose(ratio, 100 * (second[:, 1] / first[:, 1] - 1), atol=1e-9)


def test_data_out_of_the_plane_give_discs(found, told):
    data = found.declared.data
    turned = data.replace(phi_deg=np.where(data.is_transmission, data.phi_deg, data.phi_deg - 40))
    out = dataclasses.replace(found, declared=dataclasses.replace(found.declared, data=turned))
    plates = {plate.name: plate.figure for plate in diagnosis_figures(out)}
    of_residuals = ["residuals_550nm", "residual_discs_R_550nm"]
    enlarged = ["residuals_after_550nm", "residual_discs_after_R_550nm"]
    assert sorted(plates) == sorted([*of_residuals, *enlarged, "cuts_T_550nm", "candidates"])
    # After the correction on a scale of their own.
    for whole, alone in zip(of_residuals, enlarged, strict=True):
        limits = [plates[name].axes[0].collections[0].get_clim()[1] for name in (whole, alone)]
        assert limits[1] < limits[0] / 1.5
    titles = [axes.get_title() for axes in plates["residual_discs_R_550nm"].axes[:6]]
    told(titles[0], "declared", "14°: 14 ")
    told(titles[1], "corrected", "14°: 14 ")
    drawn = plates["residual_discs_R_550nm"].axes[1].collections
    shown = np.sort(np.concatenate([np.asarray(c.get_array()) for c in drawn]))
    here = ~data.is_transmission & (data.theta_i_deg == 14)
    np.testing.assert_array_equal(shown, np.sort(of_points(found, found.after)[here]))


def test_of_many_wavelengths_the_worst_are_drawn(found, told):
    data = found.declared.data
    wavelength = 500.0 + data.theta_i_deg + 100 * data.is_transmission
    many = dataclasses.replace(
        found, declared=dataclasses.replace(found.declared, data=data.replace(wavelength_nm=wavelength))
    )
    misfit = {w: np.mean(found.before.whitened[wavelength == w] ** 2) for w in np.unique(wavelength)}
    worst = sorted(misfit, key=misfit.get)[-3:]
    assert drawn_wavelengths(many) == tuple(sorted(worst))
    plates = list(diagnosis_figures(many))
    assert sum(plate.name.startswith("cuts") for plate in plates) == 3
    assert plates[0].name == "spectrum"
    told(plates[1].caption, "6", "3", numbers=False)


def test_nothing_on_a_page_overlaps_or_leaves_it(plates):
    for name, figure in plates.items():
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        boxes = [t.get_window_extent(renderer) for t in figure.texts]
        boxes += [axes.get_tightbbox(renderer) for axes in figure.axes]
        boxes += [legend.get_window_extent(renderer) for legend in figure.legends]
        for i, box in enumerate(boxes):
            assert figure.bbox.x0 <= box.x0, name
            assert figure.bbox.y0 <= box.y0, name
            assert box.x1 <= figure.bbox.x1, name
            assert box.y1 <= figure.bbox.y1, name
            for other in boxes[:i]:
                width = min(box.x1, other.x1) - max(box.x0, other.x0)
                height = min(box.y1, other.y1) - max(box.y0, other.y0)
                assert min(width, height) < 3, name


def test_the_same_sample_changes_nothing_and_absorption_darkens(change):
    for component in FROM_INSIDE:
        same = dataclasses.replace(change, after=change.before).of(component)
        assert (same.rms_percent, same.largest_percent) == (0, 0)
    # Stray light hides absorption: with it found, the ink absorbs more, and every direction gets less.
    assert -20 < change.of("R_II").largest_percent < 0
    assert abs(change.of("T_IA").largest_percent) >= change.of("T_IA").rms_percent > 1


def test_a_new_layer_belongs_to_the_ink(found, coarse, monkeypatch):
    from jaxink.effects.sample_edits import with_film

    monkeypatch.setattr("jaxink.model.forward.model_sizes", lambda *_: coarse)
    sample = found.declared.sample
    change = compare_tables(sample, with_film(sample, 1, "gap", 1.0), [550.0])
    # Light in the plate meets the gap: totally reflected beyond the critical angle of 41.8 degrees.
    assert change.after.index_inside[0] == change.before.index_inside[0] == 1.5
    beyond = (change.after.theta_deg > 43) & (change.after.theta_deg < 85)
    np.testing.assert_allclose(change.after.regular[0, 0, beyond], 1, rtol=1e-6)
    assert (change.before.regular[0, 0, beyond] < 0.5).all()


def test_what_cannot_be_tabulated_is_said(found, told):
    sample = found.declared.sample
    alone = dataclasses.replace(sample, layers=sample.layers[1:])
    fit = dataclasses.replace(found.declared, sample=alone)
    case = dataclasses.replace(found, declared=fit, corrected=fit)
    sentence = inside_change(case)
    told(sentence)


@pytest.mark.parametrize(
    ("effect", "inside"),
    [
        (StrayLight(), False),
        (SecondLobe("ink"), True),
        (AirGap(1), True),
        (Pinholes(), True),
        (UndeclaredBacking(), False),
    ],
    ids=lambda value: value.name if isinstance(value, Effect) else "",
)
def test_which_effects_a_table_holds(effect, inside, found):
    sample = declare(found.declared.sample, (effect,), {})
    assert is_in_table(effect, sample) == inside


@pytest.fixture
def run(monkeypatch, found, change):
    """Run the command; what it computes is replaced."""
    given = []

    def diagnosed(*arguments, unfinished):
        given.append(arguments)
        unfinished.begin(found.declared)
        if run.outcome is None:
            raise KeyboardInterrupt
        return run.outcome

    monkeypatch.setattr(jaxink, "diagnose", diagnosed, raising=False)
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    monkeypatch.setattr("jaxink.report.writing.inside_change", lambda _: change)

    def run(out, *more, data=DATA):
        return CliRunner().invoke(
            app, ["diagnose", data, "--sample", SAMPLE, "--out", str(out), *map(str, more)]
        )

    run.outcome, run.given = found, given
    return run


def names_in(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def with_code(found, code):
    return dataclasses.replace(found, verdict=Verdict(code, (), f"It is {code}."))


def test_an_interrupted_diagnosis_goes_on_and_cleans_up(run, found, tmp_path, told):
    out = tmp_path / "out"
    run.outcome = None
    done = run(out, "--no-figures")
    assert done.exit_code == 130
    told(done.stderr, "--resume")
    assert (out / "unfinished").is_dir()
    limit = TimeLimit(1.0, 2.0, (Omission(OptionalTask.LIMIT, ("gain",)),))
    run.outcome = dataclasses.replace(found, time_limit=limit)
    done = run(out, "--no-figures", "--resume", "--time-limit", "1")
    told(done.stderr.splitlines()[0], "unfinished")
    assert run.given[-1][2].time_limit_s == 1
    told(done.stdout[done.stdout.index("Not done") :].split("\n\n")[0], "gain")
    # What is missing can still be done.
    assert (out / "unfinished").is_dir()
    run.outcome = found
    assert run(out, "--no-figures", "--resume", "--quiet").exit_code == 0
    assert names_in(out) == sorted([*ALWAYS, *INSIDE])


@pytest.mark.parametrize("code", VerdictCode)
def test_exit_code_of_each_verdict(code, run, found, tmp_path):
    run.outcome = with_code(found, code)
    done = run(tmp_path / "out", "--no-figures", "--quiet")
    assert (done.stdout, done.stderr) == ("", "")
    unexplained = ("PARTLY_EXPLAINED", "UNEXPLAINED_STRUCTURE", "IMITATED", "INPUT_MISTAKE")
    left = 6 if code is VerdictCode.UNFINISHED else 0
    assert done.exit_code == (3 if code.name in unexplained else left)
    assert names_in(tmp_path / "out") == sorted([*ALWAYS, *INSIDE])
    assert f"It is {code}." in (tmp_path / "out" / "report.html").read_text()


def test_fit_that_did_not_converge_goes_first(run, found, tmp_path, told):
    stalled = dataclasses.replace(found.declared, outcome=Outcome.STALLED)
    run.outcome = dataclasses.replace(with_code(found, VerdictCode.PARTLY_EXPLAINED), declared=stalled)
    done = run(tmp_path / "out", "--no-figures")
    assert done.exit_code == 4
    told(done.stdout, numbers=False)
    told(Page((tmp_path / "out" / "report.html").read_text()).words, numbers=False)


def test_command_prints_tables_and_writes_the_report(run, found, tmp_path, told):
    out = tmp_path / "out"
    done = run(out, "--max-effects", 2, "--level", 0.1, "--bootstrap", 300, "--seed", 5, "--accuracy", 1e-3)
    assert (done.exit_code, done.stderr) == (0, "")
    words = " ".join(done.stdout.split())
    told(words.replace(str(tmp_path), ""), found.verdict.sentence, numbers=False)
    assert all(str(path) in done.stdout for path in out.rglob("*") if path.is_file())
    assert re.search(r"Stray light adds 0\.00\d+ \+- [\d.]+ 1/sr to the BSDF", done.stdout)
    options = run.given[0][2]
    assert (options.max_effects, options.level, options.n_bootstrap, options.seed) == (2, 0.1, 300, 5)
    assert options.fit.accuracy == 1e-3


def test_json_is_the_file(run, tmp_path):
    done = run(tmp_path / "out", "--json", "--no-figures")
    assert json.loads(done.stdout) == json.loads((tmp_path / "out" / "report.json").read_text())


def test_a_second_report_takes_the_place_of_the_first(run, tmp_path):
    out = tmp_path / "out"
    run(out, "--quiet")
    assert (out / "figures" / "candidates.png").exists()
    (out / "notes.txt").write_text("mine")
    run(out, "--quiet", "--no-figures")
    assert names_in(out) == sorted([*ALWAYS, *INSIDE, "notes.txt"])
    assert "<img" not in (out / "report.html").read_text()
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(
    ("data", "options", "named"),
    [
        ("none.csv", (), "none.csv: "),
        (DATA, ("--level", "0.9"), "level"),
        (DATA, ("--bootstrap", "20"), "n_bootstrap"),
        (DATA, ("--max-effects", "-1"), "max_effects"),
        (DATA, ("--accuracy", "2"), "accuracy"),
    ],
    ids=["data", "level", "bootstrap", "effects", "accuracy"],
)
def test_bad_input_is_one_sentence_and_writes_nothing(data, options, named, run, tmp_path, told):
    done = run(tmp_path / "out", *options, data=data)
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, "jaxink: ", named)
    assert done.stderr.count("\n") == 1
    assert run.given == []
    assert list(tmp_path.iterdir()) == []


def test_failed_writing_leaves_nothing(run, tmp_path, monkeypatch, told):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("jaxink.files.writing.os.rename", full)
    done = run(tmp_path / "out", "--no-figures")
    assert done.exit_code == 5
    told(done.stderr, f"jaxink: {tmp_path / 'out'}: ", "No space left on device")
    # No part of the result; what was computed is kept for --resume.
    assert list(tmp_path.iterdir()) == [tmp_path / "out"]
    assert list((tmp_path / "out").iterdir()) == [tmp_path / "out" / "unfinished"]
