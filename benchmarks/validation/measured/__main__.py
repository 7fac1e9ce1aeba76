"""Fit the measured samples and write docs/validation/measured.md.

python -m benchmarks.validation.measured
"""

import numpy as np

import jaxink
from benchmarks.pages import data_folder, filled, machine, rms, section_after, table, write_page
from benchmarks.validation.measured.diagnosis import SAMPLES
from benchmarks.validation.measured.diagnosis_page import FOLDER, MARK
from benchmarks.validation.measured.paint_models import VALID_AT_DEG, theory
from jaxink.fitting import FitResult, predict_left_out, prepare_data
from jaxink.measurement import symmetry_repeatability


def fitted(data_file, sample_file: str, objective: str) -> FitResult:
    """Fit one measured file."""
    return jaxink.fit(data_file, SAMPLES / sample_file, jaxink.FitOptions(objective=objective))


def parameter_table(result: FitResult) -> str:
    """Free parameters of a fit."""
    rows = [
        [p.name, f"{p.value:.6g}", "" if p.standard_error is None else f"{p.standard_error:.2g}", p.flag]
        for p in result.parameters.values()
        if p.free
    ]
    return table(["parameter", "value", "standard error", "flag"], rows)


def incidences_table(data: jaxink.GonioData, bare: FitResult, faced: FitResult) -> str:
    """Table of the misfit by incidence without and with an interface, beside what the pairs show."""
    repeatability = {s.scan.theta_i_deg: s for s in symmetry_repeatability(data)}
    rows = []
    for no_face, face in zip(bare.scans, faced.scans, strict=True):
        pairs = repeatability[no_face.theta_i_deg]
        rows.append(
            [
                f"{no_face.theta_i_deg:g}",
                str(no_face.points),
                f"{100 * no_face.relative_rms:.2f}",
                f"{100 * no_face.mean_relative:+.2f}",
                f"{100 * face.relative_rms:.2f}",
                f"{100 * face.mean_relative:+.2f}",
                f"{100 * pairs.relative:.2f}",
                f"{100 * pairs.mean_difference:+.2f}",
                str(pairs.pairs),
            ]
        )
    total = [
        "all",
        str(bare.merit.points),
        f"**{100 * bare.merit.relative_rms:.2f}**",
        "",
        f"**{100 * faced.merit.relative_rms:.2f}**",
        "",
        "",
        "",
        str(sum(s.pairs for s in repeatability.values())),
    ]
    header = [
        "incidence, deg",
        "points",
        "no interface: rms, %",
        "mean, %",
        "n = 1.35: rms, %",
        "mean, %",
        "one reading from +phi/-phi pairs, %",
        "mean +phi minus -phi, %",
        "pairs",
    ]
    return table(header, [*rows, total])


def ptfe_section() -> str:
    """PTFE with and without an interface, by incidence, beside what the pairs show."""
    path = data_folder("measured") / "ptfe_nist_germer" / "brdf_regular.csv"
    bare = fitted(path, "ptfe_nist_germer.toml", "relative")
    weighted = fitted(path, "ptfe_nist_germer.toml", "chi_square")
    faced = fitted(path, "ptfe_nist_germer_n1.35.toml", "relative")
    incidences = incidences_table(prepare_data(jaxink.read(path), bare.sample), bare, faced)
    return filled(
        FOLDER / "ptfe.md.in",
        points=bare.merit.points,
        incidences=incidences,
        bare=parameter_table(bare),
        faced=parameter_table(faced),
        merit=weighted.merit,
        weighted_rms=100 * weighted.merit.relative_rms,
        noise=weighted.noise["origin"],
        weighted=parameter_table(weighted),
    )


PAINTS = {
    "smooth, n = 1.5 fixed": "paint_z307_black.toml",
    "facets, GGX": "paint_z307_black_ggx.toml",
    "facets, GGX and Beckmann": "paint_z307_black_two_lobes.toml",
    "waves, K-correlation": "paint_z307_black_waves.toml",
}


def paint_section() -> str:
    """The black paint under a smooth surface, and with rough ones."""
    path = data_folder("measured") / "paint_z307_black" / "brdf_inplane.csv"
    # The rest cannot be told from the steps of the quadratures: coarser ones serve.
    options = jaxink.FitOptions(objective="relative", accuracy=1e-3)
    results = {name: jaxink.fit(path, SAMPLES / file, options) for name, file in PAINTS.items()}
    rows, left_out_rows = [], []
    angles = sorted({scan.theta_i_deg for scan in next(iter(results.values())).scans})
    for name, result in results.items():
        used = result.data.used
        measured, incidence = result.data.bsdf_per_sr[used], result.data.theta_i_deg[used]
        folds = np.array([incidence == angle for angle in angles])
        alone = predict_left_out(result, folds)
        misfit = np.log(result.predicted_per_sr / measured)
        missed = [np.log(p[fold] / measured[fold]) for p, fold in zip(alone, folds, strict=True)]
        rows.append(
            [
                name,
                str(sum(p.free for p in result.parameters.values())),
                str(result.merit.points),
                f"{100 * result.merit.relative_rms:.1f}",
                f"{100 * result.merit.rmsd_relative:.1f}",
                f"{rms(misfit):.3f}",
                *(f"{rms(misfit[fold]):.3f}" for fold in folds),
            ]
        )
        left_out_rows.append([name, f"{rms(np.concatenate(missed)):.3f}", *(f"{rms(m):.3f}" for m in missed)])
    at = [f"{angle:g} deg" for angle in angles]
    header = ["surface", "free parameters", "points", "relative rms, %", "relative RMSD, %", "rms of ln", *at]
    smooth, waves = results["smooth, n = 1.5 fixed"], results["waves, K-correlation"]
    return filled(
        FOLDER / "paint.md.in",
        surfaces=table(header, rows),
        left_out=table(["surface", "all left-out points", *at], left_out_rows),
        smooth=parameter_table(smooth),
        waves=parameter_table(waves),
        validity=validity_sentence(waves),
        noise=smooth.noise["origin"],
    )


def validity_sentence(result: FitResult) -> str:
    """What the theory of waves says of its own validity at the solution."""
    numbers = theory(result)
    assert numbers is not None
    return (
        f"At {result.scans[0].wavelength_nm:g} nm and {VALID_AT_DEG:g} degrees the phase by the heights is "
        f"{numbers['a_sigma_reflection']:.1f} rad in reflection, the slope of the frequencies that scatter "
        f"{numbers['slope']:.2f} (the theory wants less than 0.3), and the theory by itself would send out "
        f"{100 * abs(numbers['power_error']):.0f} % {'more' if numbers['power_error'] > 0 else 'less'} than "
        "arrives, for which the model scales the light that crosses the surface."
    )


def main() -> None:
    """Write the page."""
    text = f"""# Measured samples

Real measurements by others. The data are not part of the repository; this page is made by
`python -m benchmarks.validation.measured` ({machine()}).

{ptfe_section()}
{paint_section()}"""
    write_page("measured.md", text + section_after("measured.md", MARK))


if __name__ == "__main__":
    main()
