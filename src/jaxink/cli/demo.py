"""``jaxink demo``: from a simulated measurement, through an undeclared effect, to an ink in a ray tracer."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

import jaxink
from jaxink.cli import session
from jaxink.cli.fit import write_result
from jaxink.cli.fit_tables import console, show_files, show_lines
from jaxink.cli.session import ExitCode
from jaxink.data import STRAY_LIGHT_TRUTH, stray_light_example
from jaxink.files.result_folder import PAGE_FILE
from jaxink.files.writing import require_folder, whole_folder
from jaxink.numerics.digits import percent, rounded, with_uncertainty
from jaxink.numerics.failures import Failures

if TYPE_CHECKING:
    from jaxink import Diagnosis, DiagnosisOptions, FitOptions, FitResult, GonioData
    from jaxink.ink import TableComparison

FIT, SIMPLEX, REPORT, INK = "fit", "fit-simplex", "report", "ink"
# To be quick: coarser than the default, and without the effects that need programs of their own.
ACCURACY, NULL_DATA_SETS = 0.02, 500
EFFECTS = ("gain", "side_gain", "stray_light", "signal_floor", "drift", "pinholes")


def run_demo(out: Path, formats: Sequence[str], quiet: bool) -> ExitCode:
    """Fit by both methods, diagnose, correct and export the embedded example; all files go to ``out``."""
    require_folder(out)
    inputs = stray_light_example()
    data, sample = jaxink.read(inputs[0]), jaxink.load_sample(inputs[1])
    session.prepare_jax()
    to = None if quiet else console()
    if to is not None:
        _show_measurement(to, data)
    with session.progress(quiet) as follow:
        gradient = jaxink.fit(data, sample, _fit_options("gradient"), follow)
    files = _write_fit(out, inputs, gradient, formats)
    if to is not None:
        to.print(f"A first picture, and the page of the fit: {out / FIT / PAGE_FILE}", soft_wrap=True)
    with session.progress(quiet) as follow:
        simplex = jaxink.fit(data, sample, _fit_options("simplex"), follow)
    files += sorted(simplex.save(out / SIMPLEX).parent.iterdir())
    if to is not None:
        _show_fits(to, gradient, simplex)
    with session.progress(quiet) as follow:
        found = jaxink.diagnose(data, sample, _diagnosis_options(), follow, fitted=gradient)
    from jaxink.export import ExportOptions, write_folder
    from jaxink.report import inside_change, write_report

    change, failures = inside_change(found), Failures()
    words = [str(out / inputs[0].name)]
    files += write_report(found, out / REPORT, bool(formats), words, change, failures)
    session.show_failures(failures)
    if not isinstance(change, str):
        files += write_folder(change.after, "csv", out / INK, ExportOptions())[0]
    if to is not None:
        _show_correction(to, found, change)
        show_files(to, sorted(files))
        _show_next(to, out)
    return ExitCode.FITTED if gradient.converged and not found.structure_remains else ExitCode.NOT_CONVERGED


def _fit_options(method: str) -> "FitOptions":
    return jaxink.FitOptions(method=method, profile="none", accuracy=ACCURACY)


def _diagnosis_options() -> "DiagnosisOptions":
    """Of the whole catalogue only some effects: most others need programs whose compilation takes seconds."""
    from jaxink.effects import CATALOGUE

    some = tuple(effect for effect in CATALOGUE if effect.name in EFFECTS)
    return jaxink.DiagnosisOptions(catalogue=some, n_bootstrap=NULL_DATA_SETS, fit=_fit_options("gradient"))


def _write_fit(
    out: Path, inputs: Sequence[Path], gradient: "FitResult", formats: Sequence[str]
) -> list[Path]:
    """Copies of the inputs, and the fit with its page."""
    with whole_folder(out) as folder:
        for file in inputs:
            (folder / file.name).write_bytes(file.read_bytes())
    copies = [out / file.name for file in inputs]
    return [*copies, *write_result(gradient, out / FIT, formats, [str(copies[0])], copies[1])]


def _show_measurement(to: Console, data: "GonioData") -> None:
    """Print what the demonstration is about."""
    from jaxink.effects import CATALOGUE

    to.print(f"SIMULATED measurement ({data.source}), {len(data)} points:", style="bold")
    to.print("a known ink, computed by an independent Monte Carlo program, with noise, and with an effect")
    to.print("that the sample file does not declare.")
    to.print(
        f"To be quick, the BSDF is computed to {100 * ACCURACY:g} per cent, and the diagnosis tests "
        f"{len(EFFECTS)} of {len(CATALOGUE)} effects; the commands below test all, to 0.01 per cent.",
        soft_wrap=True,
    )
    to.print()


def _show_fits(to: Console, gradient: "FitResult", simplex: "FitResult") -> None:
    """Print both fits beside the values with which the measurement was simulated."""
    to.print()
    to.print("1. The fit. Both methods minimise the same chi-square from the same start.", style="bold")
    to.print(_comparison_table(gradient, simplex))
    if gradient.searches[0].loss < simplex.searches[0].loss:
        to.print(
            "The gradient method found the lower chi-square. Where the simplex, which stopped higher, is "
            "nearer to a true value, that is chance: with an effect missing, neither has to find the truth.",
            soft_wrap=True,
        )
    to.print(f"Something is missing. {gradient.verdict.sentence}", soft_wrap=True)
    to.print()


def _comparison_table(gradient: "FitResult", simplex: "FitResult") -> Table:
    """Values and effort of both fits, one column each."""
    table = _table("", "true value", "start", "gradient", "simplex")
    for name, truth in STRAY_LIGHT_TRUTH.items():
        if name in gradient.parameters:
            fitted = (f"{r[name].value:.5g}" for r in (gradient, simplex))
            table.add_row(name, f"{truth:g}", f"{gradient[name].start:.4g}", *fitted)
    table.add_section()
    searches = [r.searches[0] for r in (gradient, simplex)]
    for label, text in (
        ("chi-square", lambda s: f"{s.loss:.2f}"),
        ("Jacobians", lambda s: str(s.jacobians)),
        ("evaluations", lambda s: str(s.evaluations)),
        ("outcome", lambda s: s.outcome),
    ):
        table.add_row(label, "", "", *(text(s) for s in searches))
    for label, of in (("compilation, s", "compile_seconds"), ("run time, s", "run_seconds")):
        table.add_row(label, "", "", *(f"{getattr(r, of):.2f}" for r in (gradient, simplex)))
    return table


def _show_correction(to: Console, found: "Diagnosis", change: "TableComparison | str") -> None:
    """Print the verdict, both models beside the truth, and what the correction changes in the export."""
    to.print("2. The diagnosis.", style="bold")
    to.print(found.verdict.sentence, soft_wrap=True)
    to.print()
    to.print("3. The corrected model.", style="bold")
    table = _table("", "true value", "declared model", "corrected model")
    models = found.declared, found.corrected
    for name, truth in STRAY_LIGHT_TRUTH.items():
        rows = [model.parameters.get(name) for model in models]
        cells = ("-" if p is None else with_uncertainty(p.value, p.standard_error) for p in rows)
        table.add_row(name, f"{truth:g}", *cells)
    table.add_section()
    table.add_row("reduced chi-square", "", *(rounded(m.merit.reduced_chi_square, 4) for m in models))
    table.add_row("rms of m/s - 1", "", *(percent(m.deviation and m.deviation.rms) for m in models))
    to.print(table)
    to.print("4. The ink, as seen from inside the plate, for a ray tracer.", style="bold")
    if isinstance(change, str):
        to.print(change, soft_wrap=True)
    else:
        from jaxink.ink import LARGEST_THETA_DEG

        of = change.of("R_II")
        to.print(
            f"The correction changes the BSDF inside the plate (R_II) by {of.rms_percent:.2g} % rms, by "
            f"{of.largest_percent:+.3g} % at most, over directions up to {LARGEST_THETA_DEG:g} degrees "
            "from the normal.",
            soft_wrap=True,
        )
    to.print()


def _table(*heads: str) -> Table:
    from rich.box import SIMPLE_HEAD

    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    for head in heads:
        table.add_column(head, justify="right" if head else "left", no_wrap=True)
    return table


def _show_next(to: Console, out: Path) -> None:
    """Print commands that go on from here."""
    from jaxink.export import least_bin_deg

    data, sample = (str(out / file.name) for file in stray_light_example())
    # Total reflection is kept, without which a plate guides no light.
    lossy = ["--allow-loss", "beyond_critical,standard_errors", "--regular-bin-deg", str(least_bin_deg(None))]
    lines = [
        ["fit", data, "--sample", sample, "--out", "my-fit"],
        ["diagnose", data, "--sample", sample, "--out", "my-report"],
        ["export", str(out / REPORT), "--format", "zemax", *lossy, "--out", "my-ink"],
        ["init", "your-measurement.csv", "--out", "your-sample.toml"],
    ]
    to.print()
    show_lines(to, "Next", [shlex.join([session.program(), *line]) for line in lines])
