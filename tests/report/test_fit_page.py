"""The page of a fit: verdict, layers, five numbers, one picture, and details that open on a click."""

import base64
import dataclasses
import re

import numpy as np
import pytest

import jaxink
from jaxink.cli.fit_tables import console, show_mistakes, worst_scans
from jaxink.data import simulated_example
from jaxink.fitting.mistake import Mistake
from jaxink.fitting.outcome import Outcome
from jaxink.numerics.digits import with_uncertainty
from jaxink.plots import overview_figure, spectrum_figure
from jaxink.plots.scan_views import scan_views
from jaxink.plots.spectra import quantities
from jaxink.report import fit_next_steps, write_fit_page
from jaxink.report.fit_html import fit_page, five_numbers
from jaxink.report.html import figure
from jaxink.report.layer_sketch import layer_sketch, layer_sketches, layer_words
from tests.report.page_reader import Page
from tests.samples import PRINTED_INK


@pytest.fixture(scope="module")
def misfit(example_result):
    """The same with a model that is wrong by many standard deviations."""
    whitened = example_result.whitened + 8 * np.cos(np.arange(example_result.whitened.size) / 40)
    merit = dataclasses.replace(example_result.merit, reduced_chi_square=30.0)
    return dataclasses.replace(example_result, whitened=whitened, merit=merit)


@pytest.fixture(scope="module")
def coloured(example_result):
    """Seven wavelengths: optical properties fall with the wavelength, the residual is worst at 600 nm."""
    data = example_result.data
    wave = 570.0 + 10 * (np.arange(len(data)) % 7)
    derived = tuple(
        dataclasses.replace(d, wavelength_nm=nm, value=d.value * 570 / nm)
        for d in example_result.derived
        for nm in np.unique(wave).tolist()
    )
    factor = np.where(wave == 600, 1.3, 0.8)
    whitened = factor * example_result.whitened
    return dataclasses.replace(
        example_result, data=data.replace(wavelength_nm=wave), derived=derived, whitened=whitened
    )


@pytest.fixture(scope="module")
def written(example_result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fit")
    return folder, write_fit_page(example_result, folder, inputs=["R.csv", "T.csv"])


def test_one_page_holds_everything_and_needs_no_network(example_result, written, told):
    folder, files = written
    names = {file.relative_to(folder).as_posix() for file in files}
    assert names == {"report.html", "figures/cuts_R_550nm.png", "figures/cuts_T_550nm.png"}
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "http" not in text
    assert "url(" not in text
    page = Page(text)
    told(page.words, numbers=False)
    embedded = [base64.b64decode(i["src"].removeprefix("data:image/png;base64,")) for i in page.images]
    # One picture, and the scans among the details.
    assert embedded[1:] == [(folder / name).read_bytes() for name in sorted(names - {"report.html"})]
    assert text.index("<img") < text.index("<details")
    assert all(image["alt"] for image in page.images)
    for place in (example_result.verdict.sentence, "jaxink predict", "Details"):
        assert place in page.words
    places = [page.words.index(t) for t in (example_result.verdict.sentence, "jaxink predict", "Details")]
    assert places == sorted(places)
    # Every table is a detail.
    assert text.index("<table") > text.index("<details")


def test_the_five_numbers_are_those_of_the_fit(example_result, misfit):
    numbers = five_numbers(example_result)
    assert len(numbers) == 5
    assert float(numbers[0][0]) == pytest.approx(example_result.merit.reduced_chi_square, rel=1e-3)
    assert float(numbers[1][0].removesuffix(" %")) == pytest.approx(
        100 * example_result.deviation.rms, rel=5e-3
    )
    ink = {d.quantity: d for d in example_result.derived}
    for (value, what), quantity in zip(
        numbers[2:], ("scattering_per_mm", "absorption_per_mm", "asymmetry_parameter"), strict=True
    ):
        assert what.endswith("of ink")
        shown = float(re.sub(r"\(\d+\).*", "", value))
        assert shown == pytest.approx(ink[quantity].value, abs=ink[quantity].standard_error)
    # Of a misfit, values have no standard errors.
    assert not any("(" in value for value, _ in five_numbers(misfit))


def test_a_misfit_says_so_and_what_to_do(misfit, tmp_path):
    todo = fit_next_steps(misfit, tmp_path, ["R.csv"], "ink.toml")
    assert [step.command.split()[:5] for step in todo] == [
        ["jaxink", "diagnose", "R.csv", "--sample", "ink.toml"]
    ]
    text = fit_page(misfit, {}, todo)
    assert 'class="verdict"' in text
    assert "verdict good" not in text
    assert misfit.verdict.sentence in Page(text).words
    named = Mistake("swapped", "The sides read as if swapped", "swap them", 1.0, 9.0, is_named=True)
    wrong = dataclasses.replace(misfit, mistakes=(named,))
    assert [step.command.split()[1] for step in fit_next_steps(wrong, tmp_path, ["R.csv"])] == ["fit"]


def test_points_that_were_left_out_are_listed_with_their_reasons(coarse, example_result):
    assert "Masked points" not in Page(fit_page(example_result, {})).words
    files, sample = simulated_example()
    data = jaxink.read(files)
    off = data.theta_o_deg > 80
    result = jaxink.fit(data.with_masks(user=off), sample, jaxink.FitOptions(config=coarse))
    words = Page(fit_page(result, {})).words
    assert f"{off.sum()} of {len(data)} points are masked as user" in words


def test_a_search_that_a_limit_ended_goes_on(example_result, tmp_path):
    ended = dataclasses.replace(example_result, outcome=Outcome.MAX_STEPS)
    (step,) = fit_next_steps(ended, tmp_path / "out", ["R.csv"], "ink.toml")
    assert step.command.split()[1:] == [
        *("fit", "R.csv", "--sample", str(tmp_path / "out"), "--out", f"{tmp_path / 'out'}-continued")
    ]


def test_a_measurement_above_the_model_deviates_by_a_positive_amount(example_result):
    # Every value 2.8 % above the model, as the residual below the curves shows it, too.
    measured = 1.028 * example_result.predicted_per_sr
    result = dataclasses.replace(example_result, data=example_result.data.replace(bsdf_per_sr=measured))
    assert example_result.deviation != result.deviation
    assert all(view.residual[0] > 0 for view in scan_views(result, 550.0, "R"))
    table = Page(fit_page(result, {})).table("+2.80 %")
    heads = ["rms of measured / model - 1", "mean of measured / model - 1"]
    assert table[0][-2:] == heads
    assert {tuple(row[-2:]) for row in table[1:]} == {("2.80 %", "+2.80 %")}
    shown = worst_scans(result).columns[-2:]
    assert [list(column.cells) for column in shown] == [[cell] * len(result.scans) for cell in table[1][-2:]]
    assert [" ".join(str(column.header).split()) for column in shown] == heads
    assert ("rms of measured / model - 1", "2.8 %") in [tuple(row) for row in result.card().tables[1].rows]


def test_rejected_mistakes_are_a_table_without_instructions(misfit, capsys):
    tried = Mistake(
        "divided_by_cosine",
        "The values read like BSDF / cos(theta_o)",
        "multiply bsdf_per_sr by cos(theta_o)",
        1.63e4,
        -1e7,
        is_named=False,
    )
    turned = Mistake(
        "phi_turned", "The azimuth reads as if it were turned", "add 180 degrees", 95.5, -1e4, is_named=False
    )
    result = dataclasses.replace(misfit, mistakes=(turned, tried))
    page = Page(fit_page(result, {}))
    cells = " ".join(cell for row in page.table("The azimuth is turned") for cell in row)
    show_mistakes(console(), result)
    for words in (page.words + cells, " ".join(capsys.readouterr().out.split())):
        assert "Tried and rejected" in words
        assert "The values are BSDF / cos(theta_o)" in words
        assert "The azimuth is turned" in words
        assert "16300" in words or "1.63e+04" in words
        assert "None of them explains the misfit" in words
        for instruction in ("If so", "multiply", "add 180", "read like", "reads as if"):
            assert instruction not in words
    named = dataclasses.replace(turned, is_named=True, reduced_chi_square=1.0)
    words = Page(fit_page(dataclasses.replace(misfit, mistakes=(named, tried)), {})).words
    assert "add 180 degrees" in words
    assert "multiply" not in words
    assert "None of them" not in words


def test_a_figure_that_fails_is_named_on_the_page(example_result, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("jaxink.plots.overview._scale", lambda *_: 1 / 0)
    write_fit_page(example_result, tmp_path)
    (sentence,) = [record.getMessage() for record in caplog.records]
    assert "overview" in sentence
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert sentence in page.words
    assert len(page.images) == 2


def test_without_figures_there_is_still_a_page(example_result, tmp_path):
    (file,) = write_fit_page(example_result, tmp_path, formats=())
    assert Page(file.read_text(encoding="utf-8")).images == []


def test_the_sketch_has_each_layer_with_its_numbers(told):
    sample = jaxink.parse_sample(PRINTED_INK)
    words = [layer_words(sample, layer) for layer in sample.layers]
    assert words[0] == "clear, n = 1.5, 1 mm"
    told(words[1], "1.5", "60 µm")
    drawn = layer_sketch(sample)
    assert drawn.count("<rect") == 2
    assert drawn.index(">plate<") < drawn.index(">ink<")
    heights = [float(y) for y in re.findall(r'<rect x="\d+" y="(\d+)"', drawn)]
    assert heights == sorted(heights)
    backed = PRINTED_INK + "\n[backing]\nreflectance = 0.85\n"
    told(" ".join(re.findall(r">([^<]+)<", layer_sketch(jaxink.parse_sample(backed)))), "0.85")


def test_different_samples_of_one_project_have_a_sketch_each():
    thin = jaxink.parse_sample(PRINTED_INK)
    thick = thin.replace({"ink.thickness_um": 120.0})
    assert layer_sketches({"a": thin, "b": thin}) == layer_sketch(thin)
    drawn = layer_sketches({"a": thin, "b": thick, "c": thin})
    assert drawn.count("<svg") == 2
    assert "<p>a, c</p>" in drawn
    assert drawn.index("<p>b</p>") < drawn.index("120 µm")


def test_figures_keep_their_proportions_on_a_printed_page(example_result):
    png = overview_figure(example_result).png()
    wide, tall = (int.from_bytes(png[at : at + 4]) for at in (16, 20))
    shown = float(re.search(r"width: ([\d.]+)in", figure(png, "a"))[1])
    assert shown == pytest.approx(wide / 130, abs=0.01)
    # A high one becomes smaller as a whole; the style gives it no height of its own.
    high = png[:20] + (10 * tall).to_bytes(4) + png[24:]
    shown = float(re.search(r"width: ([\d.]+)in", figure(high, "a"))[1])
    assert shown * 10 * tall / wide == pytest.approx(8.8, abs=0.1)
    assert "max-height" not in fit_page(example_result, {})


def test_of_many_wavelengths_there_is_a_spectrum_and_the_worst_scans(coloured, tmp_path, refused):
    files = write_fit_page(coloured, tmp_path)
    names = [file.stem for file in files if file.suffix == ".png"]
    assert "spectrum" in names
    scans = {name.rpartition("_")[2] for name in names if name != "spectrum"}
    assert len(scans) == 3
    assert "600nm" in scans
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "at 600 nm, the worst of 7" in page.words
    assert "the 3 of 7 wavelengths" in page.words
    chosen = write_fit_page(coloured, tmp_path, wavelengths_nm=[570, 630])
    scans = {f.stem.rpartition("_")[2] for f in chosen if f.suffix == ".png" and f.stem != "spectrum"}
    assert scans == {"570nm", "630nm"}
    with refused("555", "570", "630"):
        list(jaxink.plots.figures(coloured, [555.0]))


def test_the_spectrum_holds_values_and_standard_errors(coloured, misfit, refused):
    figure = spectrum_figure(coloured)
    curve = quantities(coloured)["scattering coefficient mu_s [1/mm]"]
    known = [d for d in coloured.derived if d.quantity == "scattering_per_mm"]
    np.testing.assert_array_equal(curve.value, [d.value for d in known])
    np.testing.assert_array_equal(curve.error, [d.standard_error for d in known])
    line, *_ = figure.axes[0].lines
    np.testing.assert_array_equal(line.get_xydata(), np.column_stack([curve.wavelength_nm, curve.value]))
    (bars,) = figure.axes[0].collections
    lengths = [np.ptp(segment[:, 1]) for segment in bars.get_segments()]
    np.testing.assert_allclose(lengths, 2 * curve.error)
    at = coloured.data.wavelength_nm
    rms = [np.sqrt(np.mean(coloured.whitened[at == w] ** 2)) for w in curve.wavelength_nm]
    np.testing.assert_allclose(figure.axes[-1].lines[0].get_ydata(), rms)
    # Standard errors of a misfit are meaningless: no bars.
    bad = dataclasses.replace(coloured, whitened=misfit.whitened)
    assert not spectrum_figure({"declared": bad, "corrected": coloured}).axes[0].collections[1:]
    assert not np.isfinite(quantities(bad)["scattering coefficient mu_s [1/mm]"].error).any()
    with refused("one wavelength"):
        spectrum_figure(misfit)
    with refused("3 fits"):
        spectrum_figure(dict.fromkeys("abc", coloured))


def test_a_value_that_all_wavelengths_share_is_one_level_line(coloured, example_result):
    g = example_result["ink.asymmetry_parameter"]
    derived = tuple(
        dataclasses.replace(d, value=g.value, standard_error=g.standard_error)
        if d.quantity == "asymmetry_parameter"
        else d
        for d in coloured.derived
    )
    result = dataclasses.replace(coloured, derived=derived)
    heads = list(quantities(result))
    shared = [head for head, curve in quantities(result).items() if curve.is_shared]
    assert shared == ["asymmetry parameter g"]
    axes = spectrum_figure(result).axes[heads.index(shared[0])]
    (line,) = axes.lines
    np.testing.assert_array_equal(line.get_xydata(), [[570, g.value], [630, g.value]])
    assert line.get_marker() == "None"
    (band,) = axes.collections
    np.testing.assert_allclose(np.ptp(band.get_paths()[0].vertices[:, 1]), 2 * g.standard_error)
    (label,) = axes.texts
    assert label.get_text() == f"{with_uncertainty(g.value, g.standard_error)}, all wavelengths"
    assert not any(curve.is_shared for curve in quantities(coloured).values())
