"""Models of the black paint under a surface in wave optics; writes docs/validation/measured-paint.md.

python -m benchmarks.validation.measured.paint_models [NAME ...]

Models that are named or missing are fitted; the page is written from all that is kept. No measured value is
kept.
"""

import json
import sys
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.pages import filled, machine, rms, table, write_page
from benchmarks.validation.measured.diagnosis import SAMPLES, measured
from jaxink.fitting import FitResult, predict_left_out
from jaxink.numerics.precision import computing
from jaxink.residual import ResidualPoints, residual_shape
from jaxink.surfaces.spectrum import KCorrelation
from jaxink.surfaces.wave_power import validity
from jaxink.surfaces.wave_surface import WaveSurface

KEPT = Path(__file__).with_suffix(".json")
# As the paint's other fits: its noise is not known well enough to weigh by it.
OPTIONS = jaxink.FitOptions(objective="relative", accuracy=1e-3)
VALID_AT_DEG = 50.0

_WAVES = (SAMPLES / "paint_z307_black_waves.toml").read_text(encoding="utf-8")
_FACETS = (SAMPLES / "paint_z307_black_two_lobes.toml").read_text(encoding="utf-8")
_INDEX = "refractive_index = { free = true, value = 1.3, min = 1.02, max = 1.7 }"
_ONE_TERM = "asymmetry_parameter = { free = true, value = 0.0, min = -0.6, max = 0.9 }"
_TWO_TERMS = """asymmetry_parameter = { free = true, value = 0.5, min = -0.6, max = 0.95 }
second_asymmetry_parameter = { free = true, value = -0.5, min = -0.95, max = 0.9 }
second_weight = { free = true, value = 0.4, min = 0, max = 1 }"""
_WEAK_INTERFACE = "\n[effects.weak_interface]\nshare = { free = true, value = 0.3, min = 0, max = 1 }\n"
_RETRO = """
[effects.shadow_hiding]
amplitude = { free = true, value = 0.1, min = 0, max = 1 }
width = { free = true, value = 0.2, min = 0.01, max = 0.4 }
"""


def _two_terms(text: str) -> str:
    return text.replace('"henyey_greenstein"', '"two_term_henyey_greenstein"').replace(_ONE_TERM, _TWO_TERMS)


# In front of the paint, with the rough face; the paint's own face is then smooth. It starts opaque, at the
# solution without it: from a clear start, a fit ended higher than that (0.098).
_COAT = """
[[layers]]
name = "coat"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = { free = true, value = 1.26, min = 1.02, max = 1.7 }
thickness_um = 20
scattering_per_mm = { free = true, value = 25, min = 0.01, max = 1000 }
absorption_per_mm = { free = true, value = 125, min = 0, max = 1000 }
asymmetry_parameter = { free = true, value = -0.1, min = -0.9, max = 0.9 }
"""


def _coated(text: str) -> str:
    head, layer = text.split("[[layers]]")
    layer, face = layer.split("[layers.front_roughness]")
    face, masks = face.split("[masks]")
    layer = layer.replace(_INDEX, "refractive_index = 1.5")
    for start, at in (
        ("value = 0.6", "value = 1.83"),
        ("value = 5,", "value = 101,"),
        ("value = 4,", "value = 3.56,"),
    ):
        face = face.replace(start, at)
    return f"{head}{_COAT}\n[layers.front_roughness]{face}\n[[layers]]{layer}\n[masks]{masks}"


def _graded(text: str) -> str:
    return text.replace(_INDEX, "refractive_index = 1.5") + _WEAK_INTERFACE


BEST = "waves, two terms"
MODELS = {
    "facets of two densities, two terms": _two_terms(_FACETS),
    "waves, one term": _WAVES,
    BEST: _two_terms(_WAVES),
    "waves, one term, retro enhancement": _WAVES + _RETRO,
    "waves, two terms, retro enhancement": _two_terms(_WAVES) + _RETRO,
    "waves, two terms, index 1.5 with a weak interface": _graded(_two_terms(_WAVES)),
    "waves on a pigmented coat with an index of its own": _coated(_WAVES),
}


def by_incidence(result: FitResult, predicted: np.ndarray) -> list[float]:
    """Rms of ln(model / measured), of all points and at each incidence."""
    used = result.data.used
    misfit, incidence = np.log(predicted / result.data.bsdf_per_sr[used]), result.data.theta_i_deg[used]
    return [rms(misfit), *(rms(misfit[incidence == angle]) for angle in np.unique(incidence))]


def theory(result: FitResult) -> dict[str, float] | None:
    """What the theory of waves says of its own validity; None for facets."""
    values = result.values
    outermost = result.sample.layers[0].name
    if f"{outermost}.front_roughness.exponent" not in values:
        return None
    height, length, exponent = (
        values[f"{outermost}.front_roughness.{key}"] for key in ("height_rms_um", "length_b_um", "exponent")
    )
    with computing():
        spectrum = KCorrelation(height**2, length, exponent)
        surface = WaveSurface(
            spectrum, 1.0, values[f"{outermost}.refractive_index"], result.scans[0].wavelength_nm
        )
        found = validity(surface, float(np.cos(np.deg2rad(VALID_AT_DEG))))
    return {key: float(found[key]) for key in ("a_sigma_reflection", "slope", "power_error")}


def shape(result: FitResult) -> str:
    """The shape of the residual in words."""
    every = np.ones(result.merit.points)
    noise = result.sigma_per_sr, result.noise["scan_relative"], result.whitened, every
    return residual_shape(ResidualPoints.of(result.data, result.predicted_per_sr, *noise)).sentence


def summary(result: FitResult) -> dict:
    """What is kept of a fit."""
    free = [p for p in result.parameters.values() if p.free]
    return {
        "points": int(result.merit.points),
        "outcome": result.outcome.name.lower(),
        "ln_rms": by_incidence(result, result.predicted_per_sr),
        "parameters": {p.name: [p.value, p.flag] for p in free},
        "theory": theory(result),
        "shape": shape(result),
    }


def left_out(result: FitResult) -> list[float]:
    """As `by_incidence`, each incidence predicted by a fit of the others."""
    incidence = result.data.theta_i_deg[result.data.used]
    folds = np.array([incidence == angle for angle in np.unique(incidence)])
    return by_incidence(result, np.sum(predict_left_out(result, folds) * folds, axis=0))


def write(kept: dict[str, dict], angles: list[float]) -> None:
    """The page."""
    rows = []
    for name in MODELS:
        if name not in kept:
            continue
        one, of_theory = kept[name], kept[name]["theory"]
        slope = "" if of_theory is None else f"{of_theory['slope']:.2f}"
        phase = "" if of_theory is None else f"{of_theory['a_sigma_reflection']:.1f}"
        ln_rms = [f"{value:.3f}" for value in one["ln_rms"]]
        rows.append([name, str(len(one["parameters"])), *ln_rms, slope, phase])
    best = kept[BEST]
    rows.append([f"{BEST}, each incidence left out", "", *(f"{v:.3f}" for v in best["left_out"]), "", ""])
    at = [f"{angle:g} deg" for angle in angles]
    names = [BEST, "waves, two terms, index 1.5 with a weak interface"]
    every = dict.fromkeys(name for model in names for name in kept[model]["parameters"])
    parameters = [
        [name]
        + [
            " ".join(filter(None, (f"{found[0]:.4g}", found[1]))) if found else ""
            for found in (kept[model]["parameters"].get(name) for model in names)
        ]
        for name in every
    ]
    text = filled(
        Path(__file__).with_suffix(".md.in"),
        machine=machine(),
        points=best["points"],
        models=table(["model", "free", "all", *at, "slope", "phase, rad"], rows),
        parameters=table(["parameter", *names], parameters),
        valid_at=VALID_AT_DEG,
        power=100 * best["theory"]["power_error"],
        shape=best["shape"],
    )
    write_page("measured-paint.md", text)


def main() -> None:
    """Fit what is named or missing, keep it, and write the page."""
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    data = measured("paint_z307_black", "brdf_inplane.csv")
    for name, text in MODELS.items():
        if name in kept and name not in sys.argv[1:]:
            continue
        result = jaxink.fit(data, jaxink.parse_sample(text), OPTIONS)
        kept[name] = summary(result)
        if name == BEST:
            kept[name]["left_out"] = left_out(result)
        print(name, kept[name], flush=True)
        KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    write(kept, [float(angle) for angle in np.unique(data.theta_i_deg)])


if __name__ == "__main__":
    main()
