"""Real prints mixed from five inks: inks fitted to some mixtures, predicting others.

python -m benchmarks.validation.colour.prints

Fitted are the pure inks and the mixtures of two with 75 % of one; predicted are those of halves. The fitted
prints are one project, with the scattering and absorption coefficients of every ink at every wavelength, in
units of the white's scattering, which an opaque print cannot tell, and one asymmetry parameter for all. For
comparison, two constants of Kubelka and Munk by the same readings, with Saunderson's correction.
"""

import csv
import json
import time
from collections.abc import Mapping
from pathlib import Path

import jax
import numpy as np
from scipy.optimize import least_squares

import jaxink
from benchmarks.pages import data_folder
from jaxink.colour.cie import difference, lab_of
from jaxink.colour.kubelka_munk import saunderson
from jaxink.colour.viewing import Viewing
from jaxink.fitting.joint_result import JointResult
from jaxink.measurement import Readings
from jaxink.model.readings import ReadingsModel
from jaxink.numerics.precision import computing
from jaxink.projects import Measurement, Project

RESULTS = Path(__file__).with_name("prints.json")
SET = "ink3d_cmykw_patches"
INKS = ("c", "m", "y", "k", "w")
NAMES = ("cyan", "magenta", "yellow", "black", "white")
# The set states no uncertainty: a share of the reading, and the steps in which black is stored.
RELATIVE, FLOOR = 0.02, 0.0005
INDEX = 1.5
_HALF = 50
_FREE = "{ per_wavelength = true, free = true, value = 0.3, min = 1e-3, max = 30 }"
_TEXT = f"""
schema_version = 1
wavelength_nm = WAVES
[inks.white]
scattering_per_mm = 1
absorption_per_mm = {{ per_wavelength = true, free = true, value = 0.01, min = 1e-5, max = 1 }}
{
    "".join(
        f'''[inks.{name}]
scattering_per_mm = {_FREE}
absorption_per_mm = {_FREE}
'''
        for name in NAMES[:-1]
    )
}
[[layers]]
name = "print"
kind = "scattering"
phase_function = "henyey_greenstein"
asymmetry_parameter = {{ free = true, value = 0.4, min = -0.5, max = 0.9 }}
refractive_index = {INDEX}
thickness_um = "opaque"
mixture = {{ {", ".join(f"{name} = 0.2" for name in NAMES)} }}
"""


def read(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shares of the inks in each print, wavelengths in nm, and reflectance factors."""
    with (folder / "patches.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    shares = np.array([[float(row[f"{ink}_percent"]) / 100 for ink in INKS] for row in rows])
    with (folder / "reflectance.csv").open(encoding="utf-8") as file:
        values = {
            (r["patch"], float(r["wavelength_nm"])): float(r["reflectance"]) for r in csv.DictReader(file)
        }
    waves = sorted({wave for _, wave in values})
    return shares, np.array(waves), np.array([[values[row["patch"], w] for w in waves] for row in rows])


def kinds(shares: np.ndarray) -> dict[str, np.ndarray]:
    """Which prints are fitted, and which are predicted."""
    fitted = np.round(100 * shares.max(axis=1)) != _HALF
    return {"fitted: pure, and 75 % with 25 %": fitted, "predicted: halves": ~fitted}


def readings(values: np.ndarray, waves: np.ndarray) -> Readings:
    """A spectrum with its noise."""
    angles = (np.full(len(waves), one) for one in (45.0, 0.0, 180.0))
    quantity = np.array(["R_45_0"] * len(waves))
    return Readings(quantity, *angles, waves, values, RELATIVE * values + FLOOR)


def mixture(shares: np.ndarray) -> dict[str, float]:
    """Shares by the names of parameters."""
    return {f"print.mixture.{name}": float(s) for name, s in zip(NAMES, shares, strict=True)}


def by_model(
    shares: np.ndarray, values: np.ndarray, is_fitted: np.ndarray, waves: np.ndarray
) -> tuple[np.ndarray, JointResult]:
    """Reflectance factors of all prints by inks that are fitted to some."""
    ink = jaxink.parse_sample(_TEXT.replace("WAVES", str(waves.tolist())))
    measurements = []
    for number in np.flatnonzero(is_fitted):
        sample = ink.replace(mixture(shares[number]))
        names = {n: f"p{number}/{n}" if n.startswith("print.mixture.") else n for n in sample.parameters}
        measurements.append(Measurement(f"p{number}", readings(values[number], waves), sample, names))
    result = jaxink.fit(Project(tuple(measurements)), options=jaxink.FitOptions(profile="none"))
    found = {p.name: result[p.name].value for p in ink.parameters.free}
    model = ReadingsModel(ink, readings(values[0], waves))
    with computing():
        bsdf = jax.jit(model.bsdf)
        return np.array([bsdf({**found, **mixture(print_)}) for print_ in shares]), result


def by_two_constants(shares: np.ndarray, values: np.ndarray, is_fitted: np.ndarray) -> np.ndarray:
    """The same at one wavelength by Kubelka and Munk (1931), corrected by Saunderson (1942)."""
    outside = ((1 - INDEX) / (1 + INDEX)) ** 2
    inside = float(saunderson(np.array([INDEX]))[1][0])

    def reflectance(x: np.ndarray) -> np.ndarray:
        scattering, absorption = np.append(np.exp(x[:4]), 1.0), np.exp(x[4:])
        ratio = (shares @ absorption) / (shares @ scattering)
        layer = 1 + ratio - np.sqrt(ratio**2 + 2 * ratio)
        return (1 - outside) * (1 - inside) * layer / (1 - inside * layer)

    def residual(x: np.ndarray) -> np.ndarray:
        return ((reflectance(x) - values) / (RELATIVE * values + FLOOR))[is_fitted]

    return reflectance(least_squares(residual, np.log([0.3] * 8 + [0.01])).x)


def errors(
    predicted: np.ndarray, values: np.ndarray, waves: np.ndarray, which: Mapping[str, np.ndarray]
) -> dict:
    """Distances of spectra and of colours, by kind."""
    viewing = Viewing.of(waves, "D65", 2)
    colours = [lab_of(one @ viewing.weights.T, viewing.white) for one in (predicted, values)]
    distances = difference(*colours)
    return {
        kind: {
            "spectra": int(here.sum()),
            "rms": float(np.sqrt(np.mean((predicted - values)[here] ** 2))),
            "relative_rms": float(np.sqrt(np.mean((predicted / values - 1)[here] ** 2))),
            "ciede2000_mean": float(distances[here].mean()),
            "ciede2000_largest": float(distances[here].max()),
        }
        for kind, here in which.items()
    }


def main() -> None:
    """Fit and predict at every wavelength, and keep the errors."""
    folder = data_folder("measured") / SET
    shares, waves, values = read(folder)
    which = kinds(shares)
    is_fitted = next(iter(which.values()))
    began = time.perf_counter()
    predicted, result = by_model(shares, values, is_fitted, waves)
    seconds = time.perf_counter() - began
    two = np.stack([by_two_constants(shares, column, is_fitted) for column in values.T], axis=1)
    kept = {
        "seconds": seconds,
        "wavelengths": len(waves),
        "parameters": len(result.parameters.free),
        "converged": result.converged,
        "reduced_chi_square": result.reduced_chi_square,
        "asymmetry": result["print.asymmetry_parameter"].value,
        "jaxink": errors(predicted, values, waves, which),
        "two constants": errors(two, values, waves, which),
    }
    RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
