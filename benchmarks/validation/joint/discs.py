"""Stacks of PTFE discs as one project: a specimen for each thickness, an instrument for each angle.

Transmittances only (`ptfe_discs_rt_uzh`): the scale of each angle is a free gain of its instrument, and the
thickness of each stack a free parameter with the stated uncertainty as its prior. The same model as `one
slab, n = 1.35` of docs/validation/measured-totals.md, which propagates the thickness error by hand.
"""

import csv
import tempfile
from pathlib import Path

import jaxink
from benchmarks.pages import data_folder
from jaxink.fitting import FitOptions
from jaxink.numerics.digits import with_uncertainty
from jaxink.projects import parse_project

NAME, FILE = "ptfe_discs_rt_uzh", "rt_vs_thickness.csv"
THICKNESS_SIGMA_UM = 50.0
# The scales have no meaning: values at an angle are divided by that of the first single thick disc, and the
# gains are relative to a transmittance of it that is near the model's.
REFERENCE_MM, NEAR = 2.05, 0.13
_HEAD = """schema_version = 1
title = "Stacks of PTFE discs, one slab each, three angles"
[sample]
wavelength_nm = 450
[[sample.layers]]
name = "ptfe"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.35
thickness_um = 1000
scattering_per_mm = { free = true, value = 10, min = 0.5, max = 1000 }
absorption_per_mm = { free = true, value = 0.003, min = 0, max = 1 }
asymmetry_parameter = 0.5
"""
_GAIN = (
    "[instruments.at_{angle}]\neffects.gain.relative = {{ free = true, value = 0, min = -0.5, max = 0.5 }}\n"
)
_SPECIMEN = """[specimens.stack_{um}]
ptfe.thickness_um = {{ value = {um}, free = true, min = {low}, max = {high}, prior = {{ mean = {um}, \
standard_deviation = {sigma} }} }}
"""
_MEASUREMENT = """[[measurements]]
name = "stack_{um}_at_{angle}"
readings = "{um}_{angle}.csv"
specimen = "stack_{um}"
instrument = "at_{angle}"
"""


def project(folder: Path) -> jaxink.Project:
    """The project; its files of one reading each are written to a folder."""
    with (data_folder("measured") / NAME / FILE).open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["side"] == "T"]
    reference = {
        r["theta_i_deg"]: float(r["value"]) for r in rows if float(r["thickness_mm"]) == REFERENCE_MM
    }
    angles = sorted(reference)
    stacks = sorted({round(1000 * float(row["thickness_mm"])) for row in rows})
    text = _HEAD + "".join(_GAIN.format(angle=angle) for angle in angles)
    for um in stacks:
        low, high = max(um - 5 * THICKNESS_SIGMA_UM, 20), um + 5 * THICKNESS_SIGMA_UM
        text += _SPECIMEN.format(um=um, low=low, high=high, sigma=THICKNESS_SIGMA_UM)
    for row in rows:
        um, angle = round(1000 * float(row["thickness_mm"])), row["theta_i_deg"]
        scale = NEAR / reference[angle]
        value, sigma = scale * float(row["value"]), scale * float(row["sigma"])
        (folder / f"{um}_{angle}.csv").write_text(
            f"quantity,theta_i_deg,wavelength_nm,value,sigma\nT_total,{angle},450,{value!r},{sigma!r}\n",
            encoding="utf-8",
        )
        text += _MEASUREMENT.format(um=um, angle=angle)
    return parse_project(text, NAME, folder)


def fitted() -> dict:
    """What the joint fit of all thicknesses and angles finds."""
    with tempfile.TemporaryDirectory() as folder:
        made = project(Path(folder))
    result = jaxink.fit(made, options=FitOptions(accuracy=1e-3, profile="none"))
    ptfe = next(iter(result.measurements.values()))
    values, errors = result.values, result["ptfe.scattering_per_mm"].standard_error
    asymmetry = values["ptfe.asymmetry_parameter"]
    pulls = {
        name: (p.value - float(name.split("/")[0].removeprefix("stack_"))) / THICKNESS_SIGMA_UM
        for name, p in result.parameters.items()
        if name.endswith("ptfe.thickness_um") and p.free
    }
    return {
        "chi_square_with_priors": result.loss,
        "chi_square": result.chi_square,
        "points": result.points,
        "free": result.n_free,
        "reduced_scattering_per_mm": values["ptfe.scattering_per_mm"] * (1 - asymmetry),
        "standard_error": None if errors is None else errors * (1 - asymmetry),
        "absorption_per_mm": values["ptfe.absorption_per_mm"],
        "absorption_standard_error": result["ptfe.absorption_per_mm"].standard_error,
        "thickness_pulls": pulls,
        "verdict": result.verdict.sentence,
        "agreement": result.agreement and result.agreement.sentence,
        "noise": ptfe.noise_sentence,
    }


def told(found: dict | None) -> str:
    """The stacks of discs as one project, beside the fit by hand."""
    if found is None:
        return "The stacks of discs were not fitted."
    scattering = with_uncertainty(found["reduced_scattering_per_mm"], found["standard_error"])
    absorption = with_uncertainty(found["absorption_per_mm"], found["absorption_standard_error"])
    pulls = ", ".join(
        f"{name.split('/')[0].removeprefix('stack_')} um {pull:+.1f}"
        for name, pull in found["thickness_pulls"].items()
    )
    return (
        f"`{NAME}`: transmittances of stacks of discs, {found['points']} measurements of one reading "
        "each, eight specimens and three instruments: one slab with a free gain for each angle, and the "
        "thickness of each stack free with its stated error as prior. Reduced scattering "
        f"{scattering} 1/mm, absorption {absorption} 1/mm, chi-square with priors "
        f"{found['chi_square_with_priors']:.1f}. By hand, the error of the thickness propagated into the "
        "covariance, they are 4.4(8), 0.0035(16) and 44.3 ([measured totals](measured-totals.md)). The "
        f"thicknesses move by, in standard deviations of the prior: {pulls}. {found['agreement']}"
    )
