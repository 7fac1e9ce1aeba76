"""Write render.md: Mitsuba's volumetric plate against the solver, the light guide, and the booth.

python -m benchmarks.validation.render
"""

import dataclasses
import json
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.pages import table, write_page
from benchmarks.validation.published.judgement import true_sample
from benchmarks.validation.render import booth, dot_size, guide
from benchmarks.validation.render.booth_section import booth_section
from benchmarks.validation.render.dot_size_section import dot_size_section
from benchmarks.validation.render.guide_section import guide_section
from benchmarks.validation.render.plate import Plate, power
from jaxink.export.medium import Medium, medium_of, short_forms
from jaxink.export.volume import write_volume
from jaxink.ink.ink_layers import find_ink
from jaxink.numerics.precision import computing
from jaxink.optics.layers import ClearLayer
from jaxink.solver.bsdf import hemispherical_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack

FILE = Path(__file__).with_name("results.json")
INKS = {"white_ink_mie": 550.0, "white_ink_rough": 550.0, "coloured_ink": 600.0}
INCIDENCES_DEG = (0.0, 45.0)
# Paths of a direction; transmission, which is less, needs more for the same relative error.
N_PATHS = {"R": 60_000, "T": 250_000}
SEED = 53
# T of this ink, whose mean free path is the shortest, also with a thicker ink of smaller coefficients.
ENLARGED, ENLARGEMENTS, N_PATHS_ENLARGED = "white_ink_mie", (1.0, 30.0), 1_000_000
_CONFIG = SolverConfig(32, 24, 96, 4)


def solved(medium: Medium) -> dict[str, list[float]]:
    """R and T of the plate with the ink, by the solver."""
    with computing():
        ink = medium.stack(0).layers[0]
        stack = Stack((ClearLayer(1.5, 0.0), ink), 1.0, 1.0)
        both = hemispherical_power(stack, np.sin(np.deg2rad(INCIDENCES_DEG)), _CONFIG)
        return {side: [float(p) for p in powers] for side, powers in zip("RT", both, strict=True)}


def make() -> dict:
    """Everything, kept as it is made."""
    found = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    for name, wavelength_nm in INKS.items():
        medium = medium_of(find_ink(true_sample(f"{name}-mie"), inside="front"), [wavelength_nm])
        one = found.setdefault(name, {"solver": solved(medium), "mitsuba": {}})
        if "forms" not in one:
            one["forms"] = [
                [f.kind, f.numbers, f.reflectance, f.transmittance, f.bsdf_rms]
                for f in short_forms(medium, 0)
            ]
        with tempfile.TemporaryDirectory() as folder:
            write_volume(medium, "mitsuba", folder)
            (file,) = Path(folder).glob("*_medium.xml")
            plate = Plate(file, medium.thickness_um / 1000, float(medium.refractive_index[0]))
            for side in "RT":
                for theta in INCIDENCES_DEG:
                    key = f"{side} {theta:g}"
                    if key not in one["mitsuba"]:
                        one["mitsuba"][key] = power(plate, theta, side, N_PATHS[side], SEED)
                        FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
            for side in "RT":
                if side not in one.setdefault("speos", {}):
                    write_volume(medium, "speos", folder)
                    of_file = dataclasses.replace(plate, medium_file=Path(folder) / "ink.material")
                    one["speos"][side] = power(of_file, 0.0, side, N_PATHS[side], SEED)
                    FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
            if name == ENLARGED:
                for enlargement in ENLARGEMENTS:
                    thicker = dataclasses.replace(plate, enlargement=enlargement)
                    for theta in INCIDENCES_DEG:
                        key = f"{enlargement:g} {theta:g}"
                        if key not in one.setdefault("enlarged", {}):
                            one["enlarged"][key] = power(thicker, theta, "T", N_PATHS_ENLARGED, SEED + 1)
                            FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return found


def _enlarged(one: dict) -> dict[str, str]:
    """Difference of T from the solver, in per cent, by enlargement and incidence."""
    shown = {}
    for key, (value, error) in one["enlarged"].items():
        solver = one["solver"]["T"][INCIDENCES_DEG.index(float(key.split()[1]))]
        shown[key] = f"{_difference(value, error, solver)} %"
    return shown


def _difference(value: float, error: float, solver: float) -> str:
    """Relative difference from the solver in per cent, with its standard error."""
    return f"{100 * (value / solver - 1):+.2f} ± {100 * error / solver:.2f}"


def page(found: dict) -> str:
    """The page."""
    rows, forms = [], []
    for name, one in found.items():
        for key, (value, error) in one["mitsuba"].items():
            side, theta = key.split()
            solver = one["solver"][side][INCIDENCES_DEG.index(float(theta))]
            through = _difference(*one["speos"][side], solver) if key.endswith(" 0") else ""
            rows.append(
                [f"`{name}`", side, theta, f"{solver:.5f}", f"{value:.5f} ± {error:.5f}"]
                + [_difference(value, error, solver), through]
            )
        for kind, values, r, t, rms in one["forms"]:
            shown = ", ".join(f"{key} {value:.4g}" for key, value in values.items())
            forms.append([f"`{name}`", kind, shown, *(f"{100 * v:.2f}" for v in (r, t, rms))])
    heads = ["ink", "side", "incidence, deg", "jaxink", "Mitsuba", "difference, %", "by `.material`, %"]
    enlarged = _enlarged(found[ENLARGED])
    form_heads = ["ink", "form", "numbers", "R, % of incident", "T, % of incident", "BSDF, rms %"]
    return f"""# The ink as a volume

`jaxink export RESULT --as volume --format mitsuba` writes a homogeneous medium with a tabulated phase
function. Here it is read back and put between the faces of a plate (1 mm, index 1.5, without absorption, in
air) with Mitsuba's volumetric path tracer, variant `scalar_rgb`, which shares nothing with jaxink's solver.
The inks are the true ones of three simulated samples; the rough face of `white_ink_rough` is smooth here. R
and T include regular light. The last column is the same through a file of Speos, which is read back, too (a
table of the phase function by angle instead of its cosine). This page is made by
`python -m benchmarks.validation.render`.

{table(heads, rows)}

± is one standard error, from 20 batches ({N_PATHS["R"]} paths for R and {N_PATHS["T"]} for T; the first row
has 200000). The aim is agreement within 1 % with an error of 0.3 %. Some errors are larger and would need
more paths. T of `white_ink_mie` is a per cent too high at both incidences. The cause is Mitsuba's single
precision: a ray goes on at a distance from each face that grows with its coordinates, and the mean free path
of this ink, 1.7 um, is the shortest. R and T of a slab do not change if its ink is made 30 times thicker and
its coefficients 30 times smaller, but then the distance no longer counts. With {N_PATHS_ENLARGED} paths and
another seed, T differs from the solver by {enlarged["1 0"]} and {enlarged["1 45"]} (0 and 45 degrees)
as it is, and by {enlarged["30 0"]} and {enlarged["30 45"]} enlarged.

## Short forms of the phase function

For programs whose dialogue takes a few numbers, the sheet of values gives the closest short form of each
kind, which has the same mean cosine, and what the layer's light differs by: the largest difference of
hemispherical R and T from inside the plate at 0, 30 and 60 degrees, and the relative difference of the BSDF
up to 75 degrees. A second lobe of Henyey and Greenstein gains nothing here: the second Legendre moment of
these spheres is below g^2, and that of every mixture of such lobes with the same mean cosine is above it.

{table(form_heads, forms)}

{guide_section(guide.numbers())}

{dot_size_section(dot_size.numbers())}

{booth_section(booth.numbers())}
"""


if __name__ == "__main__":
    write_page("render.md", page(make()))
