"""Diagnose the measured samples, and write their section of docs/measured.md.

python -m benchmarks.validation.measured.diagnosis [ptfe|paint|diffuser ...]

Each case that is named is diagnosed anew; its figures of merit are kept in benchmarks/validation/measured/reports/NAME.json,
its residual maps in docs. The section is written from all that is there. No measured value is kept.
"""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.pages import REPOSITORY, data_folder, machine, table, write_section
from jaxink.diagnosis import transfer
from jaxink.measurement import symmetry_repeatability
from jaxink.plots.diagnosis import diagnosis_figures

MARK = "diagnosis of the measured samples, by benchmarks.validation.measured.diagnosis"
FOLDER = Path(__file__).parent
SAMPLES, REPORTS = FOLDER / "samples", FOLDER / "reports"
DOCS = REPOSITORY / "docs"
# A reading is met to within its noise where the misfit is at most this many times what mirror pairs show.
TARGET = 1.25
# Rms of ln(model / measured) of the paint, fitted and left out.
LN_TARGET, LN_TARGET_LEFT_OUT = 0.06, 0.10
# What phase_function.py found.
PHASE_STUDY = FOLDER / "phase_function.json"
OTHER_WAVELENGTHS_NM = (351.0, 633.0, 1064.0)
SPECTRALON_NM = 537.85


def rms(values) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def measured(folder: str, file: str, **stated):
    """One measured file."""
    return jaxink.read(data_folder("measured") / folder / file, **stated)


# At most so many free parameters.
MOST = jaxink.DiagnosisOptions(max_parameters=8)
# A discretisation to 0.1 %: rough faces under a free index are slow.
COARSE = dataclasses.replace(MOST, fit=jaxink.FitOptions(profile="none", accuracy=1e-3))


def declared(name: str) -> tuple:
    """Measurement, sample file and options of a case."""
    if name == "ptfe":
        return measured("ptfe_nist_germer", "brdf_regular.csv"), "ptfe_nist_germer_n1.35.toml", MOST
    return measured("paint_z307_black", "brdf_inplane.csv"), "paint_z307_black.toml", COARSE


def diagnosed(name: str, data, sample_file: str, options=MOST) -> tuple[jaxink.Diagnosis, dict]:
    """Diagnosis of a measurement; its residual maps go to docs."""

    def progress(what, step, misfit):
        if not what.startswith("start"):
            print(f"{name}: {what} {step}, {misfit:.6g}", flush=True)

    found = jaxink.diagnose(data, SAMPLES / sample_file, options, progress)
    for figure in diagnosis_figures(found):
        if figure.name.startswith("residual"):
            figure.figure.savefig(DOCS / f"measured-{name}-{figure.name}.png", dpi=100)
    report = found.to_dict()
    report["source"] = f"{data_file(report['source'])}"
    report["noise"] = report["noise"]["origin"]
    by_incidence = []
    used = found.result.data.used
    incidence, bsdf = found.result.data.theta_i_deg[used], found.result.data.bsdf_per_sr[used]
    states = {
        "before": found.before.predicted_per_sr,
        "after": found.after.predicted_per_sr,
        "held_out_before": found.before.held_out_per_sr,
        "held_out_after": found.after.held_out_per_sr,
    }
    for angle in [*np.unique(incidence), None]:
        here = np.full(incidence.size, True) if angle is None else incidence == angle
        row = {"theta_i_deg": angle, "points": int(here.sum())}
        for state, predicted in states.items():
            row[f"relative_rms_{state}"] = rms(predicted[here] / bsdf[here] - 1)
            row[f"ln_rms_{state}"] = rms(np.log(predicted[here] / bsdf[here]))
        by_incidence.append(row)
    report["by_incidence"] = by_incidence
    return found, report


def data_file(source: str) -> str:
    """Folder and name of a file, without where it lies."""
    return "/".join(source.split("/")[-2:])


def save(name: str, report: dict) -> None:
    """Keep a report."""
    (REPORTS / f"{name}.json").write_text(json.dumps(report, indent=1) + "\n")
    print(f"{name}: {report['verdict']['code']} {report['verdict']['effects']}", flush=True)


def ptfe() -> None:
    """Sintered PTFE, declared as a textbook would; then other wavelengths, and Spectralon."""
    data, *_ = case = declared("ptfe")
    found, report = diagnosed("ptfe", *case)
    pairs = {s.scan.theta_i_deg: s.relative for s in symmetry_repeatability(found.result.data)}
    report["pair_noise"] = [[angle, noise] for angle, noise in pairs.items()]
    report["other_wavelengths"] = []
    for nm in OTHER_WAVELENGTHS_NM:
        there = transfer(found, data.select(wavelength_nm=(nm,)), is_refitted=True)
        bsdf, incidence = there.data.bsdf_per_sr, there.data.theta_i_deg
        pairs = {s.scan.theta_i_deg: s.relative for s in symmetry_repeatability(there.data)}
        ratio = there.predicted_per_sr / bsdf - 1
        report["other_wavelengths"].append(
            {
                "wavelength_nm": nm,
                "chi_square": float(np.sum(there.whitened**2)),
                "points": len(bsdf),
                "relative_rms": rms(ratio),
                "by_incidence": [
                    [float(a), rms(ratio[incidence == a]), pairs.get(float(a))] for a in np.unique(incidence)
                ],
                "parameters": {n: [there.values[n], e] for n, e in there.standard_errors.items()},
            }
        )
    report["spectralon"] = spectralon(found)
    save("ptfe", report)


def spectralon(found) -> dict:
    """A Spectralon panel by the model of the PTFE plaque, nothing being fitted; and with its level free."""
    data = measured("spectralon_rsg_blacklab", "brdf_nadir_view.csv").select(wavelength_nm=(SPECTRALON_NM,))
    there = transfer(found, data, is_refitted=False)
    ratio = there.predicted_per_sr / there.data.bsdf_per_sr[there.data.used]
    used = there.data.used
    columns = (there.data.theta_i_deg[used], there.data.theta_o_deg[used], ratio)
    return {
        "relative_rms": rms(ratio - 1),
        "relative_rms_with_free_level": rms(ratio / np.mean(ratio) - 1),
        "level": float(np.mean(ratio)),
        "points": [[float(x) for x in row] for row in zip(*columns, strict=True)],
    }


def paint() -> None:
    """Black paint under a smooth surface."""
    _, report = diagnosed("paint", *declared("paint"))
    save("paint", report)


def diffuser() -> None:
    """A surface without any volume, declared as a film that scatters; its wavelength is not stated."""
    data = measured("diffuser_eds10_btdf", "btdf.csv", wavelength_nm=550.0)
    # Rows in the plane of incidence, where an instrument effect can be told as well.
    data = data.with_masks(user=~np.isin(data.phi_deg, [0.0, 180.0]))
    # One effect: the question is whether any volume is claimed, not what else imitates a surface.
    options = dataclasses.replace(COARSE, max_effects=1)
    _, report = diagnosed("diffuser", data, "diffuser_eds10_btdf.toml", options)
    save("diffuser", report)


def percent(value: float | None) -> str:
    """A share."""
    return "-" if value is None else f"{100 * value:.2f}"


def steps_table(report: dict) -> str:
    """What was added."""
    rows = []
    for step in report["steps"]:
        terms = ", ".join(
            f"{name} {value:.4g}" + (f" ± {error:.1g}" if error else " (at its bound)")
            for (name, value), error in zip(
                step["terms"].items(), step["term_standard_errors"].values(), strict=True
            )
        )
        gain = f"{step['held_out_gain']:.3g} ± {step['held_out_gain_standard_error']:.2g}"
        rows.append([step["effect"], " / ".join(step["class"]), f"{step['actual_drop']:.5g}", gain, terms])
    header = [
        "added",
        "class",
        "fall of chi-square",
        "held-out gain in ln density, a point",
        "its terms when it was added",
    ]
    return table(header, rows) if rows else "Nothing was added."


def parameters_table(report: dict) -> str:
    """Free parameters of the declared model, before and after."""
    rows = [
        [
            p["name"],
            f"{p['before']:.6g}",
            f"{p['after']:.6g}",
            "-" if not p["after_standard_error"] else f"{p['after_standard_error']:.2g}",
            "-" if p["misfit_error"] is None else f"{p['misfit_error']:.2g}",
            "yes" if p["is_determined"] else "no",
        ]
        for p in report["parameters"]
    ]
    heads = ["parameter", "as declared", "after", "standard error", "misfit may shift by", "determined"]
    return table(heads, rows)


def candidates_table(report: dict, key: str, most: int = 6) -> str:
    """Leading candidates of a screen."""
    rows = [
        [
            c["effect"],
            f"{c['predicted_drop']:.4g}",
            "-" if c["refit_drop"] is None else f"{c['refit_drop']:.5g}",
        ]
        for c in report[key][:most]
    ]
    return table(["effect", "fall of chi-square, by the screen", "by a refit"], rows)


def incidence_table(report: dict, key: str, noise: dict | None = None) -> str:
    """Misfit by incidence, fitted and left out."""
    rows = []
    for row in report["by_incidence"]:
        angle = row["theta_i_deg"]
        line = ["all" if angle is None else f"{angle:g}", str(row["points"])]
        line += [
            percent(row[f"{key}_{state}"])
            for state in ("before", "after", "held_out_before", "held_out_after")
        ]
        if noise is not None:
            pair = noise.get(angle)
            line += [
                percent(pair),
                "-" if pair is None else f"{row[f'{key}_after'] / pair:.2f}",
            ]
        rows.append(line)
    header = [
        "incidence, deg",
        "points",
        "as declared, %",
        "after, %",
        "left out, as declared, %",
        "left out, after, %",
    ]
    if noise is not None:
        header += ["one reading by +phi/-phi pairs, %", "after over pairs"]
    return table(header, rows)


def figures(name: str, report: dict) -> str:
    """Residual maps."""
    files = sorted(DOCS.glob(f"measured-{name}-residual*.png"))
    return "\n\n".join(f"![residuals of {report['source']} before and after]({file.name})" for file in files)


def head(report: dict) -> str:
    """Verdict and noise."""
    return f"""Verdict `{report["verdict"]["code"]}`: {report["verdict"]["sentence"]}

Noise: {report["noise"]}"""


def interface_words(report: dict) -> str:
    """What the found interface and the last effect mean."""
    share = next(
        (s["terms"]["weak_interface.share"] for s in report["steps"] if s["effect"] == "weak_interface"), None
    )
    if share is None:
        return ""
    index = 1.35 - share * 0.35
    words = f"The face acts as one of index {index:.3f}: sintered PTFE has hardly any interface."
    last = report["steps"][-1]
    if len(last["class"]) > 1:
        words += (
            f" The last effect lowers chi-square by {last['actual_drop']:.3g} only and is one of {len(last['class'])} "
            "that the data do not tell apart; it explains nothing."
        )
    return words


def phase_words() -> str:
    """What a phase function of any shape leaves, where that was asked."""
    if not PHASE_STUDY.exists():
        return ""
    study = json.loads(PHASE_STUDY.read_text())
    rows = [
        [
            row["model"],
            str(row["parameters"]),
            f"{row['chi_square']:.1f}",
            *(f"{percent(value)} ({value / pair:.2f})" for _, value, pair in row["by_incidence"]),
        ]
        for row in study["rows"]
    ]
    any_shape, uneven = study["rows"][1:]
    angles = [f"{a:g} deg" for a, *_ in any_shape["by_incidence"]]
    shape = ", ".join(
        f"{value:.2f} at {angle:g}"
        for angle, value in zip(study["angle_deg"], any_shape["phase_value"], strict=True)
    )
    missed = ", ".join(f"{a:g}" for a, value, pair in any_shape["by_incidence"] if value / pair > TARGET)
    return f"""Tried besides (`python -m benchmarks.validation.measured.phase_function`): is it the shape of the phase function? A spline through
free positive values at {len(study["angle_deg"])} angles, with albedo and index of the face free, is no model of at most 8 parameters, but
an answer; so is an uneven matt surface by Oren and Nayar (1994) on top. Relative rms in percent by incidence, in
brackets over the pairs' noise:

{table(["phase function", "free", "chi-square", *angles], rows)}

Its values would be {shape} degrees
(reflection hardly looks at the first). Still {missed} degrees are missed, so the shape is not what is lacking there; nor is an
uneven surface, whose variance of slopes comes out as {uneven["relief_variance"]:.1g}. The solver is scalar; what a vector solver would
change at grazing is not known here.
"""


def ptfe_section(report: dict) -> str:
    """Section of the PTFE."""
    noise = dict(map(tuple, report["pair_noise"]))
    ratios = {
        row["theta_i_deg"]: row["relative_rms_after"] / noise[row["theta_i_deg"]]
        for row in report["by_incidence"]
        if row["theta_i_deg"] in noise
    }
    met = [f"{a:g}" for a, r in ratios.items() if r <= TARGET]
    missed = [f"{a:g} ({r:.2f})" for a, r in ratios.items() if r > TARGET]
    others, terms = [], []
    for other in report["other_wavelengths"]:
        others += [
            [
                f"{other['wavelength_nm']:g}",
                f"{other['chi_square']:.5g} / {other['points']}",
                percent(other["relative_rms"]),
                *(
                    f"{percent(value)}" + ("" if pair is None else f" ({value / pair:.2f})")
                    for _, value, pair in other["by_incidence"]
                ),
            ]
        ]
        terms.append(
            [f"{other['wavelength_nm']:g}"]
            + [f"{v:.5g}" + (f" ± {e:.1g}" if e else " (bound)") for v, e in other["parameters"].values()]
        )
    angles = [f"{a:g} deg" for a, _, _ in report["other_wavelengths"][0]["by_incidence"]]
    panel = report["spectralon"]
    points = [[f"{i:g}", f"{o:g}", f"{100 * (r - 1):+.2f}"] for i, o, r in panel["points"]]
    return f"""### Sintered PTFE, declared as an opaque body under a smooth face of index 1.35

{head(report)}

Relative rms of model / measured - 1 in percent; "left out" is each incidence predicted by fits without it:

{incidence_table(report, "relative_rms", noise)}

Within {TARGET:g} times the pairs' noise: incidence {", ".join(met) or "none"} degrees; not: {", ".join(missed) or "none"}.

{steps_table(report)}

{parameters_table(report)}

{interface_words(report)} What remains stands at grazing views of the larger incidences.

What the last screen would add next:

{candidates_table(report, "remaining_candidates")}

Where it remains: {report["residual"]["sentence"]}

{figures("ptfe", report)}

{phase_words()}
The same model, all its parameters fitted anew, at other wavelengths; relative rms in percent by incidence, in brackets
over the pairs' noise:

{table(["wavelength, nm", "chi-square / points", "all", *angles], others)}

{table(["wavelength, nm", *(n.split(".")[-1] for n in report["other_wavelengths"][0]["parameters"])], terms)}

`spectralon_rsg_blacklab` at {SPECTRALON_NM:g} nm, predicted by the model of the PTFE at 532 nm, nothing being fitted: relative rms
{percent(panel["relative_rms"])} %, of which the level is {100 * (panel["level"] - 1):+.2f} %; {percent(panel["relative_rms_with_free_level"])} %
beside it.

{table(["incidence, deg", "view, deg", "model / measured - 1, %"], points)}
"""


def paint_section(report: dict) -> str:
    """Section of the paint."""
    total = report["by_incidence"][-1]
    n_free = len(report["parameters"]) + sum(len(step["terms"]) for step in report["steps"])
    return f"""### Black paint, declared as an opaque body under a smooth face of index 1.5

{head(report)}

Hundred times the rms of ln(model / measured); "left out" is each scan predicted by fits without it:

{incidence_table(report, "ln_rms")}

Over all {100 * total["ln_rms_after"]:.2f} (aim: below {100 * LN_TARGET:g}), left out {100 * total["ln_rms_held_out_after"]:.2f} (aim: below
{100 * LN_TARGET_LEFT_OUT:g}), with {n_free} free parameters, those of the surface the same for both wavelengths.

{steps_table(report)}

The first screen:

{candidates_table(report, "candidates")}

{parameters_table(report)}

What the last screen would add next:

{candidates_table(report, "remaining_candidates")}

Where it remains: {report["residual"]["sentence"]}

{figures("paint", report)}
"""


def diffuser_section(report: dict) -> str:
    """Section of the diffuser."""
    return f"""### Engineered diffuser, declared as a film that scatters in its volume (negative control)

{head(report)}

Rows in the plane of incidence. Relative rms in percent:

{incidence_table(report, "relative_rms")}

{steps_table(report)}

{parameters_table(report)}

{figures("diffuser", report)}
"""


CASES = {"ptfe": ptfe, "paint": paint, "diffuser": diffuser}
SECTIONS = {"ptfe": ptfe_section, "paint": paint_section, "diffuser": diffuser_section}


def main() -> None:
    """Diagnose what is named, and write the section."""
    for name in sys.argv[1:]:
        CASES[name]()
    write()


def write() -> None:
    """The section, from all that is there."""
    there = [name for name in SECTIONS if (REPORTS / f"{name}.json").exists()]
    parts = [SECTIONS[name](json.loads((REPORTS / f"{name}.json").read_text())) for name in there]
    text = f"""## What the models lack

`jaxink diagnose` on the measured samples, each declared as a textbook would
(`python -m benchmarks.validation.measured.diagnosis {" ".join(there)}`, {machine()}; reports in benchmarks/validation/measured/reports).

{"".join(parts)}"""
    write_section("measured.md", MARK, text)


if __name__ == "__main__":
    main()
