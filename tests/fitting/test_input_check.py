"""Mistakes in the input are named, and nothing else is."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.fitting import Mistake, check_input
from jaxink.fitting.hypotheses import OF_DATA, OF_SIGMA, of_lengths, source_is_scanned
from jaxink.fitting.input_check import _Check, far_from_neighbours, too_much_power
from jaxink.measurement.balance import balances
from jaxink.measurement.masks import angular_distance_deg
from jaxink.sample.turning import turned_over
from tests.samples import PRINTED_INK, UNMATCHED


@pytest.fixture
def coarsely(monkeypatch, coarse):
    monkeypatch.setattr("jaxink.model.forward.model_sizes", lambda *_: coarse)


def cosine(data):
    return np.cos(np.deg2rad(data.theta_o_deg))


def exchanged(data):
    return data.replace(theta_i_deg=data.theta_o_deg, theta_o_deg=data.theta_i_deg)


MADE = {
    "times_cosine": lambda d: d.replace(bsdf_per_sr=d.bsdf_per_sr * cosine(d)),
    "times_pi": lambda d: d.replace(bsdf_per_sr=d.bsdf_per_sr * np.pi, sigma_per_sr=d.sigma_per_sr * np.pi),
    "phi_turned": lambda d: d.replace(phi_deg=180 - d.phi_deg),
    "sides_exchanged": lambda d: d.replace(is_transmission=~d.is_transmission),
    "sigma_relative": lambda d: d.replace(sigma_per_sr=d.sigma_per_sr / d.bsdf_per_sr),
    "sigma_times_value": lambda d: d.replace(sigma_per_sr=d.sigma_per_sr * d.bsdf_per_sr),
    "angles_exchanged": exchanged,
}


@pytest.mark.parametrize("name", MADE)
def test_a_mistake_is_named_and_not_repaired(name, inputs, coarsely, told):
    data, sample = inputs
    faulty = MADE[name](data)
    result = jaxink.fit(faulty, sample, jaxink.FitOptions(profile="none"))
    checked = check_input(result)
    (found,) = (m for m in checked.mistakes if m.is_named and m.reduced_chi_square is not None)
    assert found.name == name
    # What the fit of the right input leaves.
    assert found.reduced_chi_square == pytest.approx(0.937, abs=0.02)
    np.testing.assert_array_equal(checked.data.bsdf_per_sr, faulty.bsdf_per_sr)
    assert checked.values == result.values
    told(checked.verdict.sentence)
    if result.verdict.is_misfit:
        freedom = result.merit.degrees_of_freedom
        fall = (result.verdict.reduced_chi_square - found.reduced_chi_square) * freedom
        assert found.delta_chi_square == pytest.approx(fall, rel=1e-3)


def test_what_fits_is_not_suspected(example_result):
    assert check_input(example_result) is example_result


@pytest.mark.parametrize(
    "options",
    [{"max_steps": 2}, {"max_evaluations": 3}, {"method": "simplex", "max_steps": 20}],
    ids=["steps", "evaluations", "simplex"],
)
def test_a_search_that_a_limit_ended_accuses_nothing(options, inputs, coarse):
    result = jaxink.fit(*inputs, jaxink.FitOptions(config=coarse, **options))
    assert result.outcome.is_limited
    assert result.verdict.reduced_chi_square > 2
    # Nothing followed the search: neither a profile nor a second start.
    assert len(result.searches) == 1
    assert result.profiles == ()
    assert check_input(result) is result


def test_a_method_that_misses_the_minimum_accuses_itself(inputs, coarse, coarsely, told):
    result = jaxink.fit(*inputs, jaxink.FitOptions(config=coarse, method="optimistix_nelder_mead"))
    assert result.outcome.converged
    assert result.verdict.is_misfit
    checked = check_input(result)
    assert checked.mistakes == ()
    told(checked.notes[-1], "missed the minimum")


def test_a_thickness_a_thousand_times_too_small_is_named(inputs, coarsely):
    data, sample = inputs
    table = sample.parameters.replace("ink.thickness_um", value=0.08)
    result = jaxink.fit(
        data, dataclasses.replace(sample, parameters=table), jaxink.FitOptions(profile="none")
    )
    named = [m.name for m in check_input(result).mistakes if m.is_named]
    assert named == ["thickness_of_ink_too_small"]


def test_a_missing_effect_is_not_taken_for_a_mistake(inputs, coarsely):
    data, sample = inputs
    stray = data.replace(bsdf_per_sr=data.bsdf_per_sr + 0.01)
    checked = check_input(jaxink.fit(stray, sample, jaxink.FitOptions(profile="none")))
    assert checked.verdict.reduced_chi_square > 10
    assert len(checked.mistakes) > 10
    assert not any(mistake.is_named for mistake in checked.mistakes)


@pytest.mark.parametrize(
    "hypothesis", [h for h in (*OF_DATA, *OF_SIGMA) if h.name in MADE], ids=lambda h: h.name
)
def test_a_correction_undoes_the_mistake(hypothesis, inputs):
    data, sample = inputs
    right = hypothesis.correct(MADE[hypothesis.name](data), sample).data
    np.testing.assert_allclose(right.bsdf_per_sr, data.bsdf_per_sr, rtol=1e-12)
    np.testing.assert_array_equal(right.phi_deg, data.phi_deg)
    np.testing.assert_array_equal(right.side, data.side)
    if not hypothesis.name.startswith("times_cosine"):
        np.testing.assert_allclose(right.sigma_per_sr, data.sigma_per_sr, rtol=1e-12)


def test_grazing_values_are_not_divided_by_a_cosine_of_nothing(inputs):
    data, sample = inputs
    grazing = data.replace(theta_o_deg=np.full(len(data), 90.0))
    (times_cosine,) = (h for h in OF_DATA if h.name == "times_cosine")
    right = times_cosine.correct(grazing, sample).data
    assert not right.used.any()
    np.testing.assert_array_equal(right.bsdf_per_sr, data.bsdf_per_sr)


def test_only_thicknesses_that_matter_are_doubted():
    names = {h.name for h in of_lengths(jaxink.parse_sample(PRINTED_INK))}
    assert names == {"thickness_of_ink_too_small", "thickness_of_ink_too_large"}
    names = {h.name for h in of_lengths(jaxink.parse_sample(UNMATCHED))}
    assert "thickness_of_plate_too_small" in names


def test_the_scanned_angle_is_that_with_many_values(inputs):
    assert not source_is_scanned(inputs[0])
    assert source_is_scanned(exchanged(inputs[0]))


def points(theta_o_deg, values, transmission=False):
    n = len(theta_o_deg)
    return jaxink.GonioData(
        np.zeros(n), theta_o_deg, np.zeros(n), np.full(n, 550.0), np.full(n, transmission), values
    )


def test_a_lambertian_surface_reflects_its_albedo():
    theta = np.arange(0.0, 90.5, 2.5)
    (balance,) = balances(points(theta, np.full(theta.size, 0.7 / np.pi)))
    assert balance.share == pytest.approx(0.7, rel=2e-3)
    assert balance.sides == "R"
    # A lobe f = (n + 2) / (2 pi) cos(theta)^n sends out all of the light.
    (lobe,) = balances(points(theta, 12 / (2 * np.pi) * np.cos(np.deg2rad(theta)) ** 10))
    assert lobe.share == pytest.approx(1.0, rel=0.02)
    assert balances(points(theta[:20], np.full(20, 1.0))) == ()


def test_a_turned_sample_transmits_with_exchanged_angles(coarse):
    # Reciprocity of transmission (Helmholtz): both media outside are air.
    sample = jaxink.parse_sample(UNMATCHED)
    turned = turned_over(sample)
    assert turned_over(turned) == sample
    here = (np.array([20.0]), np.array([55.0]), np.array([130.0]), np.array([550.0]), np.array([True]))
    back = (here[1], here[0], *here[2:])
    forward, backward = (
        jaxink.predict(s, jaxink.GonioData(*columns, np.ones(1)))
        for s, columns in ((sample, here), (turned, back))
    )
    np.testing.assert_allclose(backward, forward, rtol=1e-4)
    # But not with the angles as they are: the media are not matched.
    same = jaxink.predict(turned, jaxink.GonioData(*here, np.ones(1)))
    assert abs(same[0] / forward[0] - 1) > 1e-3


def test_a_slip_of_the_pen_is_named_by_its_row(example_result, told):
    data = example_result.data
    [point] = np.flatnonzero(
        data.used & (data.theta_i_deg == 0) & (data.theta_o_deg == 40) & ~data.is_transmission
    )[:1]
    values = data.bsdf_per_sr.copy()
    values[point] *= 1000
    (mistake,) = far_from_neighbours(data.replace(bsdf_per_sr=values))
    assert data.place(int(point)) in mistake.statement
    assert mistake.needs_no_refit
    told(mistake.statement)
    assert far_from_neighbours(data) == ()
    # Many of them are structure.
    values[data.theta_o_deg % 10 == 0] *= 1000
    assert far_from_neighbours(data.replace(bsdf_per_sr=values)) == ()


def test_mistakes_are_saved_with_the_result(example_result, tmp_path):
    named = Mistake("times_pi", "The values read like pi x BSDF", "divide by pi", 0.94, 2e6, is_named=True)
    certain = Mistake("more_light_than_arrives", "More light leaves", "normalise", None, None, is_named=True)
    result = dataclasses.replace(example_result, mistakes=(certain, named))
    result.save(tmp_path)
    loaded = jaxink.load_result(tmp_path)
    assert loaded.mistakes == (certain, named)
    assert loaded.verdict == result.verdict
    # The refit says what to do; what needs no refit is its support.
    assert "divide by pi" in loaded.verdict.sentence
    assert "normalise" not in loaded.verdict.sentence


def test_pairs_that_a_wrong_correction_makes_disagree_are_no_noise(inputs, coarsely):
    # Reciprocal pairs are the only noise estimate: divided by cos(theta_o) they disagree by far.
    data, sample = inputs
    reflected = data.select(side="R").replace(sigma_per_sr=None)
    stated = dataclasses.replace(sample.noise, relative=None, floor_per_sr=0.0)
    shifted = reflected.replace(bsdf_per_sr=reflected.bsdf_per_sr + 0.03)
    # What is wrong by far may have its minimum at the end of a long valley.
    options = jaxink.FitOptions(profile="none", max_steps=1000)
    result = jaxink.fit(shifted, dataclasses.replace(sample, noise=stated), options)
    assert result.verdict.reduced_chi_square > 100
    left = {mistake.name: mistake.reduced_chi_square for mistake in check_input(result).mistakes}
    # With noise estimated anew from the pairs, these would leave 2.1, 4.9 and 0.004.
    assert min(left[name] for name in ("times_cosine", "divided_by_cosine", "sides_exchanged")) > 10


def test_values_under_the_noise_floor_explain_nothing(inputs, coarsely):
    # The detector shades the beam but for stray light. Divided by 100, every value is near the floor,
    # which any model then fits.
    data, sample = inputs
    shaded = (data.side == "R") & (
        angular_distance_deg(data.theta_o_deg, data.phi_deg, data.theta_i_deg, 0.0) < 8
    )
    dark = data.replace(bsdf_per_sr=np.where(shaded, 1e-4, data.bsdf_per_sr), sigma_per_sr=None)
    noise = dataclasses.replace(sample.noise, relative=0.02, floor_per_sr=0.00093)
    result = jaxink.fit(dark, dataclasses.replace(sample, noise=noise), jaxink.FitOptions(profile="none"))
    assert result.verdict.reduced_chi_square > 100
    left = {mistake.name: mistake.reduced_chi_square for mistake in check_input(result).mistakes}
    assert min(left["per_cent"], left["reflectance_factor_in_per_cent"]) > 10


@pytest.mark.parametrize(("albedo_at_450", "is_named"), [(0.6, False), (1.2, True)])
def test_light_of_one_wavelength_may_come_from_another(albedo_at_450, is_named):
    """A lamp of both wavelengths, equally strong: the light at 550 nm is 1.2 times what arrives there."""
    theta = np.linspace(0, 85, 40)
    data = jaxink.GonioData(
        np.zeros(80),
        np.tile(theta, 2),
        np.zeros(80),
        np.repeat([450.0, 550.0], 40),
        np.zeros(80, bool),
        np.repeat([albedo_at_450, 1.2], 40) / np.pi,
    )
    sample = jaxink.parse_sample(PRINTED_INK)
    (mistake,) = too_much_power(data, sample)
    assert mistake.is_named
    lit = dataclasses.replace(sample, detector_mode="spectrometer", illumination=((450, 550), (1.0, 1.0)))
    assert bool(too_much_power(data, lit)) is is_named


def test_a_refit_that_fails_costs_its_hypothesis(inputs, coarsely, monkeypatch, told):
    def refitted(self, hypothesis, *args, original=_Check._refitted):
        if hypothesis.name == "times_pi":
            raise np.linalg.LinAlgError("SVD did not converge")
        return original(self, hypothesis, *args)

    monkeypatch.setattr(_Check, "_refitted", refitted)
    data, sample = inputs
    result = jaxink.fit(MADE["times_cosine"](data), sample, jaxink.FitOptions(profile="none"))
    checked = check_input(result)
    assert [m.name for m in checked.mistakes if m.is_named] == ["times_cosine"]
    assert "times_pi" not in {m.name for m in checked.mistakes}
    *notes, failed = checked.notes
    assert tuple(notes) == result.notes
    told(failed, "times_pi")
