"""Effects: zero at the declared model, linear there, and what they say they are."""

import dataclasses

import numpy as np
import pytest

from jaxink.diagnosis.search.candidate_objective import CandidateObjective
from jaxink.effects import (
    CATALOGUE,
    AugmentedModel,
    Case,
    Effect,
    ReadingEffect,
    Scene,
    effects_for,
    forward_model,
)
from jaxink.effects.geometry import Pinholes, ThicknessVariance, ThinPatches, UndeclaredBacking
from jaxink.effects.instrument import AngleOffset, Blur, Gain, IncidenceAngle, StrayLight
from jaxink.effects.surfaces import AirGap, TopCoat, WaveSurface
from jaxink.effects.volume import DepthGradient, SecondLobe, SurfaceLayer
from jaxink.measurement import FitNoise, GonioData
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.numerics.precision import computing
from jaxink.sample import Parameter, parse_sample
from jaxink.solver.config import SolverConfig
from tests.samples import PRINTED_INK, edited

SIZES = SolverConfig(10, 8, 16, 8)
# Keys of effects in the truth files of the simulated measurements, and the effects that stand for them.
SIMULATED = {
    "E1": ("rough_ink", "rough_plate", "rough_contact"),
    "E2": ("polydispersity",),
    "E3": ("structure_factor",),
    "E4": ("thin_patches",),
    "E5": ("backing",),
    "E6": ("angle_offset",),
    "E7": ("blur",),
    "E8": ("stray_light", "signal_floor"),
    "E9": ("lateral_loss",),
    "E10": ("second_lobe",),
    "E11": ("plate_absorption",),
    "E12": ("fluorescence",),
    "E13": ("gain", "side_gain"),
    "E14": ("binder_index",),
    "E15": ("air_gap",),
    "E16": ("incidence_angle",),
}


def directions():
    """Two incidences, both sides, in the plane of incidence."""
    theta_i, signed, side = np.meshgrid([10.0, 50.0], np.arange(-72.0, 73.0, 12.0), [0.0, 1.0], indexing="ij")
    theta_i, signed, side = theta_i.ravel(), signed.ravel(), side.ravel()
    return theta_i, np.abs(signed), np.where(signed >= 0, 180.0, 0.0), np.full(signed.size, 550.0), side > 0.5


@pytest.fixture(scope="module")
def sample():
    return parse_sample(PRINTED_INK)


@pytest.fixture(scope="module")
def scene():
    return Scene.of(*directions(), np.arange(directions()[0].size))


def predicted(sample, columns=None, values=None):
    """By the forward model alone."""
    if values:
        for name, value in values.items():
            table = sample.parameters.replace(name, value=value)
            sample = dataclasses.replace(sample, parameters=table)
    return evaluate(ForwardModel(sample, *(columns or directions()), SIZES))


def bench(sample, scene, effects, columns=None):
    columns = columns or directions()
    data = GonioData(*columns, predicted(sample, columns))
    noise = FitNoise(0.005 * data.bsdf_per_sr, 0.002, "declared")
    with computing():
        return CandidateObjective(sample, tuple(effects), data, noise, SIZES, scene, 5)


# One program has all of these effects.
SHARED = (
    *(AngleOffset(), IncidenceAngle(), Blur(True), Gain(), StrayLight(), Pinholes()),
    *(SecondLobe("ink"), UndeclaredBacking()),
)


@pytest.fixture(scope="module")
def instrument(sample, scene):
    """A bench with the effects that share one program."""
    return bench(sample, scene, SHARED)


def at(bench, **values):
    with computing():
        return bench.predict({k.replace("__", "."): v for k, v in values.items()})


def test_nothing_changes_at_zero(instrument, sample):
    np.testing.assert_allclose(at(instrument), predicted(sample), rtol=1e-10)


@pytest.mark.parametrize("effect", SHARED, ids=lambda effect: effect.name)
def test_derivative_at_zero_is_that_of_a_small_step(instrument, effect):
    strength = effect.strength
    # One-sided strengths leave zero upwards; the second-order term of the difference is taken out.
    step = 1e-3 * (strength.maximum - strength.value)
    with computing():
        jacobian, _ = instrument.jacobian({}, (*instrument.base_free, strength.name))
        first, second = (instrument.predict({strength.name: k * step}) for k in (1, 2))
        here = instrument.predict({})
        slope = (4 * first - second - 3 * here) / (2 * step)
        expected = instrument.whiten(here, slope)
    direction = jacobian[:, -1]
    assert np.linalg.norm(direction) > 0
    assert np.linalg.norm(direction - expected) < 1e-3 * np.linalg.norm(expected)


def test_gain_stray_light_and_pinholes(instrument, sample):
    f = predicted(sample)
    np.testing.assert_allclose(at(instrument, gain__relative=0.03), 1.03 * f, rtol=1e-9)
    np.testing.assert_allclose(at(instrument, stray_light__level_per_sr=0.02), f + 0.02, rtol=1e-9)
    np.testing.assert_allclose(at(instrument, pinholes__share=0.1), 0.9 * f, rtol=1e-9)


def test_angle_offset_is_the_model_at_the_true_angles(instrument, sample):
    theta_i, theta_o, phi, wave, side = directions()
    signed = np.where(phi > 90, theta_o, -theta_o) + np.where(side, -0.8, 0.8)
    true = predicted(sample, (theta_i, np.abs(signed), np.where(signed >= 0, 180.0, 0.0), wave, side))
    np.testing.assert_allclose(at(instrument, angle_offset__angle_deg=0.8), true, rtol=3e-4)


def test_incidence_offset_is_the_model_at_the_true_incidence(instrument, sample):
    theta_i, *rest = directions()
    true = predicted(sample, (theta_i + 0.7, *rest))
    np.testing.assert_allclose(at(instrument, incidence_angle__angle_deg=0.7), true, rtol=1e-4)


def test_blur_keeps_a_flat_intensity_and_shows_the_foot_of_the_regular_peak(instrument, sample):
    f = predicted(sample)
    blurred = at(instrument, blur__core_variance_deg2=0.5)
    apart = np.asarray(instrument.objective.model.scene.from_forward_deg)
    # Far from the peak a narrow core does nothing where the intensity is nearly straight.
    far = (apart > 10) & (directions()[1] < 40)
    np.testing.assert_allclose(blurred[far], f[far], rtol=2e-3)
    wings = at(instrument, blur__wing_share=0.05, blur__wing_half_width_deg=4.0) / f
    reflected = ~directions()[4]
    nearest = np.flatnonzero(reflected)[np.argmin(apart[reflected])]
    assert wings[nearest] > 1.02


def test_second_lobe_and_backing_are_those_of_the_sample_file(instrument, sample):
    two = PRINTED_INK.replace(
        '"henyey_greenstein"',
        '"two_term_henyey_greenstein"\nsecond_weight = 0.1\nsecond_asymmetry_parameter = -0.4',
    )
    backed = PRINTED_INK + '[backing]\nreflectance = 0.3\nside = "R"\n'
    values = {"ink__second_weight": 0.1, "ink__second_asymmetry_parameter": -0.4}
    np.testing.assert_allclose(at(instrument, **values), predicted(parse_sample(two)), rtol=1e-9)
    expected = predicted(parse_sample(backed))
    np.testing.assert_allclose(at(instrument, backing__reflectance=0.3), expected, rtol=1e-9)


def test_areas_are_mixed(sample, scene):
    effects = (ThinPatches("ink"), ThicknessVariance("ink"), AirGap(1))
    mixed = bench(sample, scene, effects)
    thick, thin, thicker = (predicted(sample, values={"ink.thickness_um": t}) for t in (60.0, 30.0, 90.0))
    patches = at(mixed, thin_patches__share=0.2, thin_patches__thickness_ratio=0.5)
    np.testing.assert_allclose(patches, 0.8 * thick + 0.2 * thin, rtol=1e-8)
    # Areas half as thick and half as thick again, 0.1 each: a relative variance of 0.05.
    varied = at(mixed, thickness_variance__relative=0.05)
    np.testing.assert_allclose(varied, 0.8 * thick + 0.1 * thin + 0.1 * thicker, rtol=1e-8)
    gap = PRINTED_INK.replace(
        '[[layers]]\nname = "ink"',
        '[[layers]]\nname = "gap"\nkind = "clear"\nrefractive_index = 1.0\nthickness_mm = 0.01\n'
        '[[layers]]\nname = "ink"',
    )
    apart = predicted(parse_sample(gap))
    np.testing.assert_allclose(at(mixed, air_gap__share=0.3), 0.7 * thick + 0.3 * apart, rtol=1e-8)


def test_depth_gradient_moves_scatterers_and_keeps_their_number(sample, scene):
    (effect,) = DepthGradient.forms(Case(sample, scene))
    graded = bench(sample, scene, (effect,))
    np.testing.assert_allclose(at(graded), predicted(sample), rtol=1e-6)
    up, down = at(graded, depth_gradient__slope=-0.8), at(graded, depth_gradient__slope=0.8)
    reflected = ~directions()[4]
    # More scatterers on the lit side send more back, and what passes hardly changes.
    assert np.all(up[reflected] > down[reflected])
    change = np.abs(up / down - 1)
    assert change[~reflected].max() < 0.5 * change[reflected].max()


def test_a_gradient_of_the_phase_function_is_two_layers_with_other_lobes(sample):
    graded = parse_sample(PRINTED_INK + "[effects.depth_gradient]\nslope = 0\nasymmetry_slope = 0.6\n")
    plate_and_ink, noise = PRINTED_INK.replace("thickness_um = 60", "thickness_um = 30").split("[noise]")
    lower = plate_and_ink[plate_and_ink.rindex("[[layers]]") :].replace('"ink"', '"lower"')
    halves = parse_sample(f"{plate_and_ink}{lower}[noise]{noise}")
    # At g = 0.5 the ratio (1 - g) / (1 + g) is a third; the slope makes it 0.7 and 1.3 times that.
    values = {"ink.asymmetry_parameter": 2.3 / 3.7, "lower.asymmetry_parameter": 1.7 / 4.3}
    expected = predicted(halves, values=values)
    columns = directions()
    found = evaluate(forward_model(graded, GonioData(*columns, expected), SIZES))
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    assert np.max(np.abs(expected / predicted(sample) - 1)) > 0.01


def test_other_effects_meet_a_graded_ink_as_a_whole(sample, scene):
    (gradient,) = DepthGradient.forms(Case(sample, scene))
    slope = {"depth_gradient__slope": 0.8}
    both = bench(sample, scene, (gradient, ThinPatches("ink"), TopCoat(2)))
    thin = dataclasses.replace(sample, parameters=sample.parameters.replace("ink.thickness_um", value=30.0))
    graded = [at(bench(one, scene, (gradient,)), **slope) for one in (sample, thin)]
    patches = at(both, **slope, thin_patches__share=0.2, thin_patches__thickness_ratio=0.5)
    np.testing.assert_allclose(patches, 0.8 * graded[0] + 0.2 * graded[1], rtol=1e-8)
    # A film of the ink's own index on its outer face, behind both halves, does nothing.
    coated = at(both, **slope, top_coat__share=1.0, top_coat__refractive_index=1.5)
    np.testing.assert_allclose(coated, graded[0], rtol=1e-3)


def test_halves_do_not_follow_a_parameter_of_each_wavelength(scene, told):
    text = PRINTED_INK.replace("max = 50, value = 1 }", "max = 50, value = 1, per_wavelength = true }")
    told(DepthGradient.forms(Case(parse_sample(text), scene)))


def test_the_screen_looks_at_waves_too_low_to_saturate():
    at_two = [np.concatenate([column, column]) for column in directions()]
    at_two[3] = np.repeat([450.0, 650.0], at_two[0].size // 2)
    two = parse_sample(PRINTED_INK.replace("wavelength_nm = 550", "wavelength_nm = [450, 650]"))
    colours = Scene.of(*at_two, np.arange(at_two[0].size))
    (effect,) = WaveSurface.forms(Case(two, colours))
    waves = bench(two, colours, (effect,), at_two)
    height, length, _ = (term.name for term in effect.terms)
    for setting in effect.settings[:2]:
        screened = setting[height]
        heights = (0.05 * screened, 0.2 * screened, screened)
        with computing():
            lowest, low, high = (waves.predict({height: h, length: setting[length]}) for h in heights)
        # The smooth face is where the squared height is zero, which it grows with.
        here = (high - low) / (1 - 0.2**2)
        there = (low - lowest) / (0.2**2 - 0.05**2)
        assert np.linalg.norm((here - there) / high) < 0.05 * np.linalg.norm(there / high)


def test_every_effect_of_the_catalogue_applies_or_says_why_not(sample, scene):
    listed = effects_for(Case(sample, scene))
    names = {effect.name for effect in listed.forms}
    assert names | set(listed.not_testable) == {effect.name for effect in CATALOGUE}
    assert not names & set(listed.not_testable)
    assert all(len(reason) > 10 for reason in listed.not_testable.values())
    assert all(effect.statement for effect in CATALOGUE)


def test_every_simulated_effect_is_in_the_catalogue():
    assert set(SIMULATED) == {f"E{number}" for number in range(1, 17)}
    names = {effect.name for effect in CATALOGUE}
    assert all(set(effects) <= names for effects in SIMULATED.values())


def test_an_effect_of_ones_own_is_one_small_class(sample, scene):
    class Vignetting(ReadingEffect):
        name, statement = "vignetting", "the detector sees less of the sample at grazing angles"
        terms = (Parameter("vignetting.loss", 0.0, True, 0.0, 1.0),)

        def change(self, predicted, values, field):
            return predicted * (1 - values["vignetting.loss"] * (field.scene.theta_o_deg / 90) ** 4)

    mine = bench(sample, scene, (Vignetting(),))
    expected = predicted(sample) * (1 - 0.2 * (directions()[1] / 90) ** 4)
    np.testing.assert_allclose(at(mine, vignetting__loss=0.2), expected, rtol=1e-9)
    assert effects_for(Case(sample, scene), (Vignetting,)).forms[0].name == "vignetting"


def test_an_effect_of_no_kind_is_refused_by_name(sample, scene, refused):
    class Vignetting(Effect):
        name, terms = "vignetting", ()

    class Dirt(ReadingEffect):
        name, terms = "dirt", ()

    for effect, missing in ((Vignetting, "program"), (Dirt, "change")):
        with refused(f"'{effect.name}'", missing):
            effects_for(Case(sample, scene), (effect,))


def test_a_special_form_is_computed_by_the_general_one(sample):
    at = directions()
    scene = Scene.of(*at, np.arange(at[0].size))
    with computing():
        model = AugmentedModel(sample, (Blur(False), Gain(), Blur(True)), scene, SIZES)
        alone = AugmentedModel(sample, (Blur(False),), scene, SIZES)
    assert model.effects == (Blur(True), Gain())
    assert alone.effects == (Blur(True),)
    assert {term.name for term in Blur(True).terms} <= set(alone.sample.parameters)


OPAQUE_INK = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.2
thickness_um = "opaque"
single_scattering_albedo = { value = 0.99, free = true, min = 0.9, max = 1 }
asymmetry_parameter = { value = 0.3, free = true, min = -0.5, max = 0.9 }
[noise]
relative = 0.01
"""


def test_a_surface_layer_is_a_layer_in_front_of_an_opaque_ink():
    """As in a sample file with this layer; a thickness of 0 is the ink alone."""
    sample = parse_sample(OPAQUE_INK)
    columns = [c[~directions()[4]] for c in directions()]
    scene = Scene.of(*columns, np.arange(columns[0].size))
    (effect,) = SurfaceLayer.forms(Case(sample, scene))
    layered = bench(sample, scene, (effect,), columns)
    declared = predicted(sample, columns)
    np.testing.assert_allclose(at(layered), declared, rtol=1e-6)
    written = edited(
        OPAQUE_INK,
        (
            "[[layers]]",
            '[[layers]]\nname = "skin"\nkind = "scattering"\nphase_function = "henyey_greenstein"\n'
            "refractive_index = 1.2\nthickness_um = 0.5\nscattering_per_mm = 900\nabsorption_per_mm = 100\n"
            "asymmetry_parameter = 0.7\n[[layers]]",
        ),
    )
    strength = {"optical_thickness": 0.5, "asymmetry_parameter": 0.7, "single_scattering_albedo": 0.9}
    found = at(layered, **{f"surface_layer__{key}": value for key, value in strength.items()})
    expected = predicted(parse_sample(written), columns)
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    assert np.abs(found / declared - 1).max() > 0.1


def test_only_an_opaque_ink_without_particles_has_a_surface_layer(sample, scene, told):
    told(SurfaceLayer.forms(Case(sample, scene)))
