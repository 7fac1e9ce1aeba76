"""A two-pigment ink by the forward model at higher accuracy: free, by its pigments, and the published way.

The ink is anatase and iron oxide red in a binder on a plate, 31 wavelengths from 400 to 700 nm, lit at 0 and
45 degrees, with noise of 0.5 %. Its spectra come from the forward model at an accuracy of 1e-5, ten times
that of the fits: they test the fits and the colours, not the model.

python -m benchmarks.validation.colour.pigments [pigments|published|free ...]
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

import jaxink
from jaxink.colour import Arrangement, SampleSpectra
from jaxink.colour.of_sample import ParameterCovariance
from jaxink.measurement.reflectance_of_bsdf import diffuse_reflectance

RESULTS = Path(__file__).parent / "pigments.json"
WAVES = np.arange(400.0, 701.0, 10.0)
TRUTH = {"ink.volume_fraction": 0.08, "ink.red.volume_fraction": 0.02}
# So thin that a card behind it is seen.
THICKNESS_UM, NOISE, SEED = 4.0, 0.005, 52
HEAD = f"""schema_version = 1
title = "Simulated: anatase and iron oxide red"
wavelength_nm = [{", ".join(f"{wave:g}" for wave in WAVES)}]
noise = {{ use_file_sigma = true, scan_relative = 0 }}
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.49
thickness_mm = 3
[[layers]]
name = "ink"
kind = "scattering"
refractive_index = 1.5
thickness_um = {THICKNESS_UM}
"""
PIGMENTS = """phase_function = "mie"
radius_nm = 130
volume_fraction = { free = true, min = 0.001, max = 0.3, value = 0.04 }
particle_index = { material = "anatase" }
particle_absorption_index = { material = "anatase" }
[[layers.populations]]
name = "red"
radius_nm = 90
volume_fraction = { free = true, min = 0.001, max = 0.3, value = 0.05 }
particle_index = { material = "hematite" }
particle_absorption_index = { material = "hematite" }
"""
FREE = """phase_function = "henyey_greenstein"
scattering_per_mm = { per_wavelength = true, free = true, min = 1, max = 5000, value = 300 }
absorption_per_mm = { per_wavelength = true, free = true, min = 0, max = 3000, value = 20 }
asymmetry_parameter = { per_wavelength = true, free = true, min = -0.5, max = 0.95, value = 0.5 }
"""
PUBLISHED = """phase_function = "henyey_greenstein"
scattering_per_mm = {{ shape = [{shape}], free = true, min = 1, max = 5000, value = 300 }}
absorption_per_mm = {{ free = true, min = 0, max = 3000, value = 20 }}
asymmetry_parameter = {{ free = true, min = -0.5, max = 0.95, value = 0.5 }}
"""
CARDS = (0.01, 0.8)


def truth() -> jaxink.Sample:
    """The ink with its true concentrations."""
    return jaxink.parse_sample(HEAD + PIGMENTS).replace(TRUTH)


def noise_free() -> jaxink.GonioData:
    """What a goniometer without noise would read; its sigma is that of the noise to be drawn."""
    view = np.array([-75.0, -60, -30, -15, 10, 25, 35, 55, 65, 75])[:, None]
    parts = [
        jaxink.predict_at(truth(), theta_i, view, None, WAVES, side, accuracy=1e-5)
        for theta_i in (0.0, 45.0)
        for side in "RT"
    ]
    columns = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in (
            "theta_i_deg",
            "theta_o_deg",
            "phi_deg",
            "wavelength_nm",
            "is_transmission",
            "bsdf_per_sr",
        )
    }
    sigma = NOISE * columns["bsdf_per_sr"] + 1e-6
    return jaxink.GonioData(**columns, sigma_per_sr=sigma, source="two pigments")


def drawn(clean: jaxink.GonioData, seed: int) -> jaxink.GonioData:
    """The measurement with noise."""
    noise = np.random.default_rng(seed).standard_normal(len(clean))
    return clean.replace(bsdf_per_sr=clean.bsdf_per_sr + clean.sigma_per_sr * noise)


def arranged(sample: jaxink.Sample, factor: float, card: float, known: ParameterCovariance | None = None):
    """Colour 45:0 of the free ink, thinner or thicker, in contact with a card."""
    placed = Arrangement(thickness_um=factor * THICKNESS_UM, over=card, contact=True, free=True).of(sample)
    return SampleSpectra(placed, ["45:0"], WAVES).colours("D65", 2, known)[0]


def main() -> None:
    """Simulate, fit in the ways asked for, or in all, and keep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ways", nargs="*", default=["pigments", "published", "free"])
    asked = parser.parse_args().ways
    data = drawn(noise_free(), SEED)
    true = {(f, c): arranged(truth(), f, c) for f in (0.5, 1.0, 2.0) for c in CARDS}
    shape = ", ".join(f"{one:.5g}" for one in diffuse_reflectance(data).scattering_shape)
    kept: dict = {"points": len(data), "wavelengths": len(WAVES), "ways": {}}
    if RESULTS.exists():
        kept["ways"] = json.loads(RESULTS.read_text(encoding="utf-8"))["ways"]
    texts = {"pigments": PIGMENTS, "published": PUBLISHED.format(shape=shape), "free": FREE}
    for way in asked:
        sample, began = jaxink.parse_sample(HEAD + texts[way], way), time.perf_counter()
        result = jaxink.fit(data, sample, jaxink.FitOptions(profile="none", scan=False))
        seconds = time.perf_counter() - began
        points = result.colour(["45:0"]).at_points
        assert points is not None, "every direction has all wavelengths"
        kept["ways"][way] = {
            "seconds": seconds,
            "parameters": len(result.parameters.free),
            "verdict": str(result.verdict.code.value),
            "reduced_chi_square": result.merit.reduced_chi_square,
            "measured_against_fitted": points.to_dict(),
            "values": {name: result.values.get(name) for name in TRUTH} if way == "pigments" else None,
            "errors": {n: result[n].standard_error for n in TRUTH} if way == "pigments" else None,
            "predicted": {
                f"{f:g} over {c:g}": arranged(result.sample, f, c).difference(one)
                for (f, c), one in true.items()
            },
        }
        print(way, json.dumps(kept["ways"][way]), flush=True)
        RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
