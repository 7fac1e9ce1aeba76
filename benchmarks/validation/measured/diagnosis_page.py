"""Section of measured.md on what the models of the measured samples lack, from the kept reports."""

import json
import re
from pathlib import Path

from benchmarks.pages import REPOSITORY, filled, machine, table, write_section
from jaxink.diagnosis import read_report

MARK = "diagnosis of the measured samples, by benchmarks.validation.measured.diagnosis"
FOLDER = Path(__file__).parent
REPORTS, DOCS = FOLDER / "reports", REPOSITORY / "docs" / "validation"
# A reading is met to within its noise where the misfit is at most this many times what mirror pairs show.
TARGET = 1.25
# Rms of ln(model / measured) of the paint, fitted and left out.
LN_TARGET, LN_TARGET_LEFT_OUT = 0.06, 0.10
# What phase_function.py found.
PHASE_STUDY = FOLDER / "phase_function.json"
SPECTRALON_NM = 537.85


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
        rows.append(
            [step["effect"], " / ".join(step["class"]), f"{step['actual_delta_chi_square']:.5g}", gain, terms]
        )
    header = [
        "added",
        "class",
        "Δχ²",
        "gain in log density of a held-out scan",
        "its terms when it was added",
    ]
    return table(header, rows) if rows else "Nothing was added."


def parameters_table(report: dict) -> str:
    """Free parameters of the declared and of the corrected model."""
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
    heads = ["parameter", "as declared", "corrected", "standard error", "misfit may shift by", "determined"]
    return table(heads, rows)


def candidates_table(report: dict, key: str, most: int = 6) -> str:
    """Leading candidates of a screen."""
    rows = [
        [
            c["effect"],
            f"{c['predicted_delta_chi_square']:.4g}",
            "-" if c["refit_delta_chi_square"] is None else f"{c['refit_delta_chi_square']:.5g}",
        ]
        for c in report[key][:most]
    ]
    return table(["effect", "Δχ² predicted by the screen", "Δχ² of a refit"], rows)


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
            line += [percent(pair), "-" if pair is None else f"{row[f'{key}_after'] / pair:.2f}"]
        rows.append(line)
    header = [
        "incidence, deg",
        "points",
        "as declared, %",
        "corrected, %",
        "left out, as declared, %",
        "left out, corrected, %",
    ]
    if noise is not None:
        header += ["one reading by +phi/-phi pairs, %", "corrected over pairs"]
    return table(header, rows)


def figures(name: str, report: dict) -> str:
    """Residual maps."""
    files = sorted(DOCS.glob(f"measured-{name}-residual*.png"))
    source = report["source"]
    models = [
        "declared" if re.search("residual(s|_discs)_(?!after)", file.stem) else "corrected" for file in files
    ]
    return "\n\n".join(
        f"![residuals of {source}, {model} model]({file.name})"
        for file, model in zip(files, models, strict=True)
    )


def common_parts(name: str, report: dict) -> dict[str, str]:
    """What every section has."""
    verdict = report["verdict"]
    return {
        "head": f"Verdict `{verdict['code']}`: {verdict['sentence']}\n\nNoise: {report['noise']}",
        "steps": steps_table(report),
        "parameters": parameters_table(report),
        "residual": report["residual"]["sentence"],
        "figures": figures(name, report),
    }


def interface_words(report: dict) -> str:
    """What is known of the interface and of the last effect."""
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
            f" The last effect lowers chi-square by {last['actual_delta_chi_square']:.4g} and is one of "
            f"{len(last['class'])} that the data do not tell apart."
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
    return filled(
        FOLDER / "phase_function.md.in",
        angles=len(study["angle_deg"]),
        table=table(["phase function", "free", "chi-square", *angles], rows),
        shape=shape,
        missed=missed,
        relief_variance=uneven["relief_variance"],
    )


def other_wavelengths_tables(report: dict) -> tuple[str, str]:
    """Misfit and parameters of the same model at other wavelengths."""
    others = report["other_wavelengths"]
    misfits = [
        [
            f"{other['wavelength_nm']:g}",
            f"{other['chi_square']:.5g} / {other['points']}",
            percent(other["relative_rms"]),
            *(
                percent(value) + ("" if pair is None else f" ({value / pair:.2f})")
                for _, value, pair in other["by_incidence"]
            ),
        ]
        for other in others
    ]
    values = [
        [
            f"{other['wavelength_nm']:g}",
            *(f"{v:.5g}" + (f" ± {e:.1g}" if e else " (bound)") for v, e in other["parameters"].values()),
        ]
        for other in others
    ]
    angles = [f"{a:g} deg" for a, *_ in others[0]["by_incidence"]]
    return (
        table(["wavelength, nm", "chi-square / points", "all", *angles], misfits),
        table(["wavelength, nm", *others[0]["parameters"]], values),
    )


def ptfe_section(report: dict) -> str:
    """Section of the PTFE."""
    noise = dict(map(tuple, report["pair_noise"]))
    ratios = {
        row["theta_i_deg"]: row["relative_rms_after"] / noise[row["theta_i_deg"]]
        for row in report["by_incidence"]
        if row["theta_i_deg"] in noise
    }
    misfits, values = other_wavelengths_tables(report)
    panel = report["spectralon"]
    points = [[f"{i:g}", f"{o:g}", f"{100 * (r - 1):+.2f}"] for i, o, r in panel["points"]]
    return filled(
        FOLDER / "diagnosis_ptfe.md.in",
        **common_parts("ptfe", report),
        incidences=incidence_table(report, "relative_rms", noise),
        target=TARGET,
        met=", ".join(f"{a:g}" for a, r in ratios.items() if r <= TARGET) or "none",
        missed=", ".join(f"{a:g} ({r:.2f})" for a, r in ratios.items() if r > TARGET) or "none",
        interface=interface_words(report),
        remaining=candidates_table(report, "remaining_candidates"),
        phase_function=phase_words(),
        other_misfits=misfits,
        other_parameters=values,
        spectralon_nm=SPECTRALON_NM,
        panel_rms=percent(panel["relative_rms"]),
        panel_level=100 * (panel["level"] - 1),
        panel_shape=percent(panel["relative_rms_with_free_level"]),
        panel_points=table(["incidence, deg", "view, deg", "model / measured - 1, %"], points),
    )


def paint_section(report: dict) -> str:
    """Section of the paint."""
    total = report["by_incidence"][-1]
    n_free = len(report["parameters"]) + sum(len(step["terms"]) for step in report["steps"])
    return filled(
        FOLDER / "diagnosis_paint.md.in",
        **common_parts("paint", report),
        incidences=incidence_table(report, "ln_rms"),
        all=100 * total["ln_rms_after"],
        target=100 * LN_TARGET,
        left_out=100 * total["ln_rms_held_out_after"],
        left_out_target=100 * LN_TARGET_LEFT_OUT,
        n_free=n_free,
        candidates=candidates_table(report, "candidates"),
        remaining=candidates_table(report, "remaining_candidates"),
    )


def diffuser_section(report: dict) -> str:
    """Section of the diffuser."""
    return filled(
        FOLDER / "diagnosis_diffuser.md.in",
        **common_parts("diffuser", report),
        incidences=incidence_table(report, "relative_rms"),
    )


SECTIONS = {"ptfe": ptfe_section, "paint": paint_section, "diffuser": diffuser_section}


def write() -> None:
    """The section, from all that is there."""
    there = [name for name in SECTIONS if (REPORTS / f"{name}.json").exists()]
    sections = "\n".join(SECTIONS[name](read_report(REPORTS / f"{name}.json")) for name in there)
    text = f"""## What the models lack

`jaxink diagnose` on the measured samples, each declared as a textbook would
(`python -m benchmarks.validation.measured.diagnosis {" ".join(there)}`, {machine()}; reports in
benchmarks/validation/measured/reports).

{sections}"""
    write_section("measured.md", MARK, text)
