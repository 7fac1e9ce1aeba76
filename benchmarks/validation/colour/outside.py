"""Figure 17 of the publication on the stand-in: wavelengths predicted that were not fitted.

600 nm is left out of the fit. 650 and 730 nm lie outside the stand-in; its ink is simulated there by this
repository's Monte Carlo with the spheres of miepython, and with the absorption index that it has at 630 nm.

python -m benchmarks.validation.colour.outside [--photons N]
"""

import argparse
import json
import re
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.montecarlo import Detectors, Layer, Result, Sample, simulate
from benchmarks.montecarlo.spheres import Spheres, layer_of_spheres
from benchmarks.pages import rms
from benchmarks.simulated_data import data_file, declared_text, truth_of
from benchmarks.validation.published.problems import COLOURED

RESULTS = Path(__file__).parent / "outside.json"
FITTED = (570.0, 580.0, 590.0, 610.0, 620.0, 630.0)
INSIDE, OUTSIDE = 600.0, (650.0, 730.0)
INCIDENCES = (0.0, 45.0)
VIEWS = np.arange(-75.0, 76.0, 15.0)
SEED = 1752


def layers(wavelength_nm: float) -> tuple[Layer, Layer]:
    """Plate and ink of the stand-in at a wavelength, by miepython."""
    ink = truth_of(COLOURED)["ink"]
    phase = ink["phase"]
    spheres = Spheres(phase["radius_nm"], complex(phase["n_re"], -phase["n_im"][-1]), phase["pvc"])
    return Layer(1.5, 1.0), layer_of_spheres([spheres], ink["n"], ink["d_mm"], wavelength_nm)


def simulated(wavelength_nm: float, n_photons: int) -> jaxink.GonioData:
    """Noise-free reflection, with the standard error of the Monte Carlo as its noise."""
    columns = []
    for k, theta_i in enumerate(INCIDENCES):
        signed = VIEWS[(np.abs(VIEWS - theta_i) > 2.5) & (np.abs(VIEWS + theta_i) > 4)]
        phi, far = np.where(signed < 0, 0.0, 180.0), np.zeros(len(signed), bool)
        seen = Detectors(np.abs(signed), phi, far)
        found = simulate(Sample(layers(wavelength_nm)), theta_i, n_photons, SEED + k, seen)
        value, error = Result.mean_and_error(found.bsdf)
        columns.append([np.full(len(signed), theta_i), np.abs(signed), phi, value, error])
    theta_i, theta_o, phi, value, error = (np.concatenate(one) for one in zip(*columns, strict=True))
    wave, far = np.full(len(value), wavelength_nm), np.zeros(len(value), bool)
    return jaxink.GonioData(theta_i, theta_o, phi, wave, far, value, error)


def fit(model: str) -> jaxink.FitResult:
    """The free fit without the wavelength that is predicted."""
    text = declared_text(COLOURED, None if model == "mie" else model)
    waves = ", ".join(f"{one:g}" for one in FITTED)
    text, n = re.subn(r"wavelength_nm = \[[^]]*\]", f"wavelength_nm = [{waves}]", text)
    assert n == 1, "the wavelengths are listed once"
    data = jaxink.read(data_file(COLOURED)).select(wavelength_nm=list(FITTED))
    return jaxink.fit(data, jaxink.parse_sample(text, model))


def at_wavelength(result: jaxink.FitResult, wavelength_nm: float) -> jaxink.Sample:
    """The fitted sample with its spectra at another wavelength: linear between, constant beyond."""
    from jaxink.sample.parameters import ParameterTable

    table = result.sample.parameters
    kept, spectra = [], {}
    for p in table.values():
        stem, at, wave = p.name.partition("@")
        if at:
            spectra.setdefault(stem, []).append((float(wave), p))
        else:
            kept.append(p)
    import dataclasses

    for stem, pairs in spectra.items():
        waves, values = zip(*sorted((wave, p.value) for wave, p in pairs), strict=True)
        value = float(np.interp(wavelength_nm, waves, values))
        kept.append(dataclasses.replace(pairs[0][1], name=stem, value=value, smoothness=None))
    return dataclasses.replace(
        result.sample, wavelengths_nm=(wavelength_nm,), parameters=ParameterTable(kept)
    )


def main() -> None:
    """Fit, predict and keep."""
    parser = argparse.ArgumentParser(description="Predict wavelengths that were not fitted.")
    parser.add_argument("--photons", type=int, default=40_000, help="per incidence")
    photons, began = parser.parse_args().photons, time.perf_counter()
    beyond = {wave: simulated(wave, photons) for wave in OUTSIDE}
    kept: dict = {"photons": photons, "simulation_seconds": time.perf_counter() - began, "models": {}}
    kept["monte_carlo_rel"] = {
        f"{wave:g}": float(np.median(one.sigma_per_sr / one.bsdf_per_sr)) for wave, one in beyond.items()
    }
    whole = jaxink.read(data_file(COLOURED)).select(wavelength_nm=INSIDE, side="R")
    for model in ("mie", "hg"):
        result = fit(model)
        errors = {}
        for wave, data in ((INSIDE, whole), *beyond.items()):
            ratio = jaxink.predict(at_wavelength(result, wave), data) / data.bsdf_per_sr - 1
            errors[f"{wave:g}"] = {"rms": rms(ratio), "mean": float(ratio.mean())}
        kept["models"][model] = errors
        print(model, errors, flush=True)
        RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
