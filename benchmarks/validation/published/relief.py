"""A rough face without a scattering volume, fitted to the sheet of 2018 lit from the bottom.

python -m benchmarks.validation.published.relief
"""

import json
import time
from pathlib import Path

import jaxink
from benchmarks.pages import page_path
from benchmarks.validation.published.figures import draw_fits
from benchmarks.validation.published.fits import KEPT
from benchmarks.validation.published.problems import SHEET, measured
from jaxink.sample import Sample, parse_sample, sample_text

FILE = KEPT / f"{SHEET}-relief.json"
FIGURE = page_path(f"published-{SHEET}-relief.png")
# The layer may absorb, but does not scatter; its outer face is as rough as it needs to be.
TEXT = """schema_version = 1
title = "Simulated: a relief in place of the scattering layer"
wavelength_nm = 550
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 180
scattering_per_mm = 0
asymmetry_parameter = 0
absorption_per_mm = { free = true, value = 1, min = 0, max = 50 }
back_roughness = { density = "ggx", sigma_deg = { free = true, value = 10, min = 0.5, max = 45 } }
[noise]
scan_relative = 0.004
[masks]
specular_half_angle_deg = 0
undeviated_half_angle_deg = 0
retro_half_angle_deg = 0
"""


def make() -> dict:
    """The fit, kept."""
    if not FILE.exists():
        began = time.perf_counter()
        result = jaxink.fit(measured(SHEET)[0], parse_sample(TEXT))
        plain = {
            "outcome": result.outcome.value,
            "chi_square": result.merit.chi_square,
            "points": result.merit.points,
            "percent": 100 * result.merit.relative_rms,
            "sigma_deg": result.parameters["ink.back_roughness.sigma_deg"].value,
            "absorption_per_mm": result.parameters["ink.absorption_per_mm"].value,
            "sample": sample_text(result.sample),
            "seconds": round(time.perf_counter() - began, 1),
        }
        FILE.write_text(json.dumps(plain, indent=1) + "\n", encoding="utf-8")
    return json.loads(FILE.read_text(encoding="utf-8"))


def sample() -> Sample:
    """The relief that was found."""
    return parse_sample(make()["sample"])


def picture() -> Path:
    """Draw it beside the measurement."""
    data = measured(SHEET)[:1]
    draw_fits(SHEET, data, {"relief alone": [jaxink.predict(sample(), data[0])]}, FIGURE)
    return FIGURE


if __name__ == "__main__":
    print(make()["percent"])
    picture()
