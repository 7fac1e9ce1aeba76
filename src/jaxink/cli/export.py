"""``jaxink export`` and ``jaxink boundary``."""

import dataclasses
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.one_measurement import is_described
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.writing import require_folder

if TYPE_CHECKING:
    from jaxink.export import ExportOptions
    from jaxink.ink import InkTable, RoughBoundary

# Bytes of an export above which its size is told.
_LARGE = 50_000_000


@dataclasses.dataclass(frozen=True)
class Target:
    """Format and folder of an export.

    Parameters
    ----------
    format, folder
        What to write, and where.
    choices
        Fields of `ExportOptions`.
    quiet
        Whether to print nothing.
    command
        The command that is running, to advise others like it.
    """

    format: str
    folder: Path
    choices: dict[str, Any]
    quiet: bool
    command: session.CommandLine

    def options(self) -> "ExportOptions":
        """The options, validated before anything is computed."""
        from jaxink.export import ExportOptions, require_format

        require_format(self.format)
        options = ExportOptions(**self.choices)
        require_folder(self.folder)
        return options


def run_export(source: Path, layers: Sequence[str], sampling: dict[str, Any], target: Target) -> ExitCode:
    """Write the ink of a result, or an ink table.

    Parameters
    ----------
    source
        Folder of a fit or of a diagnosis, a sample file, or the file of a table.
    layers
        Layers that form the ink; empty: the only scattering one.
    sampling
        Fields of `TableOptions`, None for their defaults.
    target
        Where to write what.
    """
    from jaxink.export import warning_of

    options = target.options()
    if source.suffix == ".nc" and not os.path.isdir(source):
        table = _read_table(source, layers, sampling)
    else:
        # Fast, as most refusals need neither the model nor JAX.
        with _advised(target, options, sampling):
            _foresee(source, layers, sampling, target, options)
        session.prepare_jax()
        from jaxink.export import remark_on_dots
        from jaxink.ink import TableOptions, find_ink
        from jaxink.sample import Sample

        described = jaxink.load_sample(source) if is_described(source) else jaxink.load_result(source)
        chosen = list(layers) or None
        table = jaxink.ink_table(described, chosen, options=TableOptions(**sampling))
        sample = described if isinstance(described, Sample) else described.sample
        remark = remark_on_dots(find_ink(sample, chosen, sampling["inside"]), table.wavelength_nm.tolist())
        if remark is not None:
            table.attrs["printed_dots"] = remark
    with _advised(target, options, sampling, table):
        start = " with the values that it states for its free parameters" * is_described(source)
        _write(table, target, options, f"Ink of {source}{start}")
    warning = warning_of(table)
    if warning is not None and not target.quiet:
        typer.echo(f"Warning: the ink is that of a fit that is not sound. {warning}", err=True)
    return ExitCode.FITTED


def _read_table(source: Path, layers: Sequence[str], sampling: dict[str, Any]) -> "InkTable":
    if layers or any(value is not None for value in sampling.values()):
        raise InputRefusedError(
            f"{source}: is a table that is computed already; leave out --layer, --from, --n-theta and "
            "--n-phi, or give the result of the fit instead."
        )
    return jaxink.read_ink_table(source)


def _foresee(
    source: Path, layers: Sequence[str], sampling: dict[str, Any], target: Target, options: "ExportOptions"
) -> None:
    """Reject what is known to fail before the table is computed."""
    from jaxink.export import LossRefusedError, refuse_expected
    from jaxink.ink import InkChoice, SavedFit, UnclearInkError, expected_table, find_ink, read_saved_fit

    if is_described(source):
        sample = jaxink.load_sample(source)
        if not sample.wavelengths_nm:
            raise InputRefusedError(
                f"{source}: states no wavelength, which the table of the ink has to name; write "
                "wavelength_nm = <number in nm> at the top."
            )
        saved: SavedFit | None = SavedFit(sample, sample.wavelengths_nm, has_standard_errors=False)
    else:
        saved = read_saved_fit(source)
    if saved is None:
        return

    def refuse(chosen: Sequence[str] | None, inside: str | None) -> None:
        ink = find_ink(saved.sample, chosen, inside)
        table = expected_table(ink, saved.wavelengths_nm, saved.has_standard_errors)
        refuse_expected(table, target.format, options)

    def command(choice: InkChoice) -> tuple[str, str]:
        changes: dict[str, Any] = {"--layer": choice.layers, "--from": choice.inside}
        try:
            refuse(choice.layers, choice.inside)
        except LossRefusedError as problem:
            width_deg = _width_deg(problem.losses, sampling)
            changes |= _spreading(options, problem.losses, width_deg)
        noun = "Layer" if len(choice.layers) == 1 else "Layers"
        what = f"{noun} {' and '.join(choice.layers)}, seen from {choice.inside}"
        return what, target.command.changed(changes)

    try:
        refuse(list(layers) or None, sampling["inside"])
    except UnclearInkError as problem:
        sentence = f"{source}: {problem}"
        raise session.AdvisedError(sentence, [command(choice) for choice in problem.choices]) from None


def _allowing(options: "ExportOptions", losses: Sequence[str]) -> str | None:
    return ",".join([*options.drop, *losses]) or None


def _width_deg(
    losses: Sequence[str], sampling: dict[str, Any], table: "InkTable | None" = None
) -> int | None:
    """Width of the cones over which regular light can be spread; None if none is lost or no width will do."""
    from jaxink.export import least_bin_deg

    if "regular" not in losses:
        return None
    return least_bin_deg(table, sampling.get("n_theta"), sampling.get("n_phi"))


def _spreading(options: "ExportOptions", losses: Sequence[str], width_deg: int | None) -> dict[str, Any]:
    """Options that spread regular light, if it can be, and allow all other losses."""
    others = [loss for loss in losses if width_deg is None or loss != "regular"]
    spread = {} if width_deg is None else {"--regular-bin-deg": width_deg}
    return {"--allow-loss": _allowing(options, others)} | spread


@contextmanager
def _advised(
    target: Target, options: "ExportOptions", sampling: dict[str, Any], table: "InkTable | None" = None
) -> Iterator[None]:
    """Add to a refusal of losses the whole commands that allow or avoid them."""
    from jaxink.export import LossRefusedError

    try:
        yield
    except LossRefusedError as problem:
        commands = []
        width_deg = _width_deg(problem.losses, sampling, table)
        if width_deg is not None:
            spread = _spreading(options, problem.losses, width_deg)
            what = f"To keep regular light, and with it total reflection, in cones of {width_deg} degrees"
            commands.append((what, target.command.changed(spread)))
        allowed = {"--allow-loss": _allowing(options, problem.losses)}
        what = "To give up total reflection and all other regular light" if commands else "To leave it out"
        commands.append((what, target.command.changed(allowed)))
        raise session.AdvisedError(problem.reason, commands) from None


def run_boundary(source: Path, sampling: dict[str, Any], target: Target) -> ExitCode:
    """Write the boundary of a surface file; ``sampling`` are keywords of `boundary_table`."""
    session.prepare_jax()
    from jaxink.export import refuse_expected
    from jaxink.ink import boundary_table, excess_of_power, expected_boundary, load_boundary

    options = target.options()
    boundary = load_boundary(source)
    with _advised(target, options, sampling):
        refuse_expected(expected_boundary(boundary), target.format, options)
    table = boundary_table(boundary, **sampling)
    excess = excess_of_power(table)
    if excess is not None:
        raise InputRefusedError(
            f"{source}: the table of this boundary sends out {excess}; use more angles (--n-theta, --n-phi) "
            "if its lobes are narrow, or scale such directions down (--limit-power)."
        )
    remarks = [] if target.quiet else [*_judged(boundary), *_sampled(table)]
    with _advised(target, options, sampling, table):
        _write(table, target, options, f"Boundary of {source} by {boundary.method}", remarks)
    return ExitCode.FITTED


def _write(
    table: "InkTable", target: Target, options: "ExportOptions", what: str, remarks: Sequence[str] = ()
) -> None:
    """Write the files and print what they contain."""
    from jaxink.export import write_folder

    files, guide = write_folder(table, target.format, target.folder, options)
    if target.quiet:
        return
    wavelengths = ", ".join(f"{wavelength_nm:g}" for wavelength_nm in table.wavelength_nm)
    lines = [f"{what} at {wavelengths} nm, for {target.format}.", *remarks]
    # Which of the losses that were allowed there are, the guide says.
    lines += guide.lines(target.folder)
    size = sum(file.stat().st_size for file in files)
    if size > _LARGE:
        lines.append(f"Together they take up {size / 1e6:.0f} MB.")
    typer.echo("\n".join(lines))


def _judged(boundary: "RoughBoundary") -> list[str]:
    """Lines on whether the theory is valid for a boundary."""
    from jaxink.ink import INCIDENCES_DEG, validity_checks

    checks = validity_checks(boundary)
    if not checks:
        return [
            "Facets (ray optics) are valid if heights and lateral structure are much larger than the "
            "wavelength; a slope density alone cannot show this."
        ]
    incidences = ", ".join(f"{angle:g}" for angle in INCIDENCES_DEG)
    lines = [f"Validity for both sides and incidence at {incidences} degrees:"]
    for check in checks:
        low, high = f"{check.least:.3g}", f"{check.largest:.3g}"
        verdict = {True: "valid", None: "-"}.get(check.holds, f"not valid: {check.worst:.3g} {check.where}")
        span = low if low == high else f"{low} to {high}"
        lines.append(f"  {check.name:<26}{span:<24}{check.asked:<34}{verdict}")
    return lines


def _sampled(table: "InkTable") -> list[str]:
    """Lines on the power and the sampling of the table."""
    power = table.attrs["power_of_table"]
    lines = [
        f"Power that the table sends out, for incidence up to 80 degrees: {power} times the incident power.",
        f"Largest error of linear interpolation: about {table.attrs['interpolation_error']:.2g} of the peak.",
    ]
    if float(power.split()[-1]) > 1.01:
        lines.append(
            "More power than arrives: the lobes are narrower than the steps of the table (--n-theta, "
            "--n-phi), or wave optics is not valid here."
        )
    if "least_power_factor" in table.attrs:
        factor = table.attrs["least_power_factor"]
        lines.append(f"Directions with more power than arrives were scaled down, by {factor:.4g} at most.")
    return lines
