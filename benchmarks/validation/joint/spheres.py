"""Sphere readings of `sphere_totals_iad` as projects: dilution series, and a phantom at several wavelengths.

Rows of a dilution series are written as files of the inverse adding-doubling program, which they were taken
from, so that a fit reads them as a user of that program would give them. Those of a phantom are written with
the sphere of docs/validation/measured-totals.md, whose numbers they are compared with.
"""

import math
import tempfile
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.montecarlo import HenyeyGreenstein, Layer, Sample, simulate
from benchmarks.pages import table
from benchmarks.validation.totals.layers import rows_of
from benchmarks.validation.totals.sphere import SPHERE
from jaxink.fitting import FitOptions
from jaxink.numerics.digits import rounded, with_uncertainty
from jaxink.projects import parse_project

# Liquids in a cuvette, three readings a row, diluted in steps and each series repeated.
SERIES = ("intralipid_A_royston", "intralipid_B_royston", "intralipid_C_royston")
# With two readings a row, the asymmetry of docs/validation/measured-totals.md, or that of the file.
PHANTOMS = {
    "tio2_phantom": ((500.0, 633.0, 800.0), 0.6),
    "phantom_510nm_series": ((1055.6, 1253.0, 1604.7), None),
}
# The laser line is not stated; nothing in the model depends on it.
_UNSTATED_NM = 633.0
# The noise is not stated either.
_RELATIVE, _FLOOR = 0.01, 0.0005
# A dilution of a collimated transmittance like that of the first rows, with the asymmetry and absorption that
# Intralipid has in the red.
_INTRALIPID = {"scattering_per_mm": 1.77, "absorption_per_mm": 3e-4, "asymmetry": 0.75}
_PHOTONS = 30_000
LOST = "share beside the port"
_LETTERS = {"sphere_M_R": "r", "sphere_M_T": "t", "unscattered_M_U": "u"}
_HEADER = (
    *("n_sample", "n_slides", "sample_thickness_mm", "slide_thickness_mm", "beam_diameter_mm"),
    *("r_standard", "n_spheres"),
    *(
        f"R_{key}"
        for key in ("sphere_d_mm", "sample_port_mm", "entrance_port_mm", "detector_port_mm", "wall")
    ),
    *(f"T_{key}" for key in ("sphere_d_mm", "sample_port_mm", "exit_port_mm", "detector_port_mm", "wall")),
)
_SAMPLE = """schema_version = 1
title = "Sphere readings of {name}"
[sample]
wavelength_nm = {wavelength}
[sample.noise]
relative = {relative}
floor_per_sr = {floor}
[[sample.layers]]
name = "front_slide"
kind = "clear"
refractive_index = {slide}
thickness_mm = {slide_mm}
[[sample.layers]]
name = "liquid"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = {index}
thickness_um = {thickness_um}
scattering_per_mm = {{ free = true, value = {scattering}, min = 0.01, max = 200 }}
absorption_per_mm = {{ free = true, value = {absorption}, min = 0, max = 20 }}
asymmetry_parameter = {asymmetry}
[[sample.layers]]
name = "back_slide"
kind = "clear"
refractive_index = {slide}
thickness_mm = {slide_mm}
"""
_OWN_SCATTERING = "{{ free = true, value = {value:.4g}, min = 0.01, max = 200 }}"


def series_fitted(name: str) -> dict:
    """Joint fit of a dilution series: scattering of each row, common absorption and asymmetry."""
    header, rows = _header(name), _rows(name)
    text = _SAMPLE.format(
        **_common(name, header),
        wavelength=_UNSTATED_NM,
        index=header["n_sample"],
        slide=header["n_slides"],
        scattering=10,
        absorption=0.01,
        asymmetry="{ free = true, value = 0.7, min = 0, max = 0.98 }",
    )
    with tempfile.TemporaryDirectory() as folder:
        for number, readings in rows.items():
            (Path(folder) / f"{number}.rxt").write_text(_rxt(header, readings), encoding="utf-8")
            own = _OWN_SCATTERING.format(value=3 + 20 * readings["sphere_M_R"])
            text += f"""[[measurements]]
name = "row_{number}"
readings = "{number}.rxt"
reading.wavelength_nm = {_UNSTATED_NM}
changes.liquid.scattering_per_mm = {own}
"""
        result = jaxink.fit(parse_project(text, name, Path(folder)), options=_OPTIONS)
    return _said(result, "liquid.absorption_per_mm", "liquid.asymmetry_parameter")


def share_beside_port() -> dict:
    """Share of the light that leaves a cuvette of Intralipid beside the sample port, by Monte Carlo."""
    header, found = _header(SERIES[-1]), _INTRALIPID
    slide = Layer(float(header["n_slides"]), float(header["slide_thickness_mm"]))
    phase = HenyeyGreenstein(found["asymmetry"])
    liquid = Layer(
        float(header["n_sample"]),
        float(header["sample_thickness_mm"]),
        found["scattering_per_mm"],
        found["absorption_per_mm"],
        phase,
    )
    radii = {
        "beam_radius_mm": float(header["beam_diameter_mm"]) / 2,
        "seen_radius_mm": float(header["R_sample_port_mm"]) / 2,
    }
    lost = simulate(Sample((slide, liquid, slide), **radii), 0.0, _PHOTONS).powers["lost"]
    return {"lost": float(np.mean(lost)), "standard_error": float(np.std(lost, ddof=1) / np.sqrt(len(lost)))}


def phantom_fitted(name: str) -> dict:
    """What a fit of one phantom at all its wavelengths finds."""
    header, (wavelengths_nm, asymmetry) = _header(name), PHANTOMS[name]
    text = _SAMPLE.format(
        **_common(name, header),
        wavelength=wavelengths_nm[0],
        index=header["n_sample"],
        slide=header["n_slides"],
        scattering=3,
        absorption=0.05,
        asymmetry=asymmetry or 0.5,
    )
    with tempfile.TemporaryDirectory() as folder:
        for wavelength in wavelengths_nm:
            readings = _at(name, wavelength)
            own = {"scattering_per_mm": "{ free = true, value = 3, min = 0.01, max = 200 }"}
            own["absorption_per_mm"] = "{ free = true, value = 0.05, min = 0, max = 20 }"
            slide = ""
            if asymmetry is None:
                own |= {
                    "asymmetry_parameter": readings["file_g"],
                    "refractive_index": readings["file_n_sample"],
                }
                slide = "".join(
                    f"changes.{side}_slide.refractive_index = {readings['file_n_slide']}\n"
                    for side in ("front", "back")
                )
            (Path(folder) / f"{wavelength:g}.csv").write_text(
                _csv(header, readings, wavelength), encoding="utf-8"
            )
            text += f"""[[measurements]]
name = "at_{wavelength:.0f}_nm"
readings = "{wavelength:g}.csv"
changes.wavelength_nm = {wavelength}
"""
            text += "".join(f"changes.liquid.{key} = {value}\n" for key, value in own.items()) + slide
        result = jaxink.fit(parse_project(text, name, Path(folder)), options=_OPTIONS)
    return _said(result)


_OPTIONS = FitOptions(accuracy=1e-4, profile="none")


def _header(name: str) -> dict[str, str]:
    return next(row for row in rows_of(SPHERE, "header_parameters.csv") if row["sample"] == name)


def _rows(name: str) -> dict[int, dict[str, float]]:
    """Readings of a series by row and kind."""
    found: dict[int, dict[str, float]] = {}
    for row in rows_of(SPHERE, "totals.csv"):
        if row["sample"] == name:
            found.setdefault(int(row["row"]), {})[row["unit"]] = float(row["value"])
    return found


def _at(name: str, wavelength_nm: float) -> dict[str, float]:
    return {
        row["unit"]: float(row["value"])
        for row in rows_of(SPHERE, "totals.csv")
        if row["sample"] == name and float(row["wavelength_nm"]) == wavelength_nm
    }


def _common(name: str, header: dict[str, str]) -> dict:
    return {
        "name": name,
        "relative": _RELATIVE,
        "floor": _FLOOR,
        "slide_mm": header["slide_thickness_mm"],
        "thickness_um": 1000 * float(header["sample_thickness_mm"]),
    }


def _rxt(header: dict[str, str], readings: dict[str, float]) -> str:
    read = {letter: readings[unit] for unit, letter in _LETTERS.items() if unit in readings}
    numbers = " ".join(header[key] for key in _HEADER)
    return f"IAD1\n{numbers}\n{' '.join(read)}\n{' '.join(map(str, read.values()))}\n"


def _csv(header: dict[str, str], readings: dict[str, float], wavelength_nm: float) -> str:
    """The readings with the sphere of that page, whose ports are black."""
    lines = [
        "quantity,value,wavelength_nm,theta_i_deg,"
        "sphere_wall_reflectance,sphere_port_fraction,sphere_reference"
    ]
    for side, third in (("R", "entrance"), ("T", "exit")):
        sample, other, detector = (
            (1 - math.sqrt(1 - (float(header[f"{side}_{port}_port_mm"]) / _diameter(header, side)) ** 2)) / 2
            for port in ("sample", third, "detector")
        )
        wall = float(header[f"{side}_wall"]) * (1 - sample - other - detector) / (1 - sample)
        standard = float(header["r_standard"])
        # The standard fills the exit port, whose share of the sphere is another one.
        reference = standard if side == "R" else standard * other / sample
        row = (f"{side}_total", readings[f"sphere_M_{side}"], wavelength_nm, 0, wall, sample, reference)
        lines.append(",".join(map(str, row)))
    return "\n".join(lines) + "\n"


def _diameter(header: dict[str, str], side: str) -> float:
    return float(header[f"{side}_sphere_d_mm"])


def _said(result, *shared: str) -> dict:
    """What the page tells of a joint fit."""
    return {
        "points": result.points,
        "free": result.n_free,
        "chi_square": result.chi_square,
        "values": {n: [p.value, p.standard_error] for n, p in result.parameters.items() if p.free},
        "shared": {n: [result.values[n], result[n].standard_error] for n in shared},
        "verdict": result.verdict.sentence,
        "agreement": result.agreement and result.agreement.sentence,
    }


def told(results: dict) -> str:
    """The page's tables of both."""
    series = [
        [
            f"`{name}`",
            f"{found['points']} - {found['free']}",
            rounded(found["chi_square"] / (found["points"] - found["free"]), 3),
            *(
                with_uncertainty(*found["shared"][f"liquid.{key}"])
                for key in ("asymmetry_parameter", "absorption_per_mm")
            ),
        ]
        for name in SERIES
        if (found := results.get(name))
    ]
    phantoms = []
    for name in PHANTOMS:
        for key, (value, error) in results.get(name, {"values": {}})["values"].items():
            if key.endswith("scattering_per_mm"):
                absorption = results[name]["values"][key.replace("scattering", "absorption")]
                at = key.partition("/")[0].removeprefix("at_").replace("_", " ")
                phantoms.append(
                    [f"`{name}`", at, with_uncertainty(value, error), with_uncertainty(*absorption)]
                )
    heads = ["series", "readings - parameters", "reduced chi-square", "asymmetry", "absorption, 1/mm"]
    both = ["phantom", "wavelength", "scattering, 1/mm", "absorption, 1/mm"]
    lost = results[LOST]
    beside = (
        f"Of a cuvette of {_INTRALIPID['scattering_per_mm']:g} scatterings per mm (g = "
        f"{_INTRALIPID['asymmetry']:g}, absorption {_INTRALIPID['absorption_per_mm']:g} 1/mm), "
        f"{100 * lost['lost']:.1f} +- {100 * lost['standard_error']:.1f} % of the light leaves beside the "
        "port (own Monte Carlo), which a slab takes for absorption."
    )
    return f"{table(heads, series)}\n\n{beside}\n\nThe phantoms:\n\n{table(both, phantoms)}"
