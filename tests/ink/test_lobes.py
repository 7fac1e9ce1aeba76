"""Lobes of a rough face, read apart from the table: against Monte Carlo, power, reciprocity, the solver."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxink
from benchmarks.montecarlo import INTERFACE_FILE
from jaxink.export import ExportOptions, write
from jaxink.ink import TableOptions, read_ink_table
from jaxink.ink.hemispherical_totals import azimuth_weights, diffuse_totals, projected_weights
from jaxink.ink.sheet import sheets
from jaxink.ink.stack_lobes import facet_lobes
from jaxink.ink.table import InkTable
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.numerics.precision import computing
from jaxink.optics.layers import ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack
from jaxink.surfaces.slopes import slope_density
from tests.samples import UNMATCHED

CONFIG = SolverConfig(nodes_escaping=6, nodes_trapped=4, n_moments=4, n_orders=3)
# The tie keeps the angle from being tabulated beforehand, which takes longer than all else here.
ROUGH = UNMATCHED.replace(
    "asymmetry_parameter = 0.5",
    'asymmetry_parameter = 0.3\nback_roughness = { density = "cauchy", sigma_deg = { tie = "3.0" } }',
)


def lobes_of(kind, scale, index_inside):
    """Lobes of a bare interface: the layer before it scatters nothing."""
    with computing():
        nothing = ScatteringLayer(index_inside, 0.0, 1.0, HenyeyGreenstein(0.0))
        density = slope_density(kind, np.rad2deg(np.arctan(scale)))
        stack = Stack((nothing,), index_inside, 1.0, faces=(None, density))
        stacks = jax.tree.map(lambda x: jnp.asarray(x, float)[None], stack)
        return facet_lobes(stacks, CONFIG, np.linspace(0, 90, 91), 89.9)


@pytest.mark.parametrize("kind", ["cauchy", "beckmann"])
def test_one_facet_sends_on_what_the_monte_carlo_counts(kind):
    cases = json.loads(INTERFACE_FILE.read_text(encoding="utf-8"))["cases"]
    chosen = [c for c in cases if c["density"] == kind]
    scale = max(c["t"] for c in chosen)
    lobes = lobes_of(kind, scale, 1.5)
    for case in (c for c in chosen if c["t"] == scale):
        side = "I" if case["n_from"] == 1.5 else "A"
        other = "A" if side == "I" else "I"
        for name, key in ((f"R_{side}{side}", "R_single"), (f"T_{side}{other}", "T_single")):
            found = np.interp(case["theta_i_deg"], lobes.theta_deg, lobes.totals(name, 0))
            assert found == pytest.approx(case[key], abs=1e-3), (name, case["theta_i_deg"])


def test_power_and_reciprocity_of_the_lobes():
    lobes = lobes_of("beckmann", 0.2, 1.5)
    # Steps of a third of a degree: far below the lobes' width of 11 degrees and more.
    theta, phi = np.linspace(0, 90, 271), np.linspace(0, 180, 541)
    weights = projected_weights(theta)[:, None] * azimuth_weights(phi)
    for name, into in (("R_II", 20.0), ("T_IA", 20.0), ("T_AI", 40.0), ("R_AA", 40.0)):
        summed = np.sum(weights * lobes.bsdf(name, 0, into, theta[:, None], phi))
        assert summed == pytest.approx(np.interp(into, lobes.theta_deg, lobes.totals(name, 0)), rel=2e-3)
    i, o, turn = np.random.default_rng(3).uniform([0, 0, 120], [60, 60, 180], (20, 3)).T
    np.testing.assert_allclose(
        lobes.bsdf("T_IA", 0, i, o, turn), lobes.bsdf("T_AI", 0, o, i, turn) / 1.5**2, rtol=1e-9
    )
    for name in ("R_II", "R_AA"):
        np.testing.assert_allclose(
            lobes.bsdf(name, 0, i, o, turn), lobes.bsdf(name, 0, o, i, turn), rtol=1e-9
        )


@pytest.fixture(scope="module")
def rough():
    return jaxink.parse_sample(ROUGH)


@pytest.fixture(scope="module")
def table(rough, tmp_path_factory):
    """As a user has it: written, and read again."""
    made = jaxink.ink_table(rough, options=TableOptions(n_theta=41, n_phi=19, accuracy=1e-2))
    return read_ink_table(made.to_netcdf(tmp_path_factory.mktemp("rough") / "ink.nc"))


def test_what_the_lobes_leave_is_smooth(table):
    # The rest is what is left of the solver's own lobes, which know nothing of those that are read.
    entries, rest = (table.interpolation_error(70.0, lobes_apart=apart) for apart in (False, True))
    for name, least in (("T_IA", 0.2), ("T_AI", 0.2), ("R_AA", 0.05)):
        assert entries[name] > least
        assert rest[name] < 1e-3
    assert np.min(table.rest_per_sr) > 0


def test_power_comes_back_although_lobes_are_narrow(table):
    """The ink absorbs nothing."""
    totals = (diffuse_totals(table) + table.regular)[:, 0, table.theta_deg < 80]
    np.testing.assert_allclose(totals[0] + totals[1], 1.0, atol=5e-3)
    np.testing.assert_allclose(totals[2] + totals[3], 1.0, atol=5e-3)


def test_what_has_no_place_for_lobes_is_refused(table, tmp_path, refused):
    with refused():
        write(table, "csv", tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert write(table, "csv", tmp_path, ExportOptions(drop=("narrow_lobes",)))


def test_a_file_without_part_of_its_lobes_is_refused(table, refused):
    whole = table.to_dataset()
    assert np.array_equal(InkTable.from_dataset(whole).rest_per_sr, table.rest_per_sr)
    with refused("facet_passage"):
        InkTable.from_dataset(whole.drop_vars("facet_passage"))


def test_the_rough_sheet_is_the_full_model(table, rough):
    theta_o, phi, side = np.meshgrid(np.arange(0, 80, 2.5), [90.0, 180.0], [False, True], indexing="ij")
    columns = [axis.ravel() for axis in (theta_o, phi, side)]
    n, incidences = theta_o.size, (0.0, 30.0, 60.0)
    points = [np.tile(c, len(incidences)) for c in columns]
    model = ForwardModel(
        rough,
        np.repeat(incidences, n),
        *points[:2],
        np.full(len(points[0]), 550.0),
        points[2] > 0,
        accuracy=1e-2,
    )
    full = evaluate(model).reshape(len(incidences), n)
    (sheet,) = sheets(table, rough)[1]
    is_transmission = columns[2] > 0
    for theta_i, expected in zip(incidences, full, strict=True):
        difference = np.abs(sheet.bsdf(0, theta_i, *columns[:2], is_transmission) - expected)
        for chosen in (is_transmission, ~is_transmission):
            assert np.max(difference[chosen]) < 5e-3 * np.max(expected[chosen]), theta_i
