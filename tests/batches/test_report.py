"""The report of a batch: counts, trends, outliers, maps, and a link for each measurement."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from jaxink.batches.figures import trend_figures
from jaxink.batches.listing import ListedMeasurement
from jaxink.batches.page import outlying, report_page
from jaxink.batches.result import Batch
from jaxink.batches.row import Inputs, Row, RowParameter
from jaxink.batches.verdicts import is_misfit, verdict_meaning
from jaxink.diagnosis.findings.verdict import VerdictCode
from jaxink.fitting.verdict import FitVerdictCode

INPUTS = Inputs("a", "b", "c")
FAR = 7


@pytest.fixture(scope="module")
def batch():
    rows, listed = [], []
    for i in range(30):
        value = 60 + np.sin(i) + (20 if i == FAR else 0)
        found = (RowParameter("ink.scattering_per_mm", "1/mm", value, 1.0),)
        page = f"results/s{i}/fit.html"
        rows.append(
            Row(f"s{i}", ("f",), INPUTS, "done", "", "consistent", points=9, parameters=found, page=page)
        )
        listed.append(
            ListedMeasurement(f"s{i}", (Path("f"),), {}, {"x_mm": i % 6, "y_mm": i // 6, "shift": "late"})
        )
    rows.append(Row("lost", ("f",), INPUTS, "refused", "f: there is <no> file."))
    listed.append(ListedMeasurement("lost", (Path("f"),)))
    return Batch("Line <3>", tuple(rows), tuple(listed), Path("out"))


def test_outliers_are_far_in_robust_standard_deviations(batch):
    assert outlying(batch.rows) == {"ink.scattering_per_mm": {f"s{FAR}"}}


def test_four_values_have_no_outlier(batch):
    assert outlying(batch.rows[5:9]) == {"ink.scattering_per_mm": set()}


def test_the_page_counts_draws_and_links(batch):
    page = report_page(batch)
    assert page.count("<img") == 2, "a trend and a map"
    assert re.findall(r'<a href="(results/[^"]+)"', page) == [f"results/s{i}/fit.html" for i in range(30)]
    outliers = page.split('<section id="outliers">')[1].split("</section>")[0]
    assert re.findall(r">(s\d+)<", outliers) == [f"s{FAR}"]
    trouble = page.split('<section id="without-a-result">')[1].split("</section>")[0]
    assert "there is &lt;no&gt; file" in trouble
    assert "Line &lt;3&gt;" in page
    assert "<no>" not in page


def run_of(values, errors):
    """Rows of one parameter."""
    parameters = [(RowParameter("ink.g", "", v, e),) for v, e in zip(values, errors, strict=True)]
    return [
        Row(f"s{i}", ("f",), INPUTS, "done", "", "consistent", parameters=p) for i, p in enumerate(parameters)
    ]


def test_noise_alone_has_an_outlier_in_one_run_of_twenty_at_most():
    draws = np.random.default_rng(3).normal(size=(2000, 12))
    share = np.mean([bool(outlying(run_of(values, np.ones(12)))["ink.g"]) for values in draws])
    assert share < 0.05
    # Without standard errors, only the scatter counts, which 12 values do not tell well.
    assert np.mean([bool(outlying(run_of(values, [None] * 12))["ink.g"]) for values in draws]) > 0.1


def test_an_outlier_is_beyond_the_scatter_and_beyond_its_own_standard_error():
    values = np.array([-0.3, -0.2, -0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.1, 0.2, 0.3, 2.6])
    assert outlying(run_of(values, [1.0] * 12))["ink.g"] == set()
    assert outlying(run_of(values, [0.5] * 12))["ink.g"] == {"s11"}
    # Scatter of the sheets beyond their standard errors is no crowd of outliers.
    assert outlying(run_of(values[:11], [0.01] * 11))["ink.g"] == set()
    # That of a misfit allows nothing.
    rows = run_of(values, [1.0] * 12)
    assert outlying([*rows[:11], misfit(rows[11], "misfit")])["ink.g"] == {"s11"}


@pytest.mark.parametrize("chi_squares", [(0.97, 1.02, 1.05), (0.5, 1.0, 40.0), (0.9, 1.1, 6.1e6)])
def test_figures_have_plain_numbers_and_nothing_is_cut_off(chi_squares):
    name = "ink.a_parameter_with_a_rather_long_name@550nm"
    rows = [
        Row(
            f"s{i}",
            ("f",),
            INPUTS,
            "done",
            "",
            "consistent",
            reduced_chi_square=value,
            parameters=(RowParameter(name, "1/mm", 1.2345 + i * 1e-4, 1e-5),),
        )
        for i, value in enumerate(chi_squares)
    ]
    batch = Batch(
        "title", tuple(rows), tuple(ListedMeasurement(row.name, (Path("f"),)) for row in rows), Path("out")
    )
    for _, figure in trend_figures(batch, {}):
        figure.canvas.draw()
        (axes,) = figure.axes
        labels = [label for label in axes.get_yticklabels() if label.get_text()]
        assert len(labels) >= 2
        for label in labels:
            float(label.get_text())
        box = figure.get_tightbbox()
        wide, tall = figure.get_size_inches()
        assert min(box.x0, box.y0) >= 0
        assert box.x1 <= wide
        assert box.y1 <= tall


def misfit(row, verdict):
    return dataclasses.replace(row, verdict=verdict, sentence=f"{row.name} is far above the noise.")


@pytest.mark.parametrize("verdict", ["misfit", "partly_explained"])
def test_misfits_are_explained_listed_and_marked(verdict, batch):
    rows = (misfit(batch.rows[0], verdict), *batch.rows[1:])
    bad = dataclasses.replace(batch, rows=rows, reading={"side": "R"})
    assert [row.name for row in bad.misfits] == ["s0"]
    page, card = report_page(bad), " ".join(bad.summary().split())
    for text in (page, card):
        assert verdict_meaning(verdict) in text
        assert "s0 is far above the noise." in text
        # A diagnosis has its own page for what to do.
        what = "jaxink diagnose f --side R --sample out/results/s0/sample.toml --out s0-report"
        assert (what in text) == (verdict == "misfit")
    table = page.split('<section id="all-measurements">')[1]
    assert re.findall(r">(\d[\d.]*\(\d+\)\*)<", table) == ["60.0(10)*"]
    assert "standard error is meaningless" in table
    assert "meaningless" not in report_page(batch)


@pytest.mark.parametrize("kind", [FitVerdictCode, VerdictCode])
def test_every_verdict_is_explained_and_counts_as_in_its_own_command(kind, batch):
    for code in kind:
        assert verdict_meaning(str(code)) == code.meaning
        is_one = code.structure_remains if kind is VerdictCode else code is FitVerdictCode.MISFIT
        assert is_misfit(misfit(batch.rows[0], str(code))) == is_one


def test_columns_have_an_entry_for_each_measurement(batch):
    columns = batch.columns()
    assert {len(entries) for entries in columns.values()} == {31}
    assert columns["x_mm"][FAR], columns["shift"][-1] == (1, None)
    assert columns["ink.scattering_per_mm"][-1] is None


def test_the_card_counts(batch):
    text = batch.summary()
    assert "30 done" in text
    assert "1 refused" in text
    assert "30 done: with a result." in text
    one = Batch("t", batch.rows[:1], batch.measurements[:1], Path("out"), missing=1).summary()
    assert "1 measurement, 0 of them" in one
    assert "1 measurement has no row yet" in one
