"""Fit the measured samples and write docs/measured.md.

python benchmarks/report_measured.py
"""

import jaxink
from jaxink.fitting import FitResult, prepare_data
from jaxink.measurement import symmetry_repeatability
from report_common import SAMPLES, data_folder, machine, table, write_page


def fitted(data_file, sample_file: str, objective: str) -> FitResult:
    """Fit one measured file."""
    return jaxink.fit(data_file, SAMPLES / sample_file, jaxink.FitOptions(objective=objective))


def parameter_table(result: FitResult) -> str:
    """Free parameters of a fit."""
    rows = [
        [p.name, f"{p.value:.6g}", "" if p.standard_error is None else f"{p.standard_error:.2g}", p.flag]
        for p in result.parameters
        if p.free
    ]
    return table(["parameter", "value", "standard error", "flag"], rows)


def ptfe_section() -> str:
    """PTFE with and without an interface, by incidence, beside what the pairs show."""
    path = data_folder("measured") / "ptfe_nist_germer" / "brdf_regular.csv"
    bare = fitted(path, "ptfe_nist_germer.toml", "relative")
    weighted = fitted(path, "ptfe_nist_germer.toml", "chi_square")
    faced = fitted(path, "ptfe_nist_germer_n1.35.toml", "relative")
    data = prepare_data(jaxink.read(path), bare.sample)
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
    return f"""## Sintered PTFE (`ptfe_nist_germer`), 532 nm, all {bare.merit.points} rows

Germer (NIST), Applied Optics 2017. An opaque Henyey-Greenstein slab with two free parameters, minimised in
relative RMSD. "rms" and "mean" are those of model / measured - 1.

{table(header, [*rows, total])}

Without an interface:

{parameter_table(bare)}

With a smooth interface of index 1.35 (both parameters run to the end of their ranges, and the model still
misses the grazing angles: sintered PTFE has no such interface):

{parameter_table(faced)}

Weighted by the noise that the pairs show instead, the bare model gives the same picture:
chi-square {weighted.merit.chi_square:.0f} for {weighted.merit.degrees_of_freedom} degrees of freedom, relative
rms {100 * weighted.merit.relative_rms:.2f} %. {weighted.noise["origin"]}

{parameter_table(weighted)}

The two parameters explain the scans up to 30 degrees to within the repeatability; from 45 degrees on the
misfit grows beyond it, so something is missing towards grazing incidence. The standard errors are those of
the noise alone; with a chi-square this far above its degrees of freedom they say nothing of the model's error.
"""


def paint_section() -> str:
    """The black paint under a smooth surface."""
    path = data_folder("measured") / "paint_z307_black" / "brdf_inplane.csv"
    result = fitted(path, "paint_z307_black.toml", "relative")
    rows = [
        [
            f"{s.wavelength_nm:g}",
            f"{s.theta_i_deg:g}",
            str(s.points),
            f"{100 * s.relative_rms:.1f}",
            f"{100 * s.mean_relative:+.1f}",
        ]
        for s in result.scans
    ]
    header = ["wavelength, nm", "incidence, deg", "points", "rms of model / measured - 1, %", "mean, %"]
    return f"""## Black paint (`paint_z307_black`), 631 and 852 nm

LOFT group, University of Arizona. An opaque Henyey-Greenstein slab under a smooth surface of index 1.5, both
wavelengths, points within 2.5 degrees of the specular direction masked ({result.merit.points} of
{len(result.data)} left), minimised in relative RMSD: relative rms
**{100 * result.merit.relative_rms:.1f} %** (relative RMSD with the symmetric denominator
{100 * result.merit.rmsd_relative:.1f} %).

{table(header, rows)}

{parameter_table(result)}

This is poor, as it must be: the paint's surface is rough and its lobe around the specular direction is most
of what there is to see. The asymmetry parameter runs to the end of its range to imitate that lobe; its value
means nothing. {result.noise["origin"]}
"""


def main() -> None:
    """Write the page."""
    text = f"""# Measured samples

Real measurements by others. The data are not part of the repository; this page is made by
`python benchmarks/report_measured.py` ({machine()}).

{ptfe_section()}
{paint_section()}"""
    write_page("measured.md", text)


if __name__ == "__main__":
    main()
