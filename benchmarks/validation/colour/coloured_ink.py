"""The coloured stand-in, the published way and free, as spheres and by Henyey-Greenstein, against its truth.

python -m benchmarks.validation.colour.coloured_ink
"""

import json
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.pages import rms
from benchmarks.simulated_data import truth_of
from benchmarks.validation.published.problems import COLOURED, EVERYTHING, PROTOCOL, problem
from jaxink.colour import Viewing
from jaxink.colour.cie import difference, lab_of

RESULTS = Path(__file__).parent / "coloured_ink.json"
WAYS = {"published": PROTOCOL, "free": EVERYTHING}
MODELS = ("mie", "hg")
# Colours of the sample itself, beside those of the directions.
GEOMETRIES = ("45:0", "8:di", "8:de")


def fitted(model: str, way: str) -> tuple[jaxink.FitResult, float]:
    """One of the four fits, and its seconds."""
    one = problem(f"{COLOURED}-{model}", WAYS[way])
    began = time.perf_counter()
    result = jaxink.fit(one.data, one.sample, jaxink.FitOptions(objective=one.kind))
    return result, time.perf_counter() - began


def spectra(data: jaxink.GonioData, values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Wavelengths, whether behind, and pi f of each direction that has all wavelengths."""
    waves = np.unique(data.wavelength_nm)
    keys = np.column_stack([data.is_transmission, data.theta_i_deg, data.theta_o_deg, data.phi_deg])
    unique, direction = np.unique(keys, axis=0, return_inverse=True)
    found = np.full((len(unique), len(waves)), np.nan)
    found[direction.reshape(-1), np.searchsorted(waves, data.wavelength_nm)] = np.pi * values
    whole = np.all(np.isfinite(found), axis=1)
    return waves, unique[whole, 0] == 1, found[whole]


def judged(result: jaxink.FitResult, data: jaxink.GonioData, noise_free: np.ndarray) -> dict:
    """Errors of a fit against the noise-free truth, in every direction."""
    predicted = result.predict(data)
    waves, behind, model = spectra(data, predicted)
    true, measured = (spectra(data, values)[2] for values in (noise_free, data.bsdf_per_sr))
    viewing = Viewing.of(waves, "D65", 2)
    xyz = {name: one @ viewing.weights.T for name, one in (("m", model), ("t", true), ("d", measured))}
    lab = {name: lab_of(one, viewing.white) for name, one in xyz.items()}
    xy = {name: one[:, :2] / one.sum(axis=1, keepdims=True) for name, one in xyz.items()}
    found = {}
    for side, here in (("R", ~behind), ("T", behind)):
        if not here.any():
            continue
        luminance = (xyz["m"][:, 1] / xyz["t"][:, 1] - 1)[here]
        chromaticity = np.abs(xy["m"] - xy["t"]).max(axis=1)[here]
        found[side] = {
            "directions": int(here.sum()),
            "luminance_rms": rms(luminance),
            "luminance_mean": float(luminance.mean()),
            "luminance_largest": float(np.abs(luminance).max()),
            "xy_rms": rms(chromaticity),
            "xy_largest": float(chromaticity.max()),
            "ciede2000_truth": float(difference(lab["m"], lab["t"])[here].mean()),
            "ciede2000_measured": float(difference(lab["m"], lab["d"])[here].mean()),
            "ciede2000_noise": float(difference(lab["d"], lab["t"])[here].mean()),
            "by_wavelength": [rms(model[here, w] / true[here, w] - 1) for w in range(len(waves))],
        }
    return {"wavelength_nm": waves.tolist(), "light": viewing.sentence, "sides": found}


def main() -> None:
    """Fit, judge and keep."""
    data, truth = problem(f"{COLOURED}-mie", EVERYTHING).data, truth_of(COLOURED)
    noise_free = np.array(truth["noise_free"])
    kept = {"monte_carlo_rel_se_median": truth["monte_carlo_rel_se_median"]}
    for model in MODELS:
        for way in WAYS:
            result, seconds = fitted(model, way)
            one = judged(result, data, noise_free)
            one |= {"seconds": seconds, "verdict": str(result.verdict.code.value)}
            if way == "free":
                seen = result.colour(GEOMETRIES)
                one["colours"] = [colour.to_dict() for colour in seen.colours]
                one["errors"] = seen.errors
            kept[f"{model}-{way}"] = one
            for side, found in one["sides"].items():
                shown = {k: v for k, v in found.items() if k != "by_wavelength"}
                print(model, way, side, json.dumps(shown, default=float))
            RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
