"""Simulate the sheet of 2018 with the Monte Carlo of benchmarks: lit from the top and from the bottom.

The measurement is not public. The truth is the best fit that is printed (step 29); what is not printed is
assumed: the binder has the index of the sheet, the spheres do not absorb, 550 nm. The spheres are those of
miepython, so that nothing here comes from jaxink.

python -m benchmarks.validation.published.sheet_2018 [--photons N]
"""

import argparse
import csv
import json
import time
from pathlib import Path

import numpy as np

from benchmarks.montecarlo import Detectors, Layer, Result, Sample, simulate
from benchmarks.montecarlo.spheres import Spheres, layer_of_spheres

FOLDER = Path(__file__).parent / "sheet_2018"
# Printed: sheet, and the best fit of the layer on its top face.
SHEET = Layer(1.5, 1.0)
RADIUS_NM, CONCENTRATION, PARTICLE_INDEX, THICKNESS_MM = 547.93, 0.0317, 1.93, 0.18
# Not printed.
BINDER_INDEX, WAVELENGTH_NM = 1.5, 550.0
INCIDENCES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0)
SIGNED_DEG = np.arange(-82.5, 82.6, 7.5)
# As in the simulated measurements: absent near the regular peaks and near the source; then the noise.
REGULAR_DEG, RETRO_DEG = 2.5, 4.0
RELATIVE, FLOOR_PER_SR = 0.01, 1e-4
SEED = 2018


def layer() -> Layer:
    """The scattering layer."""
    spheres = Spheres(RADIUS_NM, complex(PARTICLE_INDEX), CONCENTRATION)
    return layer_of_spheres([spheres], BINDER_INDEX, THICKNESS_MM, WAVELENGTH_NM)


def directions(theta_i_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Signed polar angles, positive on the side of the regular peaks, and whether in transmission."""
    signed, far = (column.ravel() for column in np.meshgrid(SIGNED_DEG, [False, True]))
    near_peak = np.abs(signed - theta_i_deg) < REGULAR_DEG
    near_source = ~far & (np.abs(signed + theta_i_deg) < RETRO_DEG)
    keep = ~near_peak & ~near_source
    return signed[keep], far[keep]


def simulated(lit: str, n_photons: int) -> list[dict]:
    """Noise-free rows of the sheet lit from one face, with their standard errors."""
    layers = (layer(), SHEET) if lit == "top" else (SHEET, layer())
    rows = []
    for n, theta_i in enumerate(INCIDENCES_DEG):
        signed, far = directions(theta_i)
        phi = np.where(signed < 0, 0.0, 180.0)
        seen = Detectors(np.abs(signed), phi, far)
        found = simulate(Sample(layers), theta_i, n_photons, SEED + 10 * n + (lit == "top"), seen)
        value, error = Result.mean_and_error(found.bsdf)
        for columns in zip(signed, phi, far, value, error, strict=True):
            rows.append(dict(zip(("signed", "phi", "far", "bsdf", "error"), columns, strict=True)))
            rows[-1]["theta_i"] = theta_i
    return rows


def write(lit: str, rows: list[dict], random: np.random.Generator) -> dict:
    """Write the measurement with noise; return its noise-free values."""
    header = ["theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr", "sigma_per_sr"]
    with (FOLDER / f"{lit}.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            sigma = np.hypot(RELATIVE * row["bsdf"], FLOOR_PER_SR)
            measured = row["bsdf"] + sigma * random.standard_normal()
            angles = [f"{row['theta_i']:g}", f"{abs(row['signed']):g}", f"{row['phi']:g}"]
            side = "T" if row["far"] else "R"
            writer.writerow([*angles, f"{WAVELENGTH_NM:g}", side, f"{measured:.6g}", f"{sigma:.3g}"])
    return {
        "noise_free": [float(f"{row['bsdf']:.6g}") for row in rows],
        "monte_carlo_se": [float(f"{row['error']:.3g}") for row in rows],
    }


def main() -> None:
    """Write both measurements, and the truth."""
    parser = argparse.ArgumentParser(description="Simulate the sheet of 2018.")
    parser.add_argument("--photons", type=int, default=400_000, help="per incidence")
    arguments = parser.parse_args()
    FOLDER.mkdir(exist_ok=True)
    random, truth, began = np.random.default_rng(SEED), {}, time.perf_counter()
    for lit in ("top", "bottom"):
        truth[lit] = write(lit, simulated(lit, arguments.photons), random)
    ink = layer()
    truth["ink"] = {
        "radius_nm": RADIUS_NM,
        "volume_fraction": CONCENTRATION,
        "particle_index": PARTICLE_INDEX,
        "thickness_um": 1000 * THICKNESS_MM,
        "scattering_per_mm": ink.scattering_per_mm,
    }
    truth["photons"], truth["seed"] = arguments.photons, SEED
    truth["seconds"] = round(time.perf_counter() - began)
    (FOLDER / "truth.json").write_text(json.dumps(truth) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
