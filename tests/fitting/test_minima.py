"""Distinct minima of a fit: which searches ended in which, their weights, and what is told of them."""

import dataclasses
import json

import numpy as np
import pytest

import jaxink
from jaxink.cli.fit_tables import console, show_result
from jaxink.fitting.endings import Ending, minima_of, noise_scale
from jaxink.fitting.fitted_parameters import FittedParameters
from jaxink.fitting.minima import Minima, Minimum
from jaxink.fitting.outcome import Outcome, Search, SearchPath
from jaxink.model.forward import evaluate
from jaxink.report.fit_html import fit_page

FILM = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = 40.0
radius_nm = { value = 300.0, free = true, min = 150.0, max = 350.0 }
volume_fraction = { value = 0.06, free = true, min = 0.002, max = 0.5 }
particle_index = 2.3
particle_absorption_index = 2e-4
[noise]
relative = 0.003
scan_relative = 0
floor_per_sr = 1e-4
"""


def sorted_ends(endings, best, is_chi_square=True):
    """Minima of searches with two variables and a hundred degrees of freedom."""
    scale = noise_scale(best.loss, 100, is_chi_square)
    return minima_of(endings, best, scale, lambda unit: dict(zip("ab", map(float, unit), strict=True)))


def end(loss, a, b=0.5, outcome=Outcome.CONVERGED, triangle=((100.0, 0.0), (0.0, 1e-3))):
    """A search that ended there; the data know the first variable to 0.01, and nothing of the second."""
    unit, path = np.array([a, b]), SearchPath(*np.zeros((2, 1), int), *np.zeros((2, 1)), np.zeros((1, 2)))
    root = None if triangle is None else np.array(triangle)
    return Search("gradient", outcome, unit, unit, 9e9, loss, 1, 1, 0, 0.1, 0.0, 0.0, root, None, unit, path)


def test_ends_within_a_standard_error_are_one_minimum_and_weights_are_likelihoods():
    best = end(90.0, 0.3)
    others = [end(90.0005, 0.3005, 0.9), end(93.0, 0.6), end(93.0, 0.6002), end(150.0, 0.1)]
    stalled = end(91.0, 0.45, outcome=Outcome.STALLED)
    endings = [Ending(search, is_start=True) for search in (*others, best, stalled)]
    found = sorted_ends(endings, best)
    assert [one.starts for one in found.found] == [2, 2, 1]
    assert (found.starts, found.unfinished, found.left_out) == (6, 1, 0)
    assert [one.rise for one in found.found] == pytest.approx([0.0, 3.0, 60.0])
    assert sum(one.weight for one in found.found) == pytest.approx(1.0)
    assert found.found[1].weight / found.found[0].weight == pytest.approx(np.exp(-1.5))
    # The last one is excluded.
    assert found.spread("a") == (0.3, 0.6)
    assert "2 of 6 starts" in found.sentence
    assert "1 in none" in found.sentence


@pytest.mark.parametrize(("is_chi_square", "loss"), [(True, 400.0), (False, 0.04)])
def test_the_noise_is_scaled_to_the_misfit(is_chi_square, loss):
    best, other = end(loss, 0.3), end(1.03 * loss, 0.6)
    root = np.sqrt(loss / 100)
    best, other = (dataclasses.replace(s, triangle=root * s.triangle) for s in (best, other))
    found = sorted_ends([Ending(best, True), Ending(other, True)], best, is_chi_square)
    assert found.noise_scale == pytest.approx(loss / 100)
    assert found.found[1].rise == pytest.approx(3.0)
    assert found.found[1].loss == pytest.approx(1.03 * loss)
    close = dataclasses.replace(other, unit=np.array([0.307, 0.5]))
    assert len(sorted_ends([Ending(close, True)], best, is_chi_square).found) == 1


def test_what_a_scan_has_passed_by_is_kept_once_and_never_counts_as_a_start():
    best, coarse = end(90.0, 0.3), end(80.0, 0.32)
    passed = [Ending(end(loss, a), swept={0: 0.03}, shift=13.0) for loss, a in ((400.0, 0.31), (700.0, 0.8))]
    found = sorted_ends([*passed, Ending(coarse, is_start=True, shift=13.0)], best)
    assert [one.is_searched for one in found.found] == [True, True, False]
    assert [one.values["a"] for one in found.found] == [0.3, 0.32, 0.8]
    # A refinement has raised the best minimum by 13, and is taken to raise the others alike.
    assert [one.loss for one in found.found] == pytest.approx([90.0, 93.0, 713.0])
    assert [one.starts for one in found.found] == [0, 1, 0]


def test_methods_without_a_jacobian_have_minima_too():
    ends = [end(9.0 + i, a, 0.5, Outcome.SETTLED, None) for i, a in enumerate((0.3, 0.305, 0.5))]
    found = sorted_ends([Ending(search, True) for search in ends], ends[0])
    assert [one.starts for one in found.found] == [2, 1]


def test_an_end_that_is_no_minimum_has_none():
    limited = end(90.0, 0.3, outcome=Outcome.MAX_STEPS)
    assert sorted_ends([Ending(limited, True)], limited) is None


@pytest.fixture(scope="module")
def film(coarse):
    """Light scattered by a film of spheres of 233 nm, whose misfit has several minima along the radius."""
    sample = jaxink.parse_sample(FILM, "film")
    theta_o = np.tile(np.arange(5.0, 80.0, 5.0), 2)
    columns = np.zeros(30), theta_o, np.full(30, 180.0), np.full(30, 550.0), np.arange(30) < 15
    true = sample.replace({"ink.radius_nm": 233.0})
    bsdf = evaluate(jaxink.forward_model(true, jaxink.GonioData(*columns, np.ones(30)), coarse))
    noise = 0.003 * np.random.default_rng(7).normal(size=30)
    return jaxink.GonioData(*columns, bsdf * (1 + noise)), sample


@pytest.fixture(scope="module")
def from_starts(film, coarse):
    return jaxink.fit(*film, jaxink.FitOptions(config=coarse, profile="none", scan=False, starts=8))


@pytest.fixture(scope="module")
def scanned(film, coarse):
    return jaxink.fit(*film, jaxink.FitOptions(config=coarse, profile="none"))


def test_a_fit_from_starts_tells_how_many_ended_in_which_minimum(from_starts):
    minima = from_starts.minima
    assert abs(from_starts["ink.radius_nm"].value - 233.0) < 3 * from_starts["ink.radius_nm"].standard_error
    assert minima.starts == 8
    assert sum(one.starts for one in minima.found) + minima.unfinished == 8
    assert len(minima.found) > 1
    best = minima.found[0]
    assert best.values == {name: from_starts[name].value for name in best.values}
    assert best.loss == pytest.approx(from_starts.merit.chi_square, rel=1e-9)


def test_a_default_fit_keeps_the_minima_of_its_scan(scanned, from_starts):
    assert scanned.merit.chi_square == pytest.approx(from_starts.merit.chi_square, rel=1e-6)
    assert scanned.minima.starts == 1
    radii = [one.values["ink.radius_nm"] for one in scanned.minima.found]
    for one in from_starts.minima.found:
        assert min(abs(one.values["ink.radius_nm"] - radius) for radius in radii) < 10.0


def test_minima_are_saved_and_an_older_result_has_none(scanned, tmp_path):
    scanned.save(tmp_path)
    assert jaxink.load_result(tmp_path).minima == scanned.minima
    plain = json.loads((tmp_path / "result.json").read_text())
    del plain["minima"]
    for parameter in plain["parameters"]:
        del parameter["over_minima"]
    (tmp_path / "result.json").write_text(json.dumps(plain))
    older = jaxink.load_result(tmp_path)
    assert older.minima is None
    assert older["ink.radius_nm"].value == scanned["ink.radius_nm"].value


@pytest.fixture
def rivalled(example_result):
    """The same with a second minimum, 1.1 higher."""
    best, *_ = example_result.minima.found
    other = dict(best.values) | {"ink.asymmetry_parameter": 0.7}
    found = (
        dataclasses.replace(best, weight=0.634, starts=2),
        Minimum(other, best.loss + 1.1, 1.1, 0.366, 1, is_searched=True),
    )
    minima = Minima(4, 1, 1.0, 0, found)
    rows = tuple(
        dataclasses.replace(p, over_minima=minima.spread(p.name) if p.free else None)
        for p in example_result.parameters.values()
    )
    return dataclasses.replace(example_result, minima=minima, parameters=FittedParameters.of(rows))


def test_rival_minima_are_told_in_the_terminal_in_the_notebook_and_on_the_page(rivalled, told, capsys):
    show_result(console(), rivalled)
    printed = capsys.readouterr().out
    for text in (printed, rivalled.summary(), fit_page(rivalled, {})):
        assert "2 of 4 starts ended in the minimum of this fit, 1 in another one, 1 in none." in text
        assert "over minima" in text
        assert "0.366" in text or "0.37" in text
    (sentence,) = rivalled.minima.rivals(is_chi_square=True)
    told(sentence, "1.1 higher in chi-square", "asymmetry_parameter = 0.7")


def test_a_single_minimum_is_not_talked_of(example_result):
    assert len(example_result.minima.found) == 1
    assert "Minima" not in example_result.summary()
    assert example_result["ink.asymmetry_parameter"].over_minima is None
