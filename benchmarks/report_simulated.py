"""Fit the simulated measurements that carry no undeclared effect and write docs/simulated.md.

python benchmarks/report_simulated.py
"""

import json

import jaxink
from declared import sample_toml
from jaxink.fitting import FitResult
from report_common import data_folder, machine, table, write_page

NAMES = (
    "plain_hg",
    "plain_hg_noisy",
    "index_step_hg",
    "lit_from_ink_hg",
    "free_film_mie",
    "white_ink_mie",
)
_TRUE_KEY = {
    "scattering_per_mm": lambda truth: truth["optics"][0]["mus"],
    "absorption_per_mm": lambda truth: truth["optics"][0]["mua"],
    "asymmetry_parameter": lambda truth: truth["optics"][0]["g"],
    "reduced_scattering_per_mm": lambda truth: truth["optics"][0]["mus"] * (1 - truth["optics"][0]["g"]),
    "radius_nm": lambda truth: truth["ink"]["phase"]["radius_nm"],
    "volume_fraction": lambda truth: truth["ink"]["phase"]["pvc"],
    "particle_index": lambda truth: truth["ink"]["phase"]["n_re"],
    "particle_absorption_index": lambda truth: truth["ink"]["phase"]["n_im"],
    "reduced_optical_thickness": lambda truth: (
        truth["optics"][0]["mus"] * (1 - truth["optics"][0]["g"]) * truth["ink"]["d_mm"]
    ),
}


def fit_declared(name: str, method: str = "gradient") -> tuple[FitResult, dict]:
    """Fit one simulated measurement from what its declared file says, and read its truth."""
    folder = data_folder("simulated")
    declared = json.loads((folder / f"{name}.declared.json").read_text())
    sample = jaxink.parse_sample(sample_toml(declared), name)
    result = jaxink.fit(folder / f"{name}.csv", sample, jaxink.FitOptions(method=method))
    return result, json.loads((folder / f"{name}.truth.json").read_text())


def comparison(result: FitResult, truth: dict) -> list[list[str]]:
    """Rows of fitted against true values, with their distance in standard errors."""
    rows = []
    found = [
        (p.name.split(".")[1], p.value, p.standard_error, p.interval) for p in result.parameters if p.free
    ]
    found += [
        (d.quantity, d.value, d.standard_error, None)
        for d in result.derived
        if d.quantity not in [f[0] for f in found]
    ]
    for key, value, error, interval in found:
        true = _TRUE_KEY[key](truth)
        distance = "" if not error else f"{(value - true) / error:+.2f}"
        span = "" if interval is None else f"{interval[0]:.5g} ... {interval[1]:.5g}"
        rows.append(
            [key, f"{value:.6g}", "" if error is None else f"{error:.2g}", f"{true:.6g}", distance, span]
        )
    return rows


def section(name: str) -> tuple[str, list[str]]:
    """Text on one measurement, and its row of the overview."""
    result, truth = fit_declared(name)
    m = result.merit
    rows = comparison(result, truth)
    worst = max((abs(float(row[4])) for row in rows if row[4]), default=float("nan"))
    jacobians = sum(s.jacobians for s in result.searches)
    seconds = sum(s.run_seconds for s in result.searches)
    overview = [
        f"`{name}`",
        f"{m.chi_square:.1f} / {m.degrees_of_freedom}",
        f"{m.probability:.3f}",
        f"{worst:.2f}",
        str(jacobians),
        f"{seconds:.2f}",
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


def main() -> None:
    """Write the page."""
    sections, overview = zip(*(section(name) for name in NAMES), strict=True)
    header = [
        "measurement",
        "chi-square / degrees of freedom",
        "probability",
        "largest distance from the truth, s.e.",
        "Jacobians after the scan",
        "seconds",
    ]
    text = f"""# Simulated samples without undeclared effects

The measurements are **simulated** by an independent Monte Carlo program. Each fit knows the declared file
only (ranges, thickness, indices, noise with its scan factor as covariance) and starts in the middle of the
ranges. This page is made by `python benchmarks/report_simulated.py` ({machine()}).

{table(header, list(overview))}

{"".join(sections)}"""
    write_page("simulated.md", text)


if __name__ == "__main__":
    main()
