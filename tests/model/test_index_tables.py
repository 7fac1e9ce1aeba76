"""Rough faces tabulated: over a free refractive index for a scan, and at each of several fixed ones."""

import itertools

import equinox as eqx
import jax
import numpy as np
import pytest

import jaxink
from jaxink.model import tables
from jaxink.numerics.precision import computing
from jaxink.solver.config import SolverConfig
from jaxink.surfaces.table import IndexTable, pieces_of

PLATE = 1.5
SAMPLE = """
schema_version = 1
wavelength_nm = {waves}
[[layers]]
name = "plate"
kind = "clear"
refractive_index = {plate}
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = {index}
thickness_um = 20
asymmetry_parameter = 0.6
scattering_per_mm = 80
absorption_per_mm = 1
back_roughness = {roughness}
"""
FREE_INDEX = "{ free = true, value = 1.52, min = 1.45, max = 1.6 }"
ONE = '{ density = "ggx", sigma_deg = { free = true, value = 8, min = 4, max = 16 } }'
TWO = (
    '{ density = "ggx", sigma_deg = 6, second_density = "beckmann", second_sigma_deg = 12, '
    "second_weight = { free = true, value = 0.4, min = 0, max = 1 } }"
)
CONFIG = SolverConfig(8, 6, 12, 4)


def model(roughness=ONE, plate=f"{PLATE}", index=FREE_INDEX, waves=(550,)):
    text = SAMPLE.format(roughness=roughness, plate=plate, index=index, waves=list(waves))
    sides = itertools.product(waves, (0.0, 30.0), (5.0, 25.0, 50.0, 70.0), (0.0, 180.0), (False, True))
    wave, into, out, phi, through = map(np.array, zip(*sides, strict=True))
    return jaxink.ForwardModel(jaxink.parse_sample(text), into, out, phi, wave, through, CONFIG)


@pytest.fixture(scope="module")
def both():
    with computing():
        plain = model()
        return plain, plain.tabulated()


def test_range_is_divided_where_channels_change():
    """At the indices of other media, and where a scattering medium is hardly denser than its neighbour."""
    pieces = pieces_of((1.45, 1.6), True, [(1.0, False), (PLATE, False)])
    assert [p.low for p in pieces] == pytest.approx([1.45, PLATE, PLATE * 1.0003])
    assert [p.high for p in pieces] == pytest.approx([PLATE, PLATE * 1.0003, 1.6])
    assert [p.low for p in pieces_of((1.45, 1.6), False, [(PLATE, True)])] == pytest.approx(
        [1.45, PLATE / 1.0003, PLATE]
    )
    assert len(pieces_of((1.45, 1.49), True, [(PLATE, False)])) == 1
    assert all(piece.low < min(piece.nodes(3)) < max(piece.nodes(3)) < piece.high for piece in pieces)


@pytest.mark.parametrize("index", [1.4999, 1.5002, 1.58])
def test_it_is_the_model_of_a_fixed_index(both, index):
    """The range contains the plate's index."""
    with computing():
        fixed = model(index=f"{index}")
        for sigma_deg in (4.0, 11.0):
            angle = {"ink.back_roughness.sigma_deg": np.asarray(sigma_deg)}
            given = {"ink.refractive_index": np.asarray(index), **angle}
            np.testing.assert_allclose(bsdf(both[1], given), bsdf(fixed, angle), rtol=1.5e-3)


@pytest.mark.parametrize("index", [PLATE, PLATE * 1.0003])
def test_it_is_continuous_where_channels_change(both, index):
    with computing():
        below, above = (
            bsdf(both[1], {"ink.refractive_index": np.asarray(index + step)}) for step in (-1e-9, 1e-9)
        )
    np.testing.assert_allclose(below, above, rtol=1e-3)


def test_derivatives_are_exact(both):
    """Unlike the quadrature over the facets, the table is smooth."""
    values = {"ink.refractive_index": np.asarray(1.54), "ink.back_roughness.sigma_deg": np.asarray(7.0)}
    with computing():
        found = jax.jit(jax.jacfwd(both[1].bsdf))(values)
        for name, step in zip(values, (1e-4, 1e-3), strict=True):
            above, below = (bsdf(both[1], {**values, name: values[name] + h}) for h in (step, -step))
            expected = np.asarray(above - below) / (2 * step)
            np.testing.assert_allclose(found[name], expected, atol=1e-5 * np.abs(expected).max())


def test_two_densities_and_several_wavelengths():
    waves = (450, 650)
    with computing():
        plain = model(TWO, '{ dispersion = "cauchy", a = 1.49, b_um2 = 0.004 }', waves=waves)
        tabulated = plain.tabulated()
        assert any(isinstance(table, IndexTable) for table in tabulated.rough_tables)
        weight = {"ink.back_roughness.second_weight": np.asarray(0.7)}
        values = {"ink.refractive_index": np.asarray(1.505), **weight}
        np.testing.assert_allclose(bsdf(tabulated, values), bsdf(plain, values), rtol=3e-3)


def test_wavelengths_with_the_same_plate_share_a_table_over_the_index(both, monkeypatch):
    made = []

    def counted(face, wavelength_nm, values, original=tables._Face.table):
        made.append(float(wavelength_nm))
        return original(face, wavelength_nm, values)

    monkeypatch.setattr(tables._Face, "table", counted)
    with computing():
        together = model(waves=(450, 650)).tabulated()
    assert set(made) == {450.0}
    leaves, alone = map(jax.tree.leaves, (together.rough_tables, both[1].rough_tables))
    for found, once in zip(leaves, alone, strict=True):
        np.testing.assert_allclose(found, np.repeat(once, 2, axis=0), rtol=1e-12)


def test_two_free_indices_are_not_tabulated():
    plain = model(plate="{ free = true, value = 1.5, min = 1.45, max = 1.55 }")
    assert plain.tabulated() is plain


def test_wavelengths_with_the_same_indices_share_a_table(monkeypatch):
    made = []

    def counted(function, wavelengths, values, original=tables.at_each):
        made.append(np.asarray(wavelengths).tolist())
        return original(function, wavelengths, values)

    with computing():
        with monkeypatch.context() as patched:
            patched.setattr(tables, "at_each", counted)
            together = model(
                index="{ per_wavelength = true, value = [1.52, 1.48, 1.52] }", waves=(450, 550, 650)
            )
        # Each has the face between its own indices nevertheless.
        assert made == [[550.0, 450.0]]
        first, other, last = np.split(np.asarray(bsdf(together, {})), 3)
        np.testing.assert_allclose(first, last, rtol=1e-12)
        np.testing.assert_allclose(first, bsdf(model(index="1.52"), {}), rtol=1e-10)
        np.testing.assert_allclose(other, bsdf(model(index="1.48"), {}), rtol=1e-10)
    assert np.max(np.abs(other / first - 1)) > 1e-2


@eqx.filter_jit
def bsdf(one, values):
    return one.bsdf(values)
