"""Effects that a sample file declares: written, read and predicted, each is the effect that was found."""

import dataclasses
import json

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import jaxink
from benchmarks.validation.declared_effects import (
    CONFIG,
    MIE,
    forms_by_program,
    sample_for,
    scene_of,
    strengths,
)
from jaxink.effects import (
    CATALOGUE,
    AugmentedModel,
    ReadingEffect,
    declare,
    declared_effects,
    model_at,
)
from jaxink.errors import InputRefusedError
from jaxink.measurement import GonioData
from jaxink.model.forward import evaluate
from jaxink.numerics.precision import computing
from jaxink.sample import parse_sample, sample_from_dict, sample_text, sample_to_dict
from jaxink.sample.effect_schema import EFFECTS, ELSEWHERE
from tests.samples import PRINTED_INK, STRAY_LIGHT

PROGRAMS = forms_by_program()


def test_every_effect_of_the_catalogue_can_be_declared():
    covered = {form.name for forms in PROGRAMS.values() for form in forms}
    assert covered == {effect.name for effect in CATALOGUE}
    assert {*EFFECTS, *ELSEWHERE} == covered
    assert not EFFECTS.keys() & ELSEWHERE.keys()


def test_the_screen_sees_every_effect_with_a_program_of_its_own():
    # It takes differences between programs, which are zero where a setting has no strength.
    own = [form for forms in PROGRAMS.values() for form in forms if form.own_program and form.is_screened]
    assert own
    unseen = [
        form for form in own for s in form.settings if s.get(form.strength.name, form.neutral) == form.neutral
    ]
    assert not unseen


def _names(program):
    return " ".join([*program, *(form.name for form in PROGRAMS[program])])


@pytest.mark.parametrize("program", PROGRAMS, ids=_names)
def test_declared_written_and_read_an_effect_predicts_the_same(program):
    forms = tuple(PROGRAMS[program])
    base = sample_for(program[0], forms)
    columns, scene = scene_of(base)
    values = strengths(forms)
    declared = declare(base, forms, values)
    back = parse_sample(sample_text(declared))
    assert back.effects == declared.effects
    assert back.layers == declared.layers
    archived = sample_from_dict(json.loads(json.dumps(sample_to_dict(declared))))
    assert archived == declared
    with computing():
        model = eqx.filter_jit(AugmentedModel(base, forms, scene, CONFIG).bsdf)
        neutral = {form.strength.name: jnp.asarray(form.neutral) for form in forms}
        values = {name: jnp.asarray(value) for name, value in values.items()}
        found, without = (np.asarray(model(v)) for v in (values, values | neutral))
    read = evaluate(model_at(back, columns, scene.row, CONFIG))
    np.testing.assert_allclose(read, found, rtol=1e-9)
    assert np.max(np.abs(read / without - 1)) > 1e-6


def test_a_declared_effect_is_free_fixed_or_tied():
    text = STRAY_LIGHT + (
        "\n[effects.gain]\nrelative = 0.1\n[effects.side_gain]\nrelative = { tie = 'gain.relative / 2' }\n"
        "[effects.stray_light]\nlevel_per_sr = { value = 0.01, free = true, min = 0, max = 0.02 }\n"
    )
    sample = parse_sample(text)
    assert sample.parameters["stray_light.level_per_sr"].free
    columns, scene = scene_of(dataclasses.replace(sample, wavelengths_nm=(550.0,)))
    bare = evaluate(model_at(parse_sample(STRAY_LIGHT), columns, scene.row, CONFIG))
    reflects = ~columns[4]
    expected = bare * 1.1 * np.where(reflects, 1.05, 1.0) + 0.01
    np.testing.assert_allclose(evaluate(model_at(sample, columns, scene.row, CONFIG)), expected, rtol=1e-12)


def test_a_model_without_effects_does_not_drop_those_declared(told):
    sample = parse_sample(PRINTED_INK + "\n[effects.gain]\nrelative = 0.1\n")
    columns, _ = scene_of(sample)
    with pytest.raises(InputRefusedError) as problem:
        jaxink.ForwardModel(sample, *columns, config=CONFIG)
    told(str(problem.value))
    data = GonioData(*columns, np.ones(columns[0].size))
    assert isinstance(jaxink.forward_model(sample, data, CONFIG), AugmentedModel)


def test_an_effect_of_ones_own_is_kept_by_name(told):
    class Vignetting(ReadingEffect):
        name, statement = "vignetting", "the detector sees less at grazing angles"
        terms = (jaxink.Parameter("vignetting.loss", 0.0, True, 0.0, 1.0),)

        def change(self, predicted, values, field):
            return predicted * (1 - values["vignetting.loss"] * (field.scene.theta_o_deg / 90) ** 4)

    base = parse_sample(PRINTED_INK)
    declared = declare(base, (Vignetting(),), {"vignetting.loss": 0.3})
    text = sample_text(declared)
    with pytest.raises(InputRefusedError) as problem:
        parse_sample(text)
    told(str(problem.value))
    assert parse_sample(text, effects=[Vignetting]) == declared
    plain = json.loads(json.dumps(sample_to_dict(declared)))
    nameless = sample_from_dict(plain)
    with pytest.raises(InputRefusedError) as problem:
        declared_effects(nameless)
    told(str(problem.value))
    assert declared_effects(sample_from_dict(plain, effects=[Vignetting])) == (Vignetting(),)


@pytest.mark.parametrize(
    ("table", "word"),
    [
        ("[effects.rough_ink]\nsigma_deg = 3", "back_roughness"),
        ("[effects.stray_ligth]\nlevel_per_sr = 0.1", "stray_light"),
        ("[effects.stray_light]\nlevel = 0.1", "level_per_sr"),
        ("[effects.stray_light]", "level_per_sr"),
        ("[effects.stray_light]\nlevel_per_sr = { per_wavelength = true, value = 0.1 }", "wavelength"),
        ("[effects.stray_light]\nlevel_per_sr = -0.1", "0"),
        ("[effects.thin_patches]\nshare = 0.1\nlayer = 'glass'", "ink"),
        ("[effects.top_coat]\nshare = 0.1\nposition = 7", "position"),
        ("[effects.dispersion]\nb_um2 = 0.01", "middle_nm"),
        ("[effects]\ngain = 0.1", "[effects.gain]"),
    ],
)
def test_bad_declarations_are_named(table, word, told):
    with pytest.raises(InputRefusedError) as problem:
        parse_sample(f"{PRINTED_INK}\n{table}\n")
    assert word in str(problem.value)
    told(str(problem.value))


@pytest.mark.parametrize(
    ("text", "table"),
    [
        (MIE, "[effects.air_gap]\nshare = 0.1"),
        (PRINTED_INK, "[effects.fluorescence]\nquantum_yield = 0.1\nemission = 1"),
        (
            PRINTED_INK.replace("thickness_um = 60", "thickness_um = { tie = '60' }"),
            "[effects.thin_patches]\nshare = 0.1",
        ),
    ],
)
def test_effects_that_a_sample_cannot_have(text, table, told):
    sample = parse_sample(f"{text}\n{table}\n")
    with pytest.raises(InputRefusedError) as problem:
        declared_effects(sample)
    told(str(problem.value))
