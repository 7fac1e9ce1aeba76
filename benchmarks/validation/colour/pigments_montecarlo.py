"""The two-pigment ink of `pigments` by this repository's Monte Carlo, with the spheres of miepython.

At three wavelengths, reflection and transmission are simulated in the directions of `pigments`; the forward
model with the true concentrations is compared with them, and they replace its values in the fit of the
concentrations.

python -m benchmarks.validation.colour.pigments_montecarlo [--photons N]
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.montecarlo import Detectors, Layer, Result, Sample, simulate
from benchmarks.montecarlo.spheres import Spheres, layer_of_spheres
from benchmarks.pages import rms
from benchmarks.validation.colour.pigments import (
    HEAD,
    NOISE,
    PIGMENTS,
    SEED,
    THICKNESS_UM,
    TRUTH,
    drawn,
    noise_free,
    truth,
)
from jaxink.materials import material

RESULTS = Path(__file__).with_suffix(".json")
WAVES = 450.0, 550.0, 650.0
BINDER, PLATE, PLATE_MM = 1.5, 1.49, 3.0
# Material, radius in nm, and share of the volume.
POPULATIONS = (
    ("anatase", 130.0, TRUTH["ink.volume_fraction"]),
    ("hematite", 90.0, TRUTH["ink.red.volume_fraction"]),
)


def layers(wavelength_nm: float) -> tuple[Layer, Layer]:
    """Plate and ink: cross sections of both kinds of spheres added."""
    spheres, at = [], np.array([wavelength_nm])
    for name, radius_nm, share in POPULATIONS:
        of = material(name)
        spheres.append(Spheres(radius_nm, complex(of.n(at)[0], -of.k(at)[0]), share))
    ink = layer_of_spheres(spheres, BINDER, THICKNESS_UM * 1e-3, wavelength_nm)
    return Layer(PLATE, PLATE_MM), ink


def simulated(clean: jaxink.GonioData, n_photons: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows of the three wavelengths, their BSDF and its standard error."""
    rows, values, errors = [], [], []
    for wave in WAVES:
        for theta_i_deg in np.unique(clean.theta_i_deg):
            at = np.flatnonzero((clean.wavelength_nm == wave) & (clean.theta_i_deg == theta_i_deg))
            seen = Detectors(clean.theta_o_deg[at], clean.phi_deg[at], clean.is_transmission[at])
            found = simulate(Sample(layers(wave)), float(theta_i_deg), n_photons, SEED + len(rows), seen)
            mean, error = Result.mean_and_error(found.bsdf)
            rows.append(at)
            values.append(mean)
            errors.append(error)
    return np.concatenate(rows), np.concatenate(values), np.concatenate(errors)


def main() -> None:
    """Simulate, compare, fit and keep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--photons", type=int, default=1_000_000, help="per incidence and wavelength")
    photons, began = parser.parse_args().photons, time.perf_counter()
    clean = noise_free()
    rows, values, errors = simulated(clean, photons)
    kept: dict = {"photons": photons, "seconds": time.perf_counter() - began, "model": {}}
    model = jaxink.predict(truth(), clean)
    for wave in WAVES:
        for side, is_far in (("R", False), ("T", True)):
            one = (clean.wavelength_nm[rows] == wave) & (clean.is_transmission[rows] == is_far)
            ratio = model[rows[one]] / values[one] - 1
            kept["model"][f"{side} {wave:g}"] = {
                "rms": rms(ratio),
                "mean": float(ratio.mean()),
                "error_of_monte_carlo": float(np.median(errors[one] / values[one])),
            }
    replaced = clean.bsdf_per_sr.copy()
    replaced[rows] = values
    # The errors of the Monte Carlo are common to the directions of an incidence, and small against the noise.
    sigma = NOISE * replaced + 1e-6
    data = drawn(clean.replace(bsdf_per_sr=replaced, sigma_per_sr=sigma), SEED).select(
        wavelength_nm=list(WAVES)
    )
    waves = ", ".join(f"{wave:g}" for wave in WAVES)
    head = HEAD.replace(HEAD.split("[")[1].split("]")[0], waves, 1)
    result = jaxink.fit(
        data, jaxink.parse_sample(head + PIGMENTS), jaxink.FitOptions(profile="none", scan=False)
    )
    kept["reduced_chi_square"] = result.merit.reduced_chi_square
    kept["values"] = {name: result.values[name] for name in TRUTH}
    kept["errors"] = {name: result[name].standard_error for name in TRUTH}
    print(json.dumps(kept, indent=1))
    RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
