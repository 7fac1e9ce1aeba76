"""The table of an ink whose sample declares effects: areas add up by their shares, and so do their errors."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.ink.ink_layers import find_ink
from jaxink.ink.tabulate import TableOptions, tabulate
from jaxink.ink.uncertainty import ParameterCovariance
from jaxink.sample import parse_sample
from tests.samples import PRINTED_INK

OPTIONS = TableOptions(n_theta=15, n_phi=5, accuracy=0.05)


def table(tables="", *, text=PRINTED_INK, layers=None):
    return jaxink.ink_table(parse_sample(f"{text}\n{tables}\n"), layers, options=OPTIONS)


@pytest.fixture(scope="module")
def bare():
    return table()


def assert_mixed(found, parts):
    for name in ("bsdf_per_sr", "regular"):
        mean = sum(share * getattr(part, name) for share, part in parts)
        np.testing.assert_allclose(getattr(found, name), mean, rtol=1e-9, atol=1e-15)


def test_the_instrument_is_no_part_of_an_ink(bare):
    found = table("[effects.gain]\nrelative = 0.2\n[effects.stray_light]\nlevel_per_sr = 0.1")
    assert_mixed(found, [(1, bare)])
    assert found.attrs["effects_of_the_instrument_removed"] == "gain, stray_light"


def test_patches_and_variance_of_the_thickness(bare):
    thin = table(text=PRINTED_INK.replace("thickness_um = 60", "thickness_um = 30"))
    found = table("[effects.thin_patches]\nshare = 0.3\nthickness_ratio = 0.5")
    assert_mixed(found, [(0.7, bare), (0.3, thin)])
    thick = table(text=PRINTED_INK.replace("thickness_um = 60", "thickness_um = 90"))
    # A share a on either side of the mean has the relative variance 2 a 0.5^2.
    found = table("[effects.thickness_variance]\nrelative = 0.1")
    assert_mixed(found, [(0.6, bare), (0.2, thin), (0.2, thick)])


def test_pinholes_are_clear(bare):
    found = table("[effects.pinholes]\nshare = 0.25")
    np.testing.assert_allclose(found.bsdf_per_sr, 0.75 * bare.bsdf_per_sr, rtol=1e-12)
    # Normal incidence from n = 1.5: 4 % reflected.
    added = found.regular[:, 0, 0] - 0.75 * bare.regular[:, 0, 0]
    np.testing.assert_allclose(added, 0.25 * np.array([0.04, 0.96, 0.96, 0.04]), rtol=1e-9)


def test_a_gap_of_air_belongs_to_the_ink(bare):
    gap = '[[layers]]\nname = "gap"\nkind = "clear"\nrefractive_index = 1.0\nthickness_mm = 0.01\n'
    text = PRINTED_INK.replace('[[layers]]\nname = "ink"', gap + '[[layers]]\nname = "ink"')
    apart = jaxink.ink_table(parse_sample(text), ["gap", "ink"], options=OPTIONS)
    found = table("[effects.air_gap]\nshare = 1")
    np.testing.assert_allclose(found.index_inside, 1.5)
    at = dict(theta_i_deg=30.0, theta_o_deg=np.array([10.0, 25.0]), phi_deg=45.0)
    for component in ("R_II", "T_IA", "R_AA"):
        np.testing.assert_allclose(
            found.interpolated(component, **at), apart.interpolated(component, **at), rtol=2e-3
        )
    half = table("[effects.air_gap]\nshare = 0.5")
    on_same_grid = table("[effects.air_gap]\nshare = 0")
    assert_mixed(half, [(0.5, found), (0.5, on_same_grid)])


def test_effects_that_cannot_be_taken_inside_are_named(bare):
    found = table("[effects.shadow_hiding]\namplitude = 0.2")
    assert_mixed(found, [(1, bare)])
    assert found.attrs["effects_left_out"] == "shadow_hiding"


def test_standard_errors_follow_the_shares():
    text = f"{PRINTED_INK}\n[effects.thin_patches]\nshare = 0.3\nthickness_ratio = 0.5\n"
    sample = parse_sample(text)
    names = ("thin_patches.share", "thin_patches.thickness_ratio", "ink.scattering_per_mm")
    deviation = np.array([0.02, 0.05, 3.0])

    def at(values):
        changed = sample.parameters
        for name, value in values.items():
            changed = changed.replace(name, value=value)
        ink = find_ink(dataclasses.replace(sample, parameters=changed))
        known = ParameterCovariance(names, np.diag(deviation**2), "test") if not values else None
        return tabulate(ink, (550.0,), known or ParameterCovariance.none("test"), OPTIONS)

    found = at({})
    variance = 0.0
    for name, error in zip(names, deviation, strict=True):
        step = 0.05 * error
        start = sample.parameters[name].value
        up, down = at({name: start + step}), at({name: start - step})
        variance = variance + ((up.bsdf_per_sr - down.bsdf_per_sr) / (2 * step) * error) ** 2
    np.testing.assert_allclose(found.bsdf_standard_error_per_sr, np.sqrt(variance), rtol=1e-4)
