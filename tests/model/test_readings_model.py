"""Predicted readings against the solver's functions, and against what holds for any sample."""

import dataclasses

import jax
import numpy as np
import pytest

from jaxink.measurement import Readings, Spheres
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.model.readings import ReadingsModel
from jaxink.optics.directions import Directions
from jaxink.sample import parse_sample
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power, regular_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack
from tests.samples import PRINTED_INK, UNMATCHED, edited

CONFIG = SolverConfig(16, 12, 32, 8)
NAN = np.nan
EIGHT = np.sin(np.deg2rad([8.0]))


def readings(*rows, wavelength_nm=550.0, spheres=None):
    """Of (quantity, theta_i, theta_o) each."""
    quantity, theta_i, theta_o = zip(*rows, strict=True)
    phi = np.where(np.isnan(theta_i) | np.isnan(theta_o), NAN, 180.0)
    n = len(rows)
    return Readings(
        np.array(quantity),
        np.array(theta_i, float),
        np.array(theta_o, float),
        phi,
        np.broadcast_to(wavelength_nm, n).astype(float),
        np.full(n, 0.5),
        spheres=spheres,
    )


ALL = (
    ("R_total", 8, NAN),
    ("R_diffuse", 8, NAN),
    ("R_specular", 8, NAN),
    ("T_total", 8, NAN),
    ("T_diffuse", 8, NAN),
    ("T_collimated", 8, NAN),
)


def sample_of(text=PRINTED_INK, *changes):
    return parse_sample(edited(text, changes))


def stack_and_plan(model):
    wave = model.wavelengths_nm[0]
    values = {name: value[0] for name, value in model.builder.values({}).items()}
    return model.solvable(wave, values, jax.tree.map(lambda table: table[0], model.rough_tables))


def turned(stack):
    return Stack(stack.layers[::-1], stack.index_back, stack.index_front)


def with_back(text, index_back, index_front=1.0):
    table = (
        f'[surroundings]\nindex_front = {index_front}\nindex_back = {index_back}\n[[layers]]\nname = "plate"'
    )
    return edited(text, ('[[layers]]\nname = "plate"', table))


def test_totals_and_regular_light_are_those_of_the_solver():
    model = ReadingsModel(sample_of(UNMATCHED), readings(*ALL), CONFIG)
    stack, _ = stack_and_plan(model)
    (reflected,), (transmitted,) = hemispherical_power(stack, EIGHT, model.config, model.plan)
    (specular,), (collimated,) = regular_power(stack, EIGHT)
    expected = [
        reflected, reflected - specular, specular, transmitted, transmitted - collimated, collimated
    ]  # fmt: skip
    np.testing.assert_allclose(evaluate(model), expected, rtol=1e-12)


BETWEEN_SLIDES = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "top"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.4
thickness_mm = 1.0
scattering_per_mm = 5
absorption_per_mm = {absorption}
asymmetry_parameter = {asymmetry}
[[layers]]
name = "bottom"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
"""


@pytest.mark.parametrize(
    ("absorption", "asymmetry", "reflected", "transmitted", "collimated"),
    [
        (0.1, 0.0, 0.51485734, 0.19596446, None),
        (0.9, 0.0, 0.22523007, 0.02170653, None),
        (0.1, 0.9, 0.18744405, 0.57620054, 0.00560593),
        (0.9, 0.9, 0.06135334, 0.20846202, 0.00251890),
    ],
)
def test_totals_are_those_of_adding_doubling(absorption, asymmetry, reflected, transmitted, collimated):
    """Computed by the iad program: github.com/scottprahl/iad, tests/rxt/0_sphere/basic_B and basic_C."""
    sample = parse_sample(BETWEEN_SLIDES.format(absorption=absorption, asymmetry=asymmetry))
    each = readings(("R_total", 0, NAN), ("T_total", 0, NAN), ("T_collimated", 0, NAN))
    predicted = evaluate(ReadingsModel(sample, each, accuracy=1e-4))
    np.testing.assert_allclose(predicted[:2], [reflected, transmitted], atol=5e-5)
    assert collimated is None or predicted[2] == pytest.approx(collimated, rel=5e-5)


def test_a_rough_face_scatters_what_is_then_no_longer_regular():
    roughness = 'thickness_mm = 1.0\nfront_roughness = { density = "beckmann", sigma_deg = 8 }\n'
    sample = sample_of(UNMATCHED, "thickness_mm = 1.0\n", roughness)
    config = dataclasses.replace(CONFIG, n_orders=1)
    model = ReadingsModel(sample, readings(*ALL), config)
    predicted = evaluate(model)
    stack, plan = stack_and_plan(model)
    (reflected,), (transmitted,) = hemispherical_power(stack, EIGHT, config, plan)
    np.testing.assert_allclose(predicted, [reflected, reflected, 0, transmitted, transmitted, 0], rtol=1e-10)


def test_reflectance_factors_are_pi_times_the_bsdf():
    model = ReadingsModel(
        sample_of(UNMATCHED), readings(("R_45_0", 45, 0), ("R_0_45", 0, 45), ("R_45_0", 45, 30)), CONFIG
    )
    stack, plan = stack_and_plan(model)
    at = Directions.from_degrees([45.0, 0.0, 45.0], [0.0, 45.0, 30.0], np.full(3, 180.0), np.zeros(3, bool))
    predicted = evaluate(model)
    np.testing.assert_allclose(predicted, np.pi * diffuse_bsdf(stack, at, CONFIG, plan), rtol=1e-12)
    assert predicted[0] == pytest.approx(predicted[1], rel=1e-10)


@pytest.mark.parametrize("backing", ["", '\n[backing]\nreflectance = 0.6\nside = "R"\n'])
def test_a_backing_adds_to_the_reflectance_alone(backing):
    model = ReadingsModel(parse_sample(UNMATCHED + backing), readings(*ALL), CONFIG)
    alone = ReadingsModel(sample_of(UNMATCHED), readings(*ALL), CONFIG)
    change = evaluate(model) - evaluate(alone)
    np.testing.assert_allclose(change[2:], 0, atol=1e-12)
    assert change[0] == pytest.approx(change[1])
    assert (change[0] > 0.1) == bool(backing)


@pytest.mark.parametrize("index_back", [1.0, 1.33])
def test_a_sample_without_absorption_loses_no_light(index_back):
    text = with_back(edited(UNMATCHED, ("absorption_per_mm = 0.05", "absorption_per_mm = 0")), index_back)
    each = [(name, angle, NAN) for angle in (0, 8, 45) for name in ("R_total", "T_total")]
    predicted = evaluate(ReadingsModel(parse_sample(text), readings(*each), CONFIG))
    np.testing.assert_allclose(predicted.reshape(3, 2).sum(axis=1), 1, atol=1e-4)


def test_diffuse_illumination_is_reflected_as_light_from_the_angle_of_view():
    each = [(name, 8, NAN) for name in ("R_total", "R_diffuse")]
    each += [(name, NAN, 8) for name in ("R_di_8", "R_de_8")]
    there = evaluate(ReadingsModel(sample_of(UNMATCHED), readings(*each), CONFIG))
    np.testing.assert_allclose(there[:2], there[2:], rtol=1e-12)


@pytest.mark.parametrize(("index_front", "index_back"), [(1.0, 1.0), (1.0, 1.33), (1.33, 1.0)])
def test_light_seen_through_is_the_integral_of_the_btdf_over_the_incidences(index_front, index_back):
    """The radiance behind is the integral of f L cos(theta_i) over the hemisphere in front."""
    model = ReadingsModel(
        parse_sample(with_back(UNMATCHED, index_back, index_front)),
        readings(("T_di_8", NAN, 8), ("T_de_8", NAN, 8), ("T_di_8", NAN, 40)),
        CONFIG,
    )
    seen = evaluate(model)
    stack, plan = stack_and_plan(model)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    # cos(theta_i) dOmega = pi d(sin^2), twice where the azimuths are mirrored.
    squares, azimuths = (nodes + 1) / 2, (np.arange(24) + 0.5) * 180 / 24
    angles, phi = (
        a.ravel() for a in np.meshgrid(np.rad2deg(np.arcsin(np.sqrt(squares))), azimuths, indexing="ij")
    )
    share = np.repeat(np.pi * weights / 2 / 24, 24)
    at = Directions.from_degrees(angles, np.full(angles.size, 8.0), phi, np.ones(angles.size, bool))
    assert seen[1] == pytest.approx(share @ np.asarray(diffuse_bsdf(stack, at, CONFIG, plan)), rel=2e-3)
    # By reciprocity, from the turned sample, with regular light in the same ratio of radiance.
    ratio = (index_back / index_front) ** 2
    sines = np.sin(np.deg2rad([8.0, 40.0]))
    _, back = hemispherical_power(turned(stack), sines, CONFIG)
    np.testing.assert_allclose(seen[[0, 2]], ratio * np.asarray(back), rtol=1e-6)
    _, regular = regular_power(turned(stack), sines[:1])
    assert seen[0] - seen[1] == pytest.approx(ratio * float(regular[0]), rel=1e-9)


def test_a_symmetric_sample_is_seen_through_as_it_transmits():
    matched = "refractive_index = 1.49", "refractive_index = 1.53"
    sample = sample_of(UNMATCHED, *matched, "absorption_per_mm = 0.05", "absorption_per_mm = 0.0")
    each = readings(("T_total", 8, NAN), ("T_di_8", NAN, 8), ("T_diffuse", 8, NAN), ("T_de_8", NAN, 8))
    total, seen, diffuse, seen_diffuse = evaluate(ReadingsModel(sample, each, CONFIG))
    assert (total, diffuse) == pytest.approx((seen, seen_diffuse), rel=1e-10)


@pytest.mark.parametrize("angle", [0.0, 40.0])
def test_collimated_light_follows_beer_and_lambert(angle):
    """Between equal media no interface takes part, and the slanted way counts."""
    unity = "refractive_index = 1.0"
    changes = "refractive_index = 1.49", unity, "refractive_index = 1.53", unity
    sample = sample_of(UNMATCHED, *changes, "absorption_per_mm = 0\n", "absorption_per_mm = 2.5\n")
    (predicted,) = evaluate(ReadingsModel(sample, readings(("T_collimated", angle, NAN)), CONFIG))
    depth = 1.0 * 0.05 + 0.04 * (80 + 2.5)
    assert predicted == pytest.approx(np.exp(-depth / np.cos(np.deg2rad(angle))), rel=1e-10)


def test_one_stack_is_solved_at_each_wavelength():
    each = readings(*ALL, ("T_di_8", NAN, 8), ("R_45_0", 45, 0), wavelength_nm=[500.0, 600.0] * 4)
    model = ReadingsModel(
        sample_of(edited(UNMATCHED, ("wavelength_nm = 550", "wavelength_nm = [500, 600]"))), each, CONFIG
    )
    assert model.n_stacks == 2
    assert model.wavelengths_nm == (500.0, 600.0)
    np.testing.assert_array_equal(model.wavelength_of_point_nm, each.wavelength_nm)
    assert model.coefficients({})["ink"].scattering_per_mm.shape == (2,)
    # No parameter depends on the wavelength, and the order of the readings does not matter.
    alone = ReadingsModel(model.sample, dataclasses.replace(each, wavelength_nm=np.full(8, 500.0)), CONFIG)
    np.testing.assert_allclose(evaluate(model), evaluate(alone), rtol=1e-12)


def test_totals_need_one_azimuthal_order():
    sample = sample_of()
    totals = ReadingsModel(sample, readings(ALL[0]))
    assert totals.config.n_orders == totals.sizes({}).n_orders == 1
    finer = ReadingsModel(sample, readings(ALL[0]), CONFIG)
    np.testing.assert_allclose(evaluate(totals), evaluate(finer), rtol=1e-4)


ROUGH = 'front_roughness = { density = "ggx", sigma_deg = 12 }\n'


@pytest.mark.parametrize(("faces", "angles_deg"), [("", (45, 0)), (ROUGH, (0, 45)), ("", (45, 10))])
def test_only_light_along_the_normal_needs_one_azimuthal_order(faces, angles_deg):
    ink = PRINTED_INK[PRINTED_INK.index("asymmetry_parameter") : PRINTED_INK.index("[noise]")]
    sample = sample_of(PRINTED_INK, ink, ink + faces)
    factor = ReadingsModel(sample, readings(("R_45_0", *angles_deg)), CONFIG)
    assert factor.config.n_orders == (1 if 0 in angles_deg else CONFIG.n_orders)
    theta_i, theta_o = np.array(angles_deg, float)[:, None]
    wave, behind = np.array([550.0]), np.array([False])
    all_orders = ForwardModel(sample, theta_i, theta_o, np.array([180.0]), wave, behind, CONFIG)
    assert all_orders.config.n_orders > 1
    np.testing.assert_allclose(evaluate(factor), np.pi * evaluate(all_orders), rtol=1e-12)


@pytest.mark.parametrize(
    "name", ["ink.scattering_per_mm", "ink.absorption_per_mm", "ink.asymmetry_parameter"]
)
def test_derivatives_are_those_of_finite_differences(name):
    spheres = Spheres(*(np.array([x] * 8 + [NAN]) for x in (0.96, 0.02, 0.9)))
    spheres.wall_reflectance[[2, 5]] = spheres.port_fraction[[2, 5]] = spheres.reference_reflectance[
        [2, 5]
    ] = NAN
    each = readings(*ALL, ("T_de_8", NAN, 8), ("R_di_8", NAN, 8), ("R_45_0", 45, 0), spheres=spheres)
    model = ReadingsModel(sample_of(), each, CONFIG)
    predicted = jax.jit(model.bsdf)
    value = model.sample.parameters[name].value
    exact = jax.jit(jax.jacfwd(lambda x: model.bsdf({name: x})))(value)
    step = 1e-4 * value
    differences = (predicted({name: value + step}) - predicted({name: value - step})) / (2 * step)
    np.testing.assert_allclose(exact, differences, rtol=1e-5, atol=1e-9)


class TestSpheres:
    """M = R (1 - (1 - f) r_w - f r_ref) / (1 - (1 - f) r_w - f r_dd)."""

    WALL, FRACTION = 0.96, 0.03

    def read(self, sample, row, reference, fraction=FRACTION):
        spheres = Spheres(*(np.array([x]) for x in (self.WALL, fraction, reference)))
        return float(evaluate(ReadingsModel(sample, readings(row, spheres=spheres), CONFIG))[0])

    def diffuse_reflectance(self, stack):
        """Of uniformly diffuse light, by quadrature over the squared sine."""
        nodes, weights = np.polynomial.legendre.leggauss(32)
        reflected, _ = hemispherical_power(stack, np.sqrt((nodes + 1) / 2), CONFIG)
        return weights / 2 @ np.asarray(reflected)

    @pytest.mark.parametrize(
        ("row", "reference", "is_behind"),
        [
            (("R_total", 8, NAN), 0.96, False),
            (("R_de_8", NAN, 8), 0.99, False),
            (("T_total", 8, NAN), 0.0, True),
            (("T_di_8", NAN, 8), 0.0, False),
        ],
    )
    def test_the_sample_changes_the_gain(self, row, reference, is_behind):
        sample = parse_sample(with_back(UNMATCHED, 1.2))
        model = ReadingsModel(sample, readings(row), CONFIG)
        stack, _ = stack_and_plan(model)
        facing = self.diffuse_reflectance(turned(stack) if is_behind else stack)
        wall = 1 - (1 - self.FRACTION) * self.WALL
        expected = (wall - self.FRACTION * reference) / (wall - self.FRACTION * facing)
        read = self.read(sample, row, reference) / float(evaluate(model)[0])
        assert read == pytest.approx(expected, rel=1e-4)
        assert abs(expected - 1) > 0.01

    def test_a_vanishing_port_is_ideal(self):
        sample, row = sample_of(), ("R_total", 8, NAN)
        assert self.read(sample, row, 0.9, fraction=0.0) == pytest.approx(
            float(evaluate(ReadingsModel(sample, readings(row), CONFIG))[0]), rel=1e-12
        )

    def test_a_sample_that_reflects_as_the_reference_reads_as_in_an_ideal_sphere(self):
        row = ("R_total", 8, NAN)
        model = ReadingsModel(sample_of(), readings(row), CONFIG)
        same = self.diffuse_reflectance(stack_and_plan(model)[0])
        assert self.read(model.sample, row, same) == pytest.approx(float(evaluate(model)[0]), rel=1e-5)


def test_a_sample_with_effects_is_refused(refused):
    sample = parse_sample(UNMATCHED + "\n[effects.stray_light]\nlevel_per_sr = 0.001\n")
    with refused("stray_light"):
        ReadingsModel(sample, readings(ALL[0]), CONFIG)


def test_transmission_through_an_opaque_backing_is_refused(refused):
    sample = parse_sample(UNMATCHED + '\n[backing]\nreflectance = 0.6\nside = "both"\n')
    assert np.isfinite(evaluate(ReadingsModel(sample, readings(ALL[0]), CONFIG))).all()
    with refused("backing", "side"):
        ReadingsModel(sample, readings(ALL[3]), CONFIG)
