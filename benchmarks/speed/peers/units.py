"""The work units: optical parameters, directions, reference values and errors (numpy only)."""

import csv
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from benchmarks.pages import data_folder

TOLERANCE = 1e-4
# Asymmetry parameter, single scattering albedo, optical thickness.
LIGHT, DENSE = (0.35, 0.999, 8.0), (0.85, 0.999, 40.0)
INCIDENCES = (0.0, 15.0, 30.0, 45.0, 60.0)
OUTGOING = (*np.arange(0.0, 88.0, 2.5).tolist(), 89.0)
# Steps of forward differences in the three parameters, and of the central ones they are checked with.
FORWARD_STEPS, CENTRAL_STEPS = (1e-5, 1e-5, 1e-3), (1e-4, 1e-4, 1e-2)


@dataclass(frozen=True)
class SlabUnit:
    """Radiances of a slab on the grid incidence, side (R, T), azimuth, outgoing angle.

    Parameters
    ----------
    title
        What is computed.
    sets
        Optical parameters, shape ``(sets, 3)``; the reference belongs to the last one.
    file, case
        Where the reference is.
    incidences, azimuths
        Degrees; azimuth 180 is the half-plane of the specular and of the undeviated direction.
    index
        Refractive index of the slab, in air.
    """

    title: str
    sets: np.ndarray
    file: str
    case: str
    incidences: tuple = INCIDENCES
    azimuths: tuple = (0.0, 180.0)
    index: float = 1.0

    @property
    def shape(self) -> tuple:
        """Shape of the grid."""
        return len(self.incidences), 2, len(self.azimuths), len(OUTGOING)

    def points(self) -> tuple:
        """Columns theta_i, theta_o, phi in degrees and whether transmitted, in the order of the grid."""
        axes = np.meshgrid(self.incidences, [False, True], self.azimuths, OUTGOING, indexing="ij")
        incidence, side, azimuth, outgoing = (axis.ravel() for axis in axes)
        return incidence, outgoing, azimuth, side

    def reference(self) -> np.ndarray:
        """Converged BSDF on the grid in 1/sr, NaN where the file has none."""
        grid = np.full(self.shape, np.nan)
        with open(data_folder("reference") / self.file, newline="", encoding="utf-8") as lines:
            for row in csv.DictReader(lines):
                place = float(row["theta_i_deg"]), float(row["phi_deg"])
                known = place[0] in self.incidences and place[1] in self.azimuths
                if row["case"] == self.case and known:
                    i, j = self.incidences.index(place[0]), self.azimuths.index(place[1])
                    k = OUTGOING.index(float(row["theta_o_deg"]))
                    grid[i, int(row["side"] == "T"), j, k] = float(row["bsdf_per_sr"])
        return grid

    def totals(self) -> np.ndarray:
        """Reflectance and transmittance at normal incidence, regular light included, from the reference."""
        from scipy.interpolate import CubicSpline

        theta = np.deg2rad(OUTGOING)
        both = np.concatenate([-theta[:0:-1], theta])
        diffuse = []
        for bsdf in self.reference()[0, :, self.azimuths.index(180.0)]:
            even = np.concatenate([bsdf[:0:-1], bsdf])
            spline = CubicSpline(both, 2 * np.pi * even * np.cos(both) * np.sin(both))
            diffuse.append(spline.integrate(0, np.pi / 2))
        face = ((self.index - 1) / (self.index + 1)) ** 2
        through = np.exp(-self.sets[-1][2])
        rounds = 1 - (face * through) ** 2
        regular = face + (1 - face) ** 2 * face * through**2 / rounds, (1 - face) ** 2 * through / rounds
        return np.array(diffuse) + regular


MATCHED_DENSE = {"file": "W2_matched.csv", "case": "W2"}
SLABS = {
    "W1": SlabUnit(
        "HG g 0.35, albedo 0.999, optical thickness 8, normal incidence, 37 R + 37 T angles, no mismatch",
        np.array([LIGHT]),
        "W1_matched.csv",
        "W1",
        (0.0,),
        (180.0,),
    ),
    "W1 x 64": SlabUnit(
        "W1 for 64 sets of parameters at once, time per set",
        np.linspace((0.2, 0.9, 4.0), LIGHT, 64),
        "W1_matched.csv",
        "W1",
        (0.0,),
        (180.0,),
    ),
    "W2": SlabUnit(
        "HG g 0.85, albedo 0.999, optical thickness 40, 5 incidences, 740 radiances, no mismatch",
        np.array([DENSE]),
        **MATCHED_DENSE,
    ),
    "W3a": SlabUnit(
        "the slab of W1 with index 1.5 in air, 5 incidences, 740 radiances",
        np.array([LIGHT]),
        "W3_mismatch_n1.5.csv",
        "W3a",
        index=1.5,
    ),
    "W3b": SlabUnit(
        "the slab of W2 with index 1.5 in air, 5 incidences, 740 radiances",
        np.array([DENSE]),
        "W3_mismatch_n1.5.csv",
        "W3b",
        index=1.5,
    ),
    "W4": SlabUnit(
        "W2 and its derivatives with respect to g, albedo and optical thickness",
        np.array([DENSE]),
        **MATCHED_DENSE,
    ),
    "W6": SlabUnit(
        "W2 for 41 spectra, time per spectrum", np.linspace((0.8, 0.98, 30.0), DENSE, 41), **MATCHED_DENSE
    ),
}

SIZE_PARAMETERS = np.linspace(0.5, 10.0, 820)
SPHERE_INDEX = 1.4 + 0.001j
SPHERE_COSINES = np.cos(np.deg2rad(np.arange(181.0)))
SPHERE_MOMENTS = 64
TITLES = {name: unit.title for name, unit in SLABS.items()} | {
    "W5": "820 Mie spheres, x 0.5 ... 10, m 1.4 - 0.001i: efficiencies, asymmetry, 181 angles, 64 moments",
    "whole sample": "clear plate 1.49, ink with Mie particles, 5 incidences, R and T, 648 directions: value "
    "and Jacobian in radius, particle index, volume fraction, binder index and thickness",
}
UNITS = ("W1", "W1 x 64", "W2", "W3a", "W3b", "W4", "W5", "W6", "whole sample")


def items(unit: str) -> int:
    """By how many the time of a call is divided."""
    return len(SLABS[unit].sets) if unit in ("W1 x 64", "W6") else 1


@lru_cache
def _reference(unit: str, kind: str) -> np.ndarray:
    slab = SLABS[unit]
    return slab.totals() if kind == "totals" else slab.reference()


def value_error(unit: str, result: dict, made: dict) -> float:
    """Largest relative error of what a contender returned; `made` is the result of a reference contender."""
    if "noisy_total" in result:
        samples = result["noisy_total"]
        return float(np.std(samples, ddof=1) / np.sqrt(samples.size) / np.mean(samples))
    if "spheres" in result:
        found, known = result["spheres"], made["spheres"]
        # Moments pass through zero: their error is absolute.
        relative = np.abs(found / known - 1)[:, :-SPHERE_MOMENTS]
        return float(max(np.max(relative), np.max(np.abs(found - known)[:, -SPHERE_MOMENTS:])))
    if "totals" in result:
        return float(np.max(np.abs(result["totals"] / _reference(unit, "totals") - 1)))
    if unit not in SLABS:
        return float(np.max(np.abs(result["values"] / made["values"] - 1)))
    known = _reference(unit, "bsdf")
    if "reflected" in result:
        found, known = result["reflected"][-1], known[:, 0]
    else:
        found = result["values"][-1]
    there = np.isfinite(known)
    return float(np.max(np.abs(found.reshape(known.shape) / known - 1)[there]))


def derivative_error(result: dict, made: dict) -> float | None:
    """Largest error of the derivatives, over the largest size of the same derivative."""
    if "derivatives" not in result or "derivatives" not in made:
        return None
    found, known = result["derivatives"], made["derivatives"]
    if "reflected" in result:
        known = known.reshape(3, *SLABS["W4"].shape)[:, :, 0].reshape(3, -1)
    return float(np.max(np.max(np.abs(found - known), axis=1) / np.max(np.abs(known), axis=1)))
