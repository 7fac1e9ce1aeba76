"""Diagnose the measured samples, and write their section of docs/validation/measured.md.

python -m benchmarks.validation.measured.diagnosis [ptfe|paint|diffuser ...]

Each case that is named is diagnosed anew; its figures of merit are kept in reports/NAME.json, its residual
maps in docs. The section is written from all that is there. No measured value is kept.
"""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.pages import data_folder, rms
from benchmarks.validation.measured.diagnosis_page import DOCS, REPORTS, SPECTRALON_NM, write
from jaxink.diagnosis import transfer
from jaxink.measurement import symmetry_repeatability
from jaxink.plots.diagnosis_pages import diagnosis_figures

SAMPLES = Path(__file__).parent / "samples"
OTHER_WAVELENGTHS_NM = (351.0, 633.0, 1064.0)


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
    used = found.declared.data.used
    incidence, bsdf = found.declared.data.theta_i_deg[used], found.declared.data.bsdf_per_sr[used]
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
            # A prediction of 0 has no logarithm.
            is_positive = predicted[here].min() > 0
            row[f"ln_rms_{state}"] = rms(np.log(predicted[here] / bsdf[here])) if is_positive else None
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
    pairs = {s.scan.theta_i_deg: s.relative for s in symmetry_repeatability(found.declared.data)}
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


CASES = {"ptfe": ptfe, "paint": paint, "diffuser": diffuser}


def main() -> None:
    """Diagnose what is named, and write the section."""
    for name in sys.argv[1:]:
        CASES[name]()
    write()


if __name__ == "__main__":
    main()
