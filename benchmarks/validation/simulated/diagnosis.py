"""Diagnose every simulated measurement and write the table of docs/validation/simulated.md.

python -m benchmarks.validation.simulated.diagnosis [NAME ...]

Each case is diagnosed in a process of its own and its report kept in reports/NAME.json; with names, only
these are diagnosed anew. The table is written from all reports that are there.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.pages import machine, table, write_section
from benchmarks.simulated_data import data_file, declared_text, names, truth_of
from jaxink.diagnosis import read_report

MARK = "undeclared effects, by benchmarks.validation.simulated.diagnosis"
REPORTS = Path(__file__).parent / "reports"
# Name of the catalogue for each effect of the truth files.
EFFECT_OF = {
    "E1": "rough_ink",
    "E2": "polydispersity",
    "E3": "structure_factor",
    "E4": "thin_patches",
    "E5": "backing",
    "E6": "angle_offset",
    "E7": "blur",
    "E8": "stray_light",
    "E9": "lateral_loss",
    "E10": "second_lobe",
    "E11": "plate_absorption",
    "E12": "fluorescence",
    "E13": "gain",
    "E14": "binder_index",
    "E15": "air_gap",
    "E16": "incidence_angle",
}
_QUANTITIES = {"mus": "scattering_per_mm", "mua": "absorption_per_mm", "g": "asymmetry_parameter"}
_PARTICLES = {
    "radius_nm": "radius_nm",
    "pvc": "volume_fraction",
    "n_re": "particle_index",
    "n_im": "particle_absorption_index",
}


def true_values(truth: dict) -> dict[str, float]:
    """Hidden values of the declared model's parameters, by their names in a sample file."""
    ink = truth["ink"]
    phase = ink["phase"]
    if phase["type"] == "mie":
        return {f"ink.{name}": phase[key] for key, name in _PARTICLES.items() if key in phase}
    values = {f"ink.{name}": ink.get(key, phase.get(key)) for key, name in _QUANTITIES.items()}
    waves = [here["wavelength_nm"] for here in truth["optics"]]
    several = {name: value for name, value in values.items() if isinstance(value, list)}
    each = {
        f"{name}@{wave:g}": one
        for name, value in several.items()
        for wave, one in zip(waves, value, strict=True)
    }
    return {name: value for name, value in values.items() if name not in several} | each


def true_strengths(truth: dict) -> dict[str, float]:
    """Hidden strengths whose definition agrees with the catalogue's, by the name of the term."""
    effects, found = truth["effects"], {}
    if "E1" in effects:
        found["ink.back_roughness.sigma_deg"] = effects["E1"]["sigma_deg"]
    if "E3" in effects:
        found["ink.structure_factor_weight"] = 1.0
    if "E4" in effects:
        (_, _), (share, ratio) = effects["E4"]["patches"]
        found |= {"thin_patches.share": share, "thin_patches.thickness_ratio": ratio}
    if "E5" in effects:
        found["backing.reflectance"] = effects["E5"]["albedo"]
    if "E6" in effects:
        found["angle_offset.angle_deg"] = effects["E6"]["offset_deg"]
    if "E7" in effects:
        found |= {
            "blur.wing_share": effects["E7"]["wing_fraction"],
            "blur.wing_half_width_deg": effects["E7"]["wing_hwhm_deg"],
            "blur.core_variance_deg2": (effects["E7"]["core_fwhm_deg"] / 2.3548) ** 2,
        }
    if effects.get("E8", {}).get("mode") == "bsdf":
        found["stray_light.level_per_sr"] = effects["E8"]["level"]
    if "E9" in effects:
        found["instrument.detector_diameter_mm"] = 2 * effects["E9"]["det_r_mm"]
        found["instrument.beam_diameter_mm"] = 2 * effects["E9"]["beam_r_mm"]
    if "E10" in effects:
        found["ink.second_weight"] = 1 - effects["E10"]["w1"]
        found["ink.second_asymmetry_parameter"] = effects["E10"]["g2"]
    if "E11" in effects:
        found["plate.absorption_per_mm"] = effects["E11"]["mua"]
    if "E12" in effects:
        # Of all that the ink absorbs; the catalogue knows one share for all exciting wavelengths.
        fractions = np.unique(effects["E12"]["fluor_fraction"])
        if fractions.size == 1:
            found["fluorescence.quantum_yield"] = float(effects["E12"]["QY"] * fractions[0])
    if "E13" in effects:
        found["gain.relative"] = effects["E13"]["gain"] - 1
    if "E14" in effects:
        found["ink.refractive_index"] = effects["E14"]["n"]
    if "E15" in effects:
        found["air_gap.share"] = 1.0
    return found


def diagnose(name: str, folder: Path) -> Path:
    """Run the command on one case, by its declared file alone, and keep its report.

    Returns the folder of the diagnosis, within ``folder``.
    """
    sample, out = folder / "sample.toml", folder / "out"
    sample.write_text(declared_text(name))
    command = [sys.executable, "-m", "jaxink", "diagnose", str(data_file(name))]
    command += ["--sample", str(sample), "--out", str(out), "--quiet", "--no-figures"]
    done = subprocess.run(command, check=False)
    report = read_report(out)
    report["exit_code"] = done.returncode
    report["source"] = f"{name}.csv"
    report["noise"] = report["noise"]["origin"]
    REPORTS.mkdir(exist_ok=True)
    (REPORTS / f"{name}.json").write_text(json.dumps(report, indent=1) + "\n")
    print(f"{name}: {report['verdict']['code']} {report['verdict']['effects']}", file=sys.stderr)
    return out


def row(name: str, report: dict, truth: dict) -> list[str]:
    """One line of the table."""
    names = [EFFECT_OF[key] for key in truth["effects"]]
    found = report["verdict"]["effects"]
    rank = ", ".join(str(found.index(n) + 1) if n in found else "-" for n in names) or "none"
    classes = "; ".join(" / ".join(step["class"]) for step in report["steps"]) or "none"
    values = true_values(truth)
    before, after = [], []
    for parameter in report["parameters"]:
        true = values.get(parameter["name"])
        if true is None:
            continue
        before.append(f"{100 * (parameter['before'] / true - 1):+.0f} %")
        error = parameter["after_standard_error"]
        after.append("bound" if not error else f"{(parameter['after'] - true) / error:+.1f}")
    strengths = []
    errors = {k: v for step in report["steps"] for k, v in step["term_standard_errors"].items()}
    terms = {k: v for step in report["steps"] for k, v in step["terms"].items()}
    for term, true in true_strengths(truth).items():
        if term in terms:
            error = errors.get(term)
            distance = f" ({(terms[term] - true) / error:+.1f} s.e.)" if error else " (bound)"
            strengths.append(f"{term.split('.')[-1]} {terms[term]:.4g}, true {true:.4g}{distance}")
    first, last = report["before"], report["after"]
    return [
        f"`{name}`",
        ", ".join(names) or "none",
        f"{first['reduced_chi_square']:.4g}",
        report["verdict"]["code"],
        classes,
        rank,
        f"{last['reduced_chi_square']:.4g} ({last['probability']:.2g})",
        f"{first['held_out']['reduced_chi_square']:.4g} -> {last['held_out']['reduced_chi_square']:.4g}",
        ", ".join(before),
        ", ".join(after),
        "; ".join(strengths),
    ]


def main() -> None:
    """Diagnose what is asked for or missing, and write the table."""
    asked = sys.argv[1:]
    for name in names():
        if name in asked or (not asked and not (REPORTS / f"{name}.json").exists()):
            with tempfile.TemporaryDirectory() as scratch:
                diagnose(name, Path(scratch))
    rows = []
    for name in sorted(names(), key=lambda n: (not n.startswith("undeclared"), n)):
        file = REPORTS / f"{name}.json"
        if file.exists():
            rows.append(row(name, read_report(file), truth_of(name)))
    header = [
        "simulated measurement",
        "what the declared file does not say",
        "reduced chi-square as declared",
        "verdict",
        "found (class of each)",
        "rank of the true name",
        "reduced chi-square corrected (probability)",
        "held out",
        "bias of the parameters as declared",
        "distance from the truth corrected, s.e.",
        "strength",
    ]
    text = f"""## Undeclared effects

`jaxink diagnose` was run on every **simulated** measurement with only the declared file
(`python -m benchmarks.validation.simulated.diagnosis`, {machine()}; reports in
benchmarks/validation/simulated/reports). Strengths are compared if the simulation and the catalogue
([diagnosis](../manual/diagnosis.md)) define the effect in the same way; for `lateral_loss` these are the
diameters of beam and field. Parameters are in the order of the sample file.

The strength of `rough_ink` is the angle of the density that was chosen. If `undeclared_rough_surface` ends at
GGX facets (reduced chi-square 1.043), this is a rival minimum: the Cauchy facets of the simulation fit better
(1.035 with 2.97 +- 0.06 degrees), but the declared model has two minima, and from the one at the upper bound
of g the other form is preferred.

In `white_ink_rough` nothing is undeclared: the name there is false. The statistical error of the Monte Carlo
itself, which the file does not state, adds 0.16 of the variance of the noise (above), and the effect takes
14.7 of a chi-square of 750 for 644 degrees of freedom; the p of 0.0005 is the smallest that 2000 null data
sets can show. How well scans repeat is taken as usual where a file does not state it:
`undeclared_incidence_angle` is then within the accuracy of the noise.

{table(header, rows)}
"""
    write_section("simulated.md", MARK, text)


if __name__ == "__main__":
    main()
