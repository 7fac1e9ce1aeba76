"""DISORT's test problems 1 to 5 and 9, as far as they ask for light that leaves, and jaxink's answer to them.

Of problem 5 the case 5b, and of problem 9 the case 9c, ask for what a BSDF does not tell: radiances within
the layer, and thermal emission.
"""

import csv
import itertools
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parents[3] / "tests" / "reference"
TABLE = FOLDER / "disort_problems.csv"
# Problem 9b: Devaux, Grandjean, Ishiguro, Siewert 1979 Astrophys. Space Sci. 62, 225.
DEVAUX = (1, 2.00916, 1.56339, 0.67407, 0.22215, 0.04725, 0.00671, 0.00068, 0.00005)
HENYEY_GREENSTEIN = "henyey_greenstein_"


def read_problems() -> dict[str, list[dict]]:
    """Rows of each problem."""
    with open(TABLE, newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    return {name: list(some) for name, some in itertools.groupby(rows, key=lambda row: row["problem"])}


def column(rows: list[dict], name: str) -> np.ndarray:
    """Numbers of a column."""
    return np.array([float(row[name]) for row in rows])


def is_transmission(rows: list[dict]) -> np.ndarray:
    """Which rows are of light that leaves at the far side."""
    return np.array([row["side"] == "T" for row in rows])


def layers(rows: list[dict]) -> np.ndarray:
    """Optical thickness and albedo of each layer, shape ``(2, layers)``."""
    return np.array([np.array(rows[0][key].split(), float) for key in ("optical_thickness", "albedo")])


def phase_moments(name: str, at_least: int = 1) -> np.ndarray:
    """Legendre moments, without the factor 2l + 1, padded with zeros."""
    if name.startswith(HENYEY_GREENSTEIN):
        return float(name.removeprefix(HENYEY_GREENSTEIN)) ** np.arange(at_least, dtype=float)
    if name in ("haze_l", "cloud_c1"):
        with open(FOLDER / "garcia_siewert_1985.csv", newline="", encoding="utf-8") as lines:
            coefficients = np.array([float(row[name]) for row in csv.DictReader(lines) if row[name]])
    else:
        coefficients = np.array({"isotropic": (1,), "rayleigh": (1, 0, 0.5), "devaux": DEVAUX}[name])
    moments = coefficients / (2 * np.arange(coefficients.size) + 1)
    return np.pad(moments, (0, max(0, at_least - moments.size)))


def stack_of(rows: list[dict], from_behind: bool = False):
    """The layers as jaxink takes them."""
    from jaxink.optics.layers import ScatteringLayer
    from jaxink.particles.phase_function import HenyeyGreenstein, TabulatedByMoments
    from jaxink.solver.stack import Stack

    name = rows[0]["phase"]
    if name.startswith(HENYEY_GREENSTEIN):
        phase_function = HenyeyGreenstein(float(name.removeprefix(HENYEY_GREENSTEIN)))
    else:
        phase_function = TabulatedByMoments(phase_moments(name))
    scattering = [ScatteringLayer(1.0, *optics, phase_function) for optics in layers(rows).T]
    return Stack(tuple(scattering[:: -1 if from_behind else 1]), 1.0, 1.0)


def radiances(rows: list[dict], config) -> np.ndarray:
    """Radiance over the irradiance of a beam, or over the radiance of diffuse light.

    Parameters
    ----------
    rows
        Of one problem.
    config
        Sizes of the discretisation.
    """
    from jaxink.optics.directions import Directions
    from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power

    theta_o_deg = np.rad2deg(np.arccos(column(rows, "mu")))
    if rows[0]["mu0"]:
        angles = np.rad2deg(np.arccos(column(rows, "mu0"))), theta_o_deg, column(rows, "phi_deg")
        directions = Directions.from_degrees(*angles, is_transmission(rows))
        return np.asarray(diffuse_bsdf(stack_of(rows), directions, config))
    # By reciprocity light from everywhere to one direction is light from that direction to everywhere.
    sines = np.sin(np.deg2rad(theta_o_deg))
    reflected, _ = hemispherical_power(stack_of(rows), sines, config)
    _, transmitted = hemispherical_power(stack_of(rows, from_behind=True), sines, config)
    return np.where(is_transmission(rows), transmitted, reflected)
