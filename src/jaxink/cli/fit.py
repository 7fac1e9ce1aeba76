"""``jaxink fit``."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.encoding import json_text
from jaxink.files.result_folder import PAGE_FILE, RESULT_FILE, require_not_replaced
from jaxink.files.writing import require_folder, whole_folder
from jaxink.measurement import option_words
from jaxink.numerics.failures import Failures
from jaxink.plots import FIGURE_FOLDER

if TYPE_CHECKING:
    from jaxink import FitResult, GonioData, JointResult

# Replaced as a whole: otherwise parts of an older result could remain.
OWNED = (FIGURE_FOLDER, PAGE_FILE)


def run_fit(
    data_files: Sequence[Path],
    sample_file: Path,
    out: Path,
    options: dict[str, Any],
    columns: dict[str, Any],
    formats: Sequence[str],
    output: str,
    drawn_nm: Sequence[float] | None = None,
    checks_input: bool = True,
) -> ExitCode:
    """Fit a measurement and write the result to the folder ``out``.

    ``options`` are fields of `FitOptions`, ``columns`` keywords of `jaxink.read`, ``formats`` those of the
    figures, ``drawn_nm`` the wavelengths of their scans; ``output`` is ``tables``, ``json`` or ``quiet``;
    ``checks_input`` says whether mistakes in the input are tested.
    """
    require_folder(out)
    require_not_replaced(out, [*data_files, sample_file], RESULT_FILE)
    data, sample = jaxink.read(data_files, **columns), jaxink.load_sample(sample_file)
    if drawn_nm:
        _require_measured(data, drawn_nm)
    session.prepare_jax()
    session.import_meanwhile("xarray", *(["jaxink.plots.overview"] if formats else []))
    chosen = jaxink.FitOptions(**options)
    with session.progress(quiet=output != "tables") as follow:
        result = jaxink.fit(data, sample, chosen, follow)
        if checks_input:
            result = _checked(result, out, follow)
    files = write_result(result, out, formats, input_words(data_files, columns), sample_file, drawn_nm)
    if output == "json":
        typer.echo(json_text({**result.to_dict(), "files": [str(file) for file in files]}))
    elif output == "tables":
        from jaxink.cli.fit_tables import console, show_result
        from jaxink.report import fit_next_steps

        show_result(
            console(),
            result,
            files,
            fit_next_steps(result, out, input_words(data_files, columns), str(sample_file)),
        )
    return exit_code(result)


def _checked(result: "FitResult", out: Path, follow) -> "FitResult":
    """The result with the mistakes that its input may have; it is written first if they are tested by refits.

    These may take longer than the fit, which is not lost if they are stopped.
    """
    from jaxink.fitting import check_input, is_doubtful

    if not is_doubtful(result):
        return check_input(result, follow)
    with whole_folder(out, owned=OWNED) as folder:
        result.write_into(folder)
    try:
        return check_input(result, follow)
    except KeyboardInterrupt:
        typer.echo(f"jaxink: the fit is kept in {out}; its input was not tested to the end.", err=True)
        raise


def exit_code(result: "FitResult") -> ExitCode:
    """Exit code of a command that fitted."""
    if not result.outcome.is_as_asked:
        return ExitCode.NOT_CONVERGED
    return ExitCode.UNEXPLAINED if result.verdict.is_misfit else ExitCode.FITTED


def input_words(data_files: Sequence[Path], columns: dict[str, Any]) -> list[str]:
    """Words of a command for a measurement: its files, and how to read them (keywords of `jaxink.read`)."""
    return [*map(str, data_files), *option_words(columns)]


def _require_measured(data: "GonioData", wavelengths_nm: Sequence[float]) -> None:
    """Reject wavelengths of figures that the measurement does not have, before anything is fitted."""
    held = sorted(set(data.wavelength_nm.tolist()))
    for wave in wavelengths_nm:
        if all(abs(wave - other) > 1e-6 for other in held):
            raise InputRefusedError(
                f"--figures-at {wave:g}: the measurement has no such wavelength; it has "
                f"{', '.join(f'{other:g}' for other in held)} nm."
            )


def write_result(
    result: "FitResult",
    out: Path,
    formats: Sequence[str],
    inputs: Sequence[str] = (),
    sample_file: Path | None = None,
    drawn_nm: Sequence[float] | None = None,
) -> list[Path]:
    """Write a result, all of its files or none; then its page.

    ``inputs`` and ``sample_file`` are for the commands on the page. What fails of the page and its figures is
    said on stderr.
    """

    def write_page(failures: Failures) -> list[Path]:
        from jaxink.report import write_fit_page

        sample = "" if sample_file is None else str(sample_file)
        return write_fit_page(result, out, formats, inputs, sample, drawn_nm, failures)

    return write_with_page(result, out, OWNED, write_page)


def write_with_page(
    result: "FitResult | JointResult",
    out: Path,
    owned: Sequence[str],
    write_page: Callable[[Failures], list[Path]],
) -> list[Path]:
    """Write a result, all of its files or none, in place of what it ``owned``; then its page."""
    with whole_folder(out, owned=owned) as folder:
        result.write_into(folder)
        files = [out / file.relative_to(folder) for file in folder.rglob("*") if file.is_file()]
    failures, pages = Failures(), list[Path]()
    with failures.sparing("the page of the fit", ""):
        pages = write_page(failures)
    session.show_failures(failures)
    return sorted([*files, *pages])
