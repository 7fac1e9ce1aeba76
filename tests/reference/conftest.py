"""Published numbers, and one prediction of all of them for each kind of stack: compiled once, read often."""

import csv

import numpy as np
import pytest

from jaxink.optics.directions import Directions
from jaxink.optics.layers import ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein, Rayleigh
from jaxink.solver.bsdf import diffuse_bsdf
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack

# Fine discretisations: for a layer without interfaces (exposed), and for one behind refracting faces.
MATCHED = SolverConfig(32, 12, 64, 32)
REFRACTING = SolverConfig(24, 16, 48, 16)


def column(rows, name, convert=float):
    return np.array([convert(row[name]) for row in rows])


def read_rows(path):
    with open(path, newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


@pytest.fixture(scope="session")
def table(shared_data):
    return read_rows(shared_data / "reference" / "reference_tables.csv")


@pytest.fixture(scope="session")
def converged(shared_data):
    """Rows of the converged BSDF tables by case."""
    folder = shared_data / "reference"
    names = ("W1_matched.csv", "W2_matched.csv", "W3_mismatch_n1.5.csv")
    rows = [row for name in names for row in read_rows(folder / name)]
    return {case: [r for r in rows if r["case"] == case] for case in ("W1", "W2", "W3a", "W3b")}


class Points:
    """Directions of several tables, appended one after the other and predicted in one call."""

    def __init__(self):
        self.columns, self.parts = [], {}

    def add(self, name, theta_i_deg, theta_o_deg, phi_deg, is_transmission):
        new = np.column_stack(np.broadcast_arrays(theta_i_deg, theta_o_deg, phi_deg, is_transmission))
        begin = sum(len(part) for part in self.columns)
        self.columns.append(new.astype(float))
        self.parts[name] = slice(begin, begin + len(new))

    @property
    def directions(self):
        theta_i, theta_o, phi, side = np.concatenate(self.columns).T
        return Directions.from_degrees(theta_i, theta_o, phi, side > 0.5)


class Hemispheres:
    """Quadrature of a BSDF over both hemispheres at given incidences.

    Gauss-Legendre nodes in the square root of the cosine, which copes with mu log(mu) at grazing;
    midpoints in azimuth.
    """

    def __init__(self, cosines, n_polar=32, n_azimuths=16):
        self.cosines = np.asarray(cosines)
        nodes, weights = np.polynomial.legendre.leggauss(n_polar)
        root = (nodes + 1) / 2
        cosine, share = root**2, root**2 * root * weights  # mu dmu
        azimuth = (np.arange(n_azimuths) + 0.5) * 180 / n_azimuths
        grid = np.meshgrid(self.cosines, [0.0, 1.0], cosine, azimuth, indexing="ij")
        incident, side, outgoing, phi = (axis.ravel() for axis in grid)
        self.points = np.rad2deg(np.arccos(incident)), np.rad2deg(np.arccos(outgoing)), phi, side
        self.shape = grid[0].shape
        self.weight = share[:, None] * np.full(n_azimuths, 2 * np.pi / n_azimuths)

    def totals(self, bsdf):
        """Diffuse reflectance and transmittance by incidence cosine (six decimals)."""
        sums = np.sum(np.asarray(bsdf).reshape(self.shape) * self.weight, axis=(2, 3))
        return {round(float(mu), 6): tuple(pair) for mu, pair in zip(self.cosines, sums, strict=True)}


def table_points(rows):
    theta_i, theta_o = (np.rad2deg(np.arccos(column(rows, name))) for name in ("mu0", "mu"))
    # In this table azimuth 0 is straight on, in jaxink 180 deg is.
    return theta_i, theta_o, 180 - column(rows, "phi"), column(rows, "quantity", lambda q: q == "radiance_T")


def bsdf_points(rows):
    angles = (column(rows, name) for name in ("theta_i_deg", "theta_o_deg", "phi_deg"))
    return *angles, column(rows, "side", lambda side: side == "T")


TOTALS_MATCHED = Hemispheres([1.0, 0.965926, 0.866025, 0.707107, 0.5])
TOTALS_REFRACTING = Hemispheres([1.0, 0.866025, 0.5])


def predict(stack, directions, config):
    return diffuse_bsdf(stack, directions, config)


class Prediction:
    """BSDF of one kind of stack at all points of the tables."""

    def __init__(self, points, make_stack, config):
        self.points, self.make_stack, self.config = points, make_stack, config
        self.directions, self.cache = points.directions, {}

    def __call__(self, part, *parameters):
        if parameters not in self.cache:
            self.cache[parameters] = np.asarray(
                predict(self.make_stack(*parameters), self.directions, self.config)
            )
        return self.cache[parameters][self.points.parts[part]]


@pytest.fixture(scope="session")
def matched(table, converged):
    """(part, asymmetry, albedo, optical thickness) -> BSDF of a layer without interfaces."""
    points = Points()
    points.add("table", *table_points(radiance_rows(table, "isotropic", "HG")))
    points.add("W", *bsdf_points(converged["W2"]))
    points.add("totals", *TOTALS_MATCHED.points)

    def stack(asymmetry, albedo, thickness):
        layer = ScatteringLayer(1.0, thickness, albedo, HenyeyGreenstein(asymmetry))
        return Stack((layer,), 1.0, 1.0)

    return Prediction(points, stack, MATCHED)


@pytest.fixture(scope="session")
def matched_rayleigh(table):
    points = Points()
    points.add("table", *table_points(radiance_rows(table, "Rayleigh")))

    def stack(albedo, thickness):
        return Stack((ScatteringLayer(1.0, thickness, albedo, Rayleigh()),), 1.0, 1.0)

    return Prediction(points, stack, MATCHED)


@pytest.fixture(scope="session")
def refracting(converged):
    """(part, asymmetry, albedo, optical thickness) -> BSDF of a layer of index 1.5 in air."""
    points = Points()
    points.add("W", *bsdf_points(converged["W3a"]))
    points.add("totals", *TOTALS_REFRACTING.points)

    def stack(asymmetry, albedo, thickness):
        layer = ScatteringLayer(1.5, thickness, albedo, HenyeyGreenstein(asymmetry))
        return Stack((layer,), 1.0, 1.0)

    return Prediction(points, stack, REFRACTING)


def radiance_rows(rows, *phases):
    return [row for row in rows if row["quantity"].startswith("radiance") and row["phase"] in phases]
