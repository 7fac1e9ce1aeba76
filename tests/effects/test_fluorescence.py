"""Fluorescence: energy, our own Monte Carlo, forms, and the sample file."""

import dataclasses
import json

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.montecarlo import Absorbed, HenyeyGreenstein, Layer, emitted, simulate
from benchmarks.montecarlo import Sample as Simulated
from benchmarks.validation.fluorescence import inks
from jaxink.effects import AugmentedModel, Case, Scene, declared_effects
from jaxink.effects.fluorescence import Fluorescence, emission_of
from jaxink.effects.scene import Surroundings
from jaxink.errors import InputRefusedError
from jaxink.model.forward import evaluate
from jaxink.numerics.precision import computing
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.optics.layers import ClearLayer, ScatteringLayer
from jaxink.particles import phase_function
from jaxink.sample import parse_sample, sample_text
from jaxink.solver.bsdf import hemispherical_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.fluence_rate import DEPTH_WEIGHTS, fluence
from jaxink.solver.plan import plan_channels
from jaxink.solver.stack import Stack

CONFIG = SolverConfig(12, 10, 16, 4)
# What the sample file of a fluorescent ink says; excited at two wavelengths, emitting at the third.
EMITTING = """
[effects.fluorescence]
quantum_yield = {value}
excitation = {{ per_wavelength = true, value = [1, 1, 0] }}
emission = {{ per_wavelength = true, value = [0, 0, 1] }}
"""


def stack(thickness, albedo):
    """A plate and an ink of another index."""
    phase = phase_function.HenyeyGreenstein(0.6)
    return Stack((ClearLayer(1.5, 0.0), ScatteringLayer(1.6, thickness, albedo, phase)), 1.0, 1.0)


def known(text, waves=(405.0, 450.0, 520.0)):
    """The green ink at its true values, at some of its wavelengths."""
    absorption = inks.INKS["green"][0]
    at = [inks.WAVES_NM.index(nm) for nm in waves]
    each = {
        "scattering_per_mm": [inks.SCATTERING_PER_MM[k] for k in at],
        "absorption_per_mm": [absorption[k] for k in at],
    }
    numbers = {"relative": 0.01, "floor": 0, "scan": 0, "waves": list(waves), "powers": [1.0] * len(at)}
    lines = [
        f"{key} = {{ per_wavelength = true, value = {each[key]} }}"
        if (key := line.split(" ")[0]) in each and "free" in line
        else "asymmetry_parameter = 0.6"
        if line.startswith("asymmetry")
        else line
        for line in inks.TEXT.format(**numbers).splitlines()
    ]
    return parse_sample("\n".join(lines) + text)


def one_point(nm=600.0):
    return Scene.of(*(np.array([x]) for x in (0.0, 20.0, 0.0, nm, 0.0)), np.zeros(1))


def test_absorbed_light_is_what_does_not_leave():
    absorbing = stack(5.0, 0.9)
    kappa = np.sin(np.deg2rad([0.0, 30.0, 75.0]))
    with computing():
        found = fluence(absorbing, plan_channels(absorbing), CONFIG, jnp.asarray(kappa), (1,))
        reflected, transmitted = hemispherical_power(absorbing, kappa, CONFIG)
    absorbed = 5.0 * 0.1 * DEPTH_WEIGHTS @ np.asarray(found.from_front)
    np.testing.assert_allclose(absorbed, 1 - np.asarray(reflected + transmitted), rtol=1e-4)


def test_without_absorption_every_emitted_photon_leaves():
    """The radiance of an isotropic source at each depth, integrated over both hemispheres."""
    clear = stack(5.0, 1.0)
    cosine, weight = gauss_legendre_unit(24)
    with computing():
        kappa = jnp.asarray(np.sqrt(1 - cosine**2))
        found = fluence(clear, plan_channels(clear), CONFIG, kappa, (1,))
    both = np.asarray(found.from_front + found.from_back)
    left = 2 * np.pi * both @ (weight * cosine) / (4 * np.pi * 1.6**2)
    np.testing.assert_allclose(left, 1.0, rtol=1e-4)


def test_emitted_light_is_that_of_the_monte_carlo():
    kept = json.loads(inks.FILE.read_text(encoding="utf-8"))["green"]["emitted"]
    rows = [
        (i, signed, side)
        for i in inks.INCIDENCES_DEG
        for signed, side in zip(inks.TWICE, inks.SIDES, strict=True)
    ]
    theta_i, signed, side = (np.array(column) for column in zip(*rows, strict=True))
    columns = theta_i, np.abs(signed), np.where(signed < 0, 0.0, 180.0), np.full(signed.size, 520.0), side
    scene = Scene.of(*columns, np.arange(signed.size))
    model = AugmentedModel(known(EMITTING.format(value=1)), (), scene, CONFIG)
    found = evaluate(model) - evaluate(AugmentedModel(known(""), (), scene, CONFIG))
    expected, variance = np.zeros(signed.size), np.zeros(signed.size)
    for nm in (405.0, 450.0):
        parts = [kept[f"{i:g} {nm:g} 520"] for i in inks.INCIDENCES_DEG]
        expected += nm / 520 * np.concatenate([part["bsdf"] for part in parts])
        variance += (nm / 520 * np.concatenate([part["error"] for part in parts])) ** 2
    error = np.sqrt(variance)
    assert np.max(np.abs(found - expected) / error) < 4.5
    # The photons of one incidence are shared by all its directions.
    assert abs(np.mean(found / expected) - 1) < 3 * np.median(error / expected) / np.sqrt(3)


def test_the_monte_carlo_counts_photons():
    """With a yield of one and nothing absorbed at the emitted wavelength, all absorbed photons leave."""
    phase, absorbed = HenyeyGreenstein(0.5), Absorbed()
    exciting, emitting = (
        Simulated((Layer(1.5, 0.05, 60.0, absorption, phase),)) for absorption in (8.0, 0.0)
    )
    result = simulate(exciting, 20.0, 4000, 5, absorbed=absorbed)
    light = emitted(emitting, absorbed, 1, 4000, 6)
    n_absorbed = absorbed.in_layer(1)[0].size / 4000
    left = sum(float(power.mean()) for power in light.powers.values())
    assert left == pytest.approx(n_absorbed, rel=1e-12)
    assert n_absorbed == pytest.approx(float(result.powers["absorbed"].mean()), rel=0.06)


def test_forms_excite_at_the_shortest_wavelengths():
    sample = inks.declared()
    forms = Fluorescence.forms(Case(sample, one_point()))
    assert [form.n_exciting for form in forms] == [1, 2, 3, 4]
    assert {form.carrier for form in forms} == {forms[0].carrier}
    second = forms[1]
    names = [term.name for term in second.terms]
    assert names == ["fluorescence.quantum_yield", "fluorescence.emission@520", "fluorescence.emission@580"]
    for setting in second.settings:
        values = {name: jnp.asarray(value) for name, value in setting.items()}
        with computing():
            coupled = np.asarray(second.couplings(values).absorbed)
        nm = np.array(inks.WAVES_NM)
        # Photons emitted for each that is absorbed, from powers over the power of the lamp there.
        photons = coupled * nm / nm[:, None]
        np.testing.assert_allclose(photons.sum(axis=1), [0.1, 0.1, 0, 0, 0], atol=1e-12)
        assert np.all(photons[:, :2] == 0)
    shortest = dataclasses.replace(sample, illumination=((300.0, 700.0), (1.0, 1.0)))
    assert [form.n_exciting for form in Fluorescence.forms(Case(shortest, one_point()))] == [0, 1, 2, 3, 4]


def test_a_broadband_detector_sees_all_emission_at_the_exciting_wavelength():
    sample = dataclasses.replace(inks.declared(), detector_mode="broadband", illumination=None)
    forms = Fluorescence.forms(Case(sample, one_point()))
    assert [form.n_exciting for form in forms] == [1, 2, 3, 4, 5]
    assert all(len(form.terms) == 1 for form in forms)
    longest = {name: jnp.asarray(value) for name, value in forms[-1].settings[0].items()}
    with computing():
        coupled = np.asarray(forms[-1].couplings(longest).absorbed)
    # Nothing measured is longer: all is emitted beyond.
    np.testing.assert_allclose(coupled[:, -1], 0.1)
    assert np.all(coupled[:, :-1] == 0)


def test_a_declaration_keeps_what_is_free_at_some_wavelengths():
    table = EMITTING.format(value="{ free = true, min = 0, max = 1, value = 0.2 }").replace(
        "value = [0, 0, 1]", "free = [false, true, false], min = 0, max = 1, value = [0, 0.5, 1]"
    )
    sample = known(table)
    free = [p.name for p in sample.parameters.free]
    assert free == ["fluorescence.quantum_yield", "fluorescence.emission@450"]
    assert [p.name for p in parse_sample(sample_text(sample)).parameters.free] == free
    for wrong in ("free = [false, true]", "free = [1, 0, 1]"):
        with pytest.raises(InputRefusedError, match=r"fluorescence\.emission: free"):
            known(table.replace("free = [false, true, false]", wrong))


def test_emission_is_known_at_the_wavelengths_of_the_file_only():
    scene = one_point()
    sample = known(EMITTING.format(value=0.1))
    with pytest.raises(InputRefusedError, match="600 nm"):
        emission_of(
            *declared_effects(sample), sample, sample, one_point().all_directions(Surroundings.NOTHING), None
        )
    lateral = dataclasses.replace(sample, beam_diameter_mm=2.0, detector_diameter_mm=4.0)
    assert isinstance(Fluorescence.forms(Case(lateral, scene)), str)
