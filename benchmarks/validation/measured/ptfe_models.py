"""Models of the sintered PTFE, from one lobe to a surface layer and a relief, a part of relief.md.

python -m benchmarks.validation.measured.ptfe_models [NAME ...]

Each model is fitted from several starts and from the solutions of smaller ones; the lowest fit counts. The
largest is also fitted without each incidence in turn and at the other wavelengths, and it predicts
Spectralon. Models that are named are fitted anew; the section is written from all that is kept. No measured
value is kept.
"""

import dataclasses
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from string import Template

import numpy as np

import jaxink
from benchmarks.pages import filled, rms, table, write_section
from benchmarks.validation.measured.diagnosis import OTHER_WAVELENGTHS_NM, measured
from benchmarks.validation.measured.diagnosis_page import SPECTRALON_NM
from jaxink.errors import JaxinkError
from jaxink.fitting import FitResult, predict_left_out
from jaxink.measurement import symmetry_repeatability

KEPT = Path(__file__).with_suffix(".json")
SAMPLE = Template(Path(__file__).with_suffix(".toml.in").read_text(encoding="utf-8"))
MARK = "made by python -m benchmarks.validation.measured.ptfe_models"
WAVELENGTH_NM = 532.0
OPTIONS = jaxink.FitOptions(profile="none", accuracy=1e-3)
# Where fits start: asymmetry of the lobes and weight of the second; depth and asymmetry of the surface layer.
LOBES = ((0.45, -0.2, 0.1), (0.6, -0.4, 0.4))
SURFACES = ((0.3, 0.0), (1.0, 0.6))
# (Nearly) absent, beside the solution of a model that lacks the effect.
ABSENT = {"relief.slope_variance": 0.0, "surface_layer.optical_thickness": 0.01}
FREE_ALBEDO = "{ free = true, value = 0.9999, min = 0.9, max = 1.0 }"
RELIEF = "\n[effects.relief]\nslope_variance = { free = true, value = 0.005, min = 0.0, max = 0.5 }\n"


def one_lobe(effects: str = "") -> list[str]:
    """A sample file for each start: one lobe, no interface."""
    simple = {"phase_function": "henyey_greenstein", "refractive_index": "1.0", "asymmetry": 0.3}
    return [SAMPLE.substitute(simple, wavelength_nm=WAVELENGTH_NM, further="") + effects]


def two_lobes(*effects: str) -> list[str]:
    """The same with two lobes and a face of free index, for each form of the effects."""
    texts = []
    for first, second, weight in LOBES:
        further = (
            f"second_asymmetry_parameter = {{ free = true, value = {second}, min = -0.9, max = 0.95 }}\n"
            f"second_weight = {{ free = true, value = {weight}, min = 0.0, max = 1.0 }}"
        )
        text = SAMPLE.substitute(
            wavelength_nm=WAVELENGTH_NM,
            phase_function="two_term_henyey_greenstein",
            refractive_index="{ free = true, value = 1.05, min = 1.0, max = 1.6 }",
            asymmetry=first,
            further=further,
        )
        texts += [text + effect for effect in effects or ("",)]
    return texts


def surface_layers(albedo: str) -> list[str]:
    """The surface layer from each start."""
    return [
        f"""
[effects.surface_layer]
optical_thickness = {{ free = true, value = {depth}, min = 0.0, max = 5.0 }}
asymmetry_parameter = {{ free = true, value = {asymmetry}, min = -0.9, max = 0.95 }}
single_scattering_albedo = {albedo}
"""
        for depth, asymmetry in SURFACES
    ]


MODELS = {
    "one lobe": one_lobe(),
    "one lobe, relief": one_lobe(RELIEF),
    "two lobes, index": two_lobes(),
    "two lobes, index, relief": two_lobes(RELIEF),
    "two lobes, index, surface layer": two_lobes(*surface_layers("0.99995")),
    "two lobes, index, surface layer, relief": two_lobes(
        *(one + RELIEF for one in surface_layers("0.99995"))
    ),
    "all of these, albedo of the surface layer free": two_lobes(
        *(one + RELIEF for one in surface_layers(FREE_ALBEDO))
    ),
}
LARGEST = "two lobes, index, surface layer, relief"


def ratios(result: FitResult, predicted: np.ndarray) -> list[list[float]]:
    """Relative rms of each incidence over the noise of its pairs."""
    used = result.data.used
    incidence, bsdf = result.data.theta_i_deg[used], result.data.bsdf_per_sr[used]
    pairs = {one.scan.theta_i_deg: one.relative for one in symmetry_repeatability(result.data)}
    relative = predicted / bsdf - 1
    return [[float(a), rms(relative[incidence == a]) / pairs[float(a)]] for a in np.unique(incidence)]


def starts(texts: list[str], smaller: list[dict[str, float]]) -> Iterator[jaxink.Sample]:
    """The samples that fits start from: as written, and at the solutions of smaller models."""
    samples = [jaxink.parse_sample(text) for text in texts]
    yield from samples
    table = samples[0].parameters
    free = {p.name for p in table.free}
    for name in ABSENT.keys() & free:
        table = table.replace(name, value=ABSENT[name])
    for values in smaller:
        if values.keys() < free:
            there = table
            for name, value in values.items():
                there = there.replace(name, value=value)
            yield dataclasses.replace(samples[0], parameters=there)


def fitted(data, texts: list[str], smaller: list[dict[str, float]]) -> tuple[FitResult, list[float]]:
    """The lowest fit from all starts, and chi-square of each."""
    found = []
    for sample in starts(texts, smaller):
        try:
            found.append(jaxink.fit(data, sample, OPTIONS))
        except JaxinkError as error:
            print(f"a start is lost: {error}", flush=True)
    best = min(found, key=lambda one: one.merit.chi_square)
    return best, sorted(float(one.merit.chi_square) for one in found)


def summary(result: FitResult, chi_squares: list[float]) -> dict:
    """What is kept of a fit."""
    free = {name: one for name, one in result.parameters.items() if one.free}
    return {
        "free": len(free),
        "points": int(result.merit.points),
        "chi_square": float(result.merit.chi_square),
        "starts": chi_squares,
        "ratios": ratios(result, result.predicted_per_sr),
        "parameters": {name: [one.value, one.standard_error, one.flag] for name, one in free.items()},
    }


def further(result: FitResult, data) -> dict:
    """Incidences left out, other wavelengths, and Spectralon, by the model of a fit."""
    incidence = result.data.theta_i_deg[result.data.used]
    angles = np.unique(incidence)
    folds = np.array([incidence == angle for angle in angles])
    alone = predict_left_out(result, folds)
    left_out = np.sum(alone * folds, axis=0)
    others = {}
    for nm in OTHER_WAVELENGTHS_NM:
        texts = [text.replace(f"{WAVELENGTH_NM}", f"{nm}") for text in MODELS[LARGEST]]
        others[f"{nm:g}"] = summary(*fitted(data.select(wavelength_nm=nm), texts, []))
    panel = measured("spectralon_rsg_blacklab", "brdf_nadir_view.csv").select(wavelength_nm=SPECTRALON_NM)
    predicted = jaxink.predict_at(
        result.sample, panel.theta_i_deg, panel.theta_o_deg, panel.phi_deg, WAVELENGTH_NM, accuracy=1e-3
    ).bsdf_per_sr
    ratio = np.asarray(predicted) / panel.bsdf_per_sr
    return {
        "left_out": ratios(result, left_out),
        "other_wavelengths": others,
        "spectralon": {
            "rms": rms(ratio - 1),
            "level": float(ratio.mean()),
            "shape": rms(ratio / ratio.mean() - 1),
        },
    }


def _cells(pairs: list[list[float]]) -> list[str]:
    return [f"{ratio:.2f}" for _, ratio in pairs]


def write(kept: dict) -> None:
    """The section."""
    rows, largest = [], kept[LARGEST]
    for name in MODELS:
        one = kept[name]
        starts = ", ".join(f"{value:.0f}" for value in one["starts"])
        rows.append([name, str(one["free"]), starts, *_cells(one["ratios"])])
    for nm, one in largest["further"]["other_wavelengths"].items():
        starts = ", ".join(f"{value:.0f}" for value in one["starts"])
        rows.append([f"the largest at {nm} nm", str(one["free"]), starts, *_cells(one["ratios"])])
    rows.append(["the largest, each incidence left out", "", "", *_cells(largest["further"]["left_out"])])
    angles = [f"{angle:g} deg" for angle, _ in largest["ratios"]]
    parameters = [
        [name, f"{value:.6g}", "" if error is None else f"{error:.2g}", flag]
        for name, (value, error, flag) in largest["parameters"].items()
    ]
    panel = largest["further"]["spectralon"]
    text = filled(
        Path(__file__).with_suffix(".md.in"),
        wavelength_nm=WAVELENGTH_NM,
        points=largest["points"],
        models=table(["model", "free", "chi-square", *angles], rows),
        parameters=table(["parameter", "value", "standard error", "flag"], parameters),
        spectralon_nm=SPECTRALON_NM,
        level=panel["level"],
        shape=100 * panel["shape"],
    )
    write_section("relief.md", MARK, text)


def main() -> None:
    """Fit what is named or missing, keep it, and write the section."""
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    data = measured("ptfe_nist_germer", "brdf_regular.csv")
    for name, texts in MODELS.items():
        if name in kept and name not in sys.argv[1:]:
            continue
        smaller = [{n: v for n, (v, *_) in one["parameters"].items()} for one in kept.values()]
        result, chi_squares = fitted(data.select(wavelength_nm=WAVELENGTH_NM), texts, smaller)
        kept[name] = summary(result, chi_squares)
        if name == LARGEST:
            kept[name]["further"] = further(result, data)
        print(name, kept[name], flush=True)
        KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    write(kept)


if __name__ == "__main__":
    main()
