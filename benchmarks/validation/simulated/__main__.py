"""Fit the simulated measurements that carry no undeclared effect and write docs/validation/simulated.md.

python -m benchmarks.validation.simulated
"""

import re

import numpy as np

from benchmarks.pages import machine, rms, section_after, table, write_page
from benchmarks.simulated_data import truth_of
from benchmarks.validation.simulated.diagnosis import MARK
from benchmarks.validation.simulated.fits import FREE_SIGMA, fit_declared, fit_text, text_of
from jaxink.fitting import FitResult

NAMES = (
    "plain_hg",
    "plain_hg_noisy",
    "index_step_hg",
    "lit_from_ink_hg",
    "free_film_mie",
    "white_ink_mie",
    "coloured_ink",
    "white_ink_rough",
)
DENSITIES = ("cauchy", "cauchy_angle", "cauchy2d", "beckmann", "ggx")


def true_value(key: str, wavelength_nm: float | None, truth: dict) -> float:
    """True value of a fitted or derived quantity."""
    optics = {o["wavelength_nm"]: o for o in truth["optics"]}
    here = optics[wavelength_nm] if wavelength_nm is not None else truth["optics"][0]
    phase = truth["ink"]["phase"]
    absorption = phase.get("n_im")
    if isinstance(absorption, list) and key == "particle_absorption_index":
        absorption = absorption[sorted(optics).index(wavelength_nm)]
    reduced = here["mus"] * (1 - here["g"])
    return {
        "scattering_per_mm": here["mus"],
        "absorption_per_mm": here["mua"],
        "asymmetry_parameter": here["g"],
        "reduced_scattering_per_mm": reduced,
        "reduced_optical_thickness": reduced * truth["ink"]["d_mm"],
        "radius_nm": phase.get("radius_nm"),
        "volume_fraction": phase.get("pvc"),
        "particle_index": phase.get("n_re"),
        "particle_absorption_index": absorption,
        "sigma_deg": truth.get("roughness", {}).get("ink_air", (None, None))[1],
    }[key]


def comparison(result: FitResult, truth: dict) -> list[list[str]]:
    """Rows of fitted against true values, with their distance in standard errors."""
    rows = []
    fitted = [(p.name.split(".")[-1], p.value, p.standard_error, p.interval) for p in result.parameters.free]
    found = [
        (key.split("@")[0], float(key.split("@")[1]) if "@" in key else None, *rest) for key, *rest in fitted
    ]
    found += [
        (d.quantity, d.wavelength_nm, d.value, d.standard_error, None)
        for d in result.derived
        if d.quantity not in [f[0] for f in found]
    ]
    one_wavelength = len({w for _, w, *_ in found if w is not None}) < 2
    for key, wavelength, value, error, interval in found:
        true = true_value(key, wavelength, truth)
        key = key if wavelength is None or one_wavelength else f"{key} at {wavelength:g} nm"
        distance = "" if not error else f"{(value - true) / error:+.2f}"
        span = "" if interval is None else f"{interval[0]:.5g} ... {interval[1]:.5g}"
        rows.append(
            [key, f"{value:.6g}", "" if error is None else f"{error:.2g}", f"{true:.6g}", distance, span]
        )
    return rows


def section(name: str) -> tuple[str, list[str]]:
    """Text on one measurement, and its row of the overview."""
    result, truth = fit_declared(name), truth_of(name)
    m = result.merit
    rows = comparison(result, truth)
    worst = max((abs(float(row[4])) for row in rows if row[4]), default=float("nan"))
    scan = sum(s.jacobians for s in result.searches if s.method == "scan")
    jacobians = sum(s.jacobians for s in result.searches) - scan
    overview = [
        f"`{name}`",
        f"{m.chi_square:.1f} / {m.degrees_of_freedom}",
        f"{m.probability:.2g}",
        f"{worst:.2f}",
        *against_the_noise_free(result, truth),
        str(scan or ""),
        str(jacobians),
        f"{result.run_seconds:.2f}",
    ]
    header = ["quantity", "fitted", "standard error", "truth", "distance, s.e.", "profile interval"]
    notes = "".join(f"\n- {note}" for note in result.notes)
    text = f"""## `{name}`

Chi-square {m.chi_square:.2f} for {m.degrees_of_freedom} degrees of freedom, probability {m.probability:.3f};
{result.outcome.value}.

{table(header, rows)}
{notes}
"""
    return text, overview


def against_the_noise_free(result: FitResult, truth: dict) -> list[str]:
    """Chi-square of the drawn noise alone, and the fit's deviation from the values before noise was drawn."""
    used = result.data.used
    values, error = (np.array(truth[key])[used] for key in ("noise_free", "monte_carlo_se"))
    drawn = (result.data.bsdf_per_sr[used] - values) / result.sigma_per_sr
    deviation = (result.predicted_per_sr - values) / error
    return [
        f"{np.sum(drawn**2):.0f} / {len(drawn)}",
        f"{np.mean((error / result.sigma_per_sr) ** 2):.2f}",
        f"{rms(deviation):.2f}",
    ]


def rivals() -> str:
    """The rough white ink without roughness and with each density, and roughness instead of scattering."""
    text = text_of("white_ink_rough")
    rows = []
    for density in ("none", *DENSITIES):
        if density == "none":
            here = re.sub(r"back_roughness = .*\n", "", text)
        else:
            here = re.sub(r'density = "\w+"', f'density = "{density}"', text)
        result = fit_text("white_ink_rough", here)
        m = result.merit
        sigma = next((p for p in result.parameters.values() if p.name.endswith("sigma_deg")), None)
        reduced = next(d for d in result.derived if d.quantity == "reduced_optical_thickness")
        rows.append(
            [
                f"`{density}`",
                f"{m.chi_square:.0f} / {m.degrees_of_freedom}",
                f"{m.probability:.2g}",
                "" if sigma is None else f"{sigma.value:.3g}",
                f"{reduced.value:.4f}",
                f"{100 * m.relative_rms:.2f}",
            ]
        )
    header = [
        "slope density",
        "chi-square / degrees of freedom",
        "probability",
        "sigma, deg",
        "mu_s (1 - g) d (truth 0.5939)",
        "relative rms, %",
    ]
    return f"""## `white_ink_rough` with other surfaces

The simulated surface is `cauchy` with 3.2 degrees. The same data are fitted without roughness and with each
density, with a free angle:

{table(header, rows)}
"""


def roughness_only() -> str:
    """A rough face on an ink that does not scatter, fitted to a smooth ink that does."""
    text = text_of("white_ink_mie")
    for key in ("radius_nm", "volume_fraction", "particle_index", "particle_absorption_index"):
        text = re.sub(rf"{key} = .*\n", "", text)
    text = text.replace(
        'phase_function = "mie"',
        'phase_function = "henyey_greenstein"\nscattering_per_mm = 0\nasymmetry_parameter = 0\n'
        "absorption_per_mm = { free = true, min = 0, max = 50 }\n"
        f'back_roughness = {{ density = "ggx", {FREE_SIGMA.replace("max = 25", "max = 45")} }}',
    )
    m = fit_text("white_ink_mie", text).merit
    return f"""## Roughness alone on `white_ink_mie`

An ink that absorbs but does not scatter, with a rough face (`ggx`, up to 45 degrees), is fitted to the
scattering ink with a smooth face: relative rms {100 * m.relative_rms:.0f} %, chi-square {m.chi_square:.3g}
for {m.degrees_of_freedom} degrees of freedom. The fit fails, as it should, because facets alone do not
produce the light between the lobes.
"""


def main() -> None:
    """Write the page."""
    sections, overview = zip(*(section(name) for name in NAMES), strict=True)
    header = [
        "measurement",
        "chi-square / degrees of freedom",
        "probability",
        "largest distance from the truth, s.e.",
        "chi-square of the drawn noise / points",
        "Monte Carlo variance over noise variance",
        "fit minus noise-free values, rms in Monte Carlo s.e.",
        "Jacobians of the scan",
        "of all else",
        "seconds to run",
    ]
    text = f"""# Simulated samples without undeclared effects

The measurements are **simulated** by an independent Monte Carlo program. Each fit uses only the declared
file (ranges, thickness, indices, and the noise with its scan factor as a covariance) and starts in the
middle of the ranges. The angle of the rough face of `white_ink_rough` is also free. This page is made by
`python -m benchmarks.validation.simulated` ({machine()}).

{table(header, list(overview))}

Jacobians and seconds include the scan along a radius, the searches and the profile likelihoods, but not
compilation.

Three columns use the values before noise was added, which no fit may use. Noise was drawn as declared, but
those values have a statistical error of the Monte Carlo itself, which the declared noise covers only as far
as it is common to a scan (scan_relative 0.002). If this error is large compared with the noise and varies
within scans, chi-square exceeds its degrees of freedom although the fit is as close to the noise-free
values as these are to the truth, as for `coloured_ink`.

{"".join(sections)}{rivals()}
{roughness_only()}"""
    write_page("simulated.md", text.rstrip() + section_after("simulated.md", MARK))


if __name__ == "__main__":
    main()
