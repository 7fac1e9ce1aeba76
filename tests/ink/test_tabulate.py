"""The ink alone, as light inside the plate meets it: physics of the table, and its uncertainty."""

import dataclasses

import jax
import jax.numpy as jnp
import jaxtyping
import numpy as np
import pytest

import jaxink
from jaxink.fitting.fitted_parameters import FittedParameters
from jaxink.ink import COMPONENTS, TableOptions
from jaxink.ink.ink_layers import find_ink
from jaxink.ink.polar_grid import polar_grid
from jaxink.ink.stacks import ink_stacks, isolated_model, reversed_sample
from jaxink.ink.uncertainty import ParameterCovariance
from jaxink.numerics.precision import computing
from jaxink.optics.directions import Directions
from jaxink.optics.layers import ClearLayer, ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power, regular_power
from jaxink.solver.stack import Stack


def component(table, name, wavelength=0):
    return table.bsdf_per_sr[COMPONENTS.index(name), wavelength]


def hemispherical(table, name):
    """Integral of f cos over the outgoing hemisphere by the trapezoidal rule, for each incidence."""
    theta = np.deg2rad(table.theta_deg)
    mean = np.trapezoid(component(table, name), np.deg2rad(table.phi_deg), axis=-1) / np.pi
    return np.trapezoid(2 * np.pi * mean * np.sin(theta) * np.cos(theta), theta, axis=-1)


def test_no_light_is_lost_or_made_at_any_incidence(unmatched_table):
    # What remains is the trapezoidal rule's, at grazing incidence the last step's.
    for into, names in (("I", ("R_II", "T_IA")), ("A", ("R_AA", "T_AI"))):
        total = sum(
            hemispherical(unmatched_table, n) + unmatched_table.regular[COMPONENTS.index(n), 0] for n in names
        )
        here = unmatched_table.theta_deg <= 88
        assert np.max(np.abs(total[here] - 1)) < 2e-3, into
    beyond = unmatched_table.theta_deg > 60
    assert np.all(hemispherical(unmatched_table, "T_IA")[beyond & here] > 0.1)


def test_the_solver_keeps_the_energy_of_light_from_a_dense_medium(unmatched):
    ink = find_ink(unmatched)
    model = isolated_model(ink, (550.0,), 1e-3)
    between = np.sin(np.deg2rad([0.0, 30, 42, 60, 80, 88]))
    with computing():
        stack = jax.tree.map(lambda x: x[0], ink_stacks(ink, model, {}))
        channels = np.asarray(model.plan.grid(stack, model.config).kappa) / 1.49
        sines = np.concatenate([channels[channels < 1], between])
        total = np.asarray(sum(hemispherical_power(stack, sines, model.config, model.plan)))
    assert np.max(np.abs(total[: -len(between)] - 1)) < 1e-10
    assert np.max(np.abs(total[-len(between) :] - 1)) < 1e-4


def test_reciprocity_within_a_side_and_across_the_index_step(unmatched_table):
    for name in ("R_II", "R_AA"):
        forward = component(unmatched_table, name)
        np.testing.assert_allclose(forward, np.swapaxes(forward, 0, 1), rtol=1e-8, atol=1e-14)
    there = component(unmatched_table, "T_IA") / unmatched_table.index_outside[0] ** 2
    back = component(unmatched_table, "T_AI") / unmatched_table.index_inside[0] ** 2
    np.testing.assert_allclose(there, np.swapaxes(back, 0, 1), rtol=1e-8, atol=1e-14)


def test_regular_light_is_fresnels_and_lamberts(unmatched_table):
    optical_thickness = 80 * 0.040
    straight = unmatched_table.regular[:, 0, 0]
    first, last = ((1.53 - 1.49) / 3.02) ** 2, (0.53 / 2.53) ** 2
    through = np.exp(-optical_thickness)
    gain = 1 / (1 - first * last * through**2)
    assert straight[0] == pytest.approx(first + (1 - first) ** 2 * last * through**2 * gain, rel=1e-12)
    assert straight[1] == pytest.approx((1 - first) * (1 - last) * through * gain, rel=1e-12)
    beyond = np.rad2deg(np.arcsin(1 / 1.49)) + 0.01 < unmatched_table.theta_deg
    assert beyond.any()
    assert np.all(unmatched_table.regular[1, 0, beyond] == 0)


def test_a_thin_matched_ink_scatters_once():
    text = """
schema_version = 1
[[layers]]
name = "film"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 0.01
scattering_per_mm = 9
absorption_per_mm = 1
asymmetry_parameter = 0.5
"""
    options = TableOptions(7, 5, inside="front", index_inside=1.5, index_outside=1.5)
    table = jaxink.ink_table(jaxink.parse_sample(text), None, [550.0], options=options)
    cosine = np.cos(np.deg2rad(table.theta_deg[:-1]))
    mu_i, mu_o = cosine[:, None, None], cosine[None, :, None]
    sines = np.sqrt((1 - mu_i**2) * (1 - mu_o**2))
    for name, sign in (("R_II", -1), ("T_IA", 1)):
        # phi = 180 is straight on.
        turn = sign * mu_i * mu_o - sines * np.cos(np.deg2rad(table.phi_deg))
        phase = 0.75 / (1.25 - turn) ** 1.5
        expected = 0.9 * phase / (4 * np.pi) * 1e-4 / (mu_i * mu_o)
        np.testing.assert_allclose(component(table, name)[:-1, :-1], expected, rtol=2e-3)


@pytest.fixture(scope="module")
def of_fit(example_result):
    return jaxink.ink_table(example_result, options=TableOptions(13, 5, index_inside=1.45, accuracy=1e-3))


def test_standard_errors_are_those_of_finite_differences_and_of_draws(example_result, of_fit):
    names = example_result.correlation_names
    errors = np.array([example_result[n].standard_error for n in names])
    covariance = errors[:, None] * example_result.correlations * errors
    ink = find_ink(example_result.sample, index_inside=1.45)
    model = isolated_model(ink, (550.0,), 1e-3)
    i, o, p = (axis.ravel() for axis in np.meshgrid([0, 5, 9], [1, 6, 10], [0, 4], indexing="ij"))
    theta, phi = of_fit.theta_deg, of_fit.phi_deg
    directions = Directions.from_degrees(
        np.tile(theta[i], 2), np.tile(theta[o], 2), np.tile(phi[p], 2), np.repeat([False, True], len(i))
    )

    @jax.jit
    def predicted(point):
        stacks = ink_stacks(ink, model, dict(zip(names, point, strict=True)))
        stack = jax.tree.map(lambda x: x[0], stacks)
        regular = jnp.stack(regular_power(stack, directions.sin_incidence)).ravel()
        return jnp.concatenate([diffuse_bsdf(stack, directions, model.config, model.plan), regular])

    tabulated = np.concatenate(
        [of_fit.bsdf_standard_error_per_sr[c, 0, i, o, p] for c in (0, 1)]
        + [of_fit.regular_standard_error[c, 0][[0, 5, 9]] for c in (0, 1)]
    )
    best = np.array([example_result[n].value for n in names])
    # Along the axes of the covariance the parameters vary independently.
    variance, axes = np.linalg.eigh(covariance / np.outer(errors, errors))
    steps = 1e-3 * np.sqrt(variance) * axes * errors[:, None]
    # The standard deviation of 200 draws is itself known to 5 %; four times that is asked for.
    draws = np.random.default_rng(3).multivariate_normal(best, covariance, 200)
    with computing():
        slopes = [np.asarray(predicted(best + step) - predicted(best - step)) / 2e-3 for step in steps.T]
        spread = np.std([predicted(draw) for draw in draws], axis=0)
    np.testing.assert_allclose(tabulated, np.linalg.norm(slopes, axis=0), rtol=1e-4, atol=1e-12)
    np.testing.assert_allclose(tabulated, spread, rtol=0.2, atol=1e-12)


def test_a_parameter_on_its_bound_counts_as_known(example_result, told):
    rows = tuple(
        dataclasses.replace(p, standard_error=None, flag="at lower bound")
        if p.name == "ink.absorption_per_mm"
        else p
        for p in example_result.parameters.values()
    )
    covariance = ParameterCovariance.of(
        dataclasses.replace(example_result, parameters=FittedParameters.of(rows))
    )
    assert covariance.names == ("ink.scattering_per_mm", "ink.asymmetry_parameter")
    told(covariance.sentence, "ink.absorption_per_mm")
    slopes = np.array([[2.0, 0.0], [0.0, 3.0]])
    errors = [example_result[name].standard_error for name in covariance.names]
    assert covariance.standard_error(slopes) == pytest.approx([2 * errors[0], 3 * errors[1]])


def test_only_a_fit_has_standard_errors(of_fit, example_result, unmatched_table, told):
    assert np.all(of_fit.bsdf_standard_error_per_sr > 0)
    assert unmatched_table.bsdf_standard_error_per_sr is None
    told(unmatched_table.attrs["standard_error"])
    rows = tuple(
        dataclasses.replace(p, standard_error=None, flag="not determined")
        if p.name.endswith("g_per_mm")
        else p
        for p in example_result.parameters.values()
    )
    unknown = dataclasses.replace(example_result, parameters=FittedParameters.of(rows))
    assert not ParameterCovariance.of(unknown).known
    told(ParameterCovariance.of(unknown).sentence, "ink.scattering_per_mm")


PRIMED = """
schema_version = 1
wavelength_nm = [450, 650]
[[layers]]
name = "coat"
kind = "clear"
refractive_index = 1.45
thickness_mm = 0.02
absorption_per_mm = { value = 2.0, per_wavelength = true }
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = { tie = "1.53" }
thickness_um = 30
scattering_per_mm = 60
absorption_per_mm = 1
asymmetry_parameter = 0.3
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.49
thickness_mm = 2.0
"""


def test_layers_that_belong_to_the_ink_and_their_wavelengths():
    sample = jaxink.parse_sample(PRIMED)
    parameters = sample.parameters.replace("coat.absorption_per_mm@650", value=20.0)
    ink = find_ink(dataclasses.replace(sample, parameters=parameters), ["ink", "coat"])
    assert (ink.inside, ink.names) == ("back", ("coat", "ink"))
    model = isolated_model(ink, (450.0, 650.0), 1e-2)
    stacks = ink_stacks(ink, model, {})
    layer = ScatteringLayer(1.53, 61 * 0.03, 60 / 61, HenyeyGreenstein(0.3))
    for wavelength, absorbed in ((0, 0.04), (1, 0.4)):
        expected = Stack((ClearLayer(1.45, absorbed), layer), 1.0, 1.49)
        found = jax.tree.map(lambda x, w=wavelength: x[w], stacks)
        for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
            np.testing.assert_allclose(one, other)
    # All four indices end a block of channels.
    assert model.plan.block_media == (0, 1, 2, 3)


def test_the_plate_may_lie_behind(unmatched_table, unmatched):
    options = TableOptions(n_theta=51, n_phi=25)
    table = jaxink.ink_table(reversed_sample(unmatched), options=options)
    assert (table.attrs["inside"], unmatched_table.attrs["inside"]) == ("back", "front")
    np.testing.assert_allclose(table.bsdf_per_sr, unmatched_table.bsdf_per_sr, rtol=1e-12)
    np.testing.assert_allclose(table.regular, unmatched_table.regular, rtol=1e-12)


def test_roughness_stays_with_its_interface():
    rough = PRIMED.replace(
        "thickness_mm = 2.0", 'thickness_mm = 2.0\nfront_roughness = { density = "ggx", sigma_deg = 5.0 }'
    )
    sample = jaxink.parse_sample(rough)
    turned = reversed_sample(sample)
    assert [layer.name for layer in turned.layers] == ["plate", "ink", "coat"]
    assert [face.face for face in turned.layers[0].roughness] == ["back_roughness"]
    # The plate declares the face that it shares with the ink: it is the ink's, and is not left out.
    model = isolated_model(find_ink(sample, ["coat", "ink"]), sample.wavelengths_nm or (550.0,), 1e-2)
    *others, shared = model.builder.faces
    assert shared.name == "plate.front_roughness"
    assert others == [None, None]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"layers": "primer"}, "primer"),
        ({"layers": ["coat", "plate"]}, "coat"),
        ({"layers": []}, "[]"),
        ({"layers": TableOptions()}, "TableOptions("),
        ({"layers": "coat"}, "ink"),
        ({"layers": ["ink"]}, "plate"),
        ({"options": TableOptions(inside="below")}, "front"),
        ({"options": TableOptions(n_theta=5, inside="back")}, "n_theta"),
        ({"layers": "ink", "values": {"ink.absorption": 1.0}}, "ink.absorption_per_mm"),
        ({"layers": "ink", "values": {"ink.refractive_index": 1.5}}, "1.53"),
        ({"layers": "ink", "values": {"ink.thickness_um": -1.0}}, "thickness_um"),
        ({"wavelengths_nm": [-5.0], "options": TableOptions(inside="back")}, "-5"),
        ({"wavelengths_nm": [450, 450], "options": TableOptions(inside="back")}, "450"),
    ],
)
def test_what_is_not_clear_is_refused(arguments, named, monkeypatch, refused):
    # As for users, for whom no one else checks types before.
    monkeypatch.setattr(jaxtyping.config, "jaxtyping_disable", True)
    with refused(named):
        jaxink.ink_table(jaxink.parse_sample(PRIMED), **arguments)


def test_angles_are_dense_at_critical_angles_and_towards_grazing():
    angles = polar_grid(61, [41.8, 76.9, 41.8])
    assert len(angles) == 61
    assert {0.0, 41.8, 76.9, 90.0} <= set(angles)
    steps = np.diff(angles)
    assert np.all(steps > 0)
    for end in (41.8, 76.9, 90.0):
        assert steps[np.searchsorted(angles, end) - 1] < 0.3 * np.max(steps)
    assert np.max(steps) < 3


def test_the_estimated_interpolation_error_falls_about_as_the_square(unmatched_table):
    every_second = np.arange(0, 51, 2)
    coarse = dataclasses.replace(
        unmatched_table,
        theta_deg=unmatched_table.theta_deg[every_second],
        bsdf_per_sr=unmatched_table.bsdf_per_sr[:, :, every_second][:, :, :, every_second],
        regular=unmatched_table.regular[:, :, every_second],
    )
    fine_error, coarse_error = unmatched_table.interpolation_error(), coarse.interpolation_error()
    for name in COMPONENTS:
        assert fine_error[name] < 0.015
        assert 2 < coarse_error[name] / fine_error[name] < 5
