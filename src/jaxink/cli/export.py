"""``jaxink export`` and ``jaxink boundary``."""

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.writing import require_folder

if TYPE_CHECKING:
    from jaxink.export import ExportOptions
    from jaxink.ink import InkTable
    from jaxink.ink.boundary_file import RoughBoundary


@dataclasses.dataclass(frozen=True)
class Target:
    """Format and folder of an export; ``choices`` are fields of `ExportOptions`."""

    format: str
    folder: Path
    choices: dict[str, Any]
    quiet: bool

    def options(self) -> "ExportOptions":
        """The options, validated before anything is computed."""
        from jaxink.export import ExportOptions
        from jaxink.export.formats import require_format

        require_format(self.format)
        options = ExportOptions(**self.choices)
        require_folder(self.folder)
        return options


def run_export(source: Path, layers: Sequence[str], target: Target) -> ExitCode:
    """Write the ink of a result, or an ink table; without layers, the only scattering one is the ink."""
    is_table = source.suffix == ".nc" and not os.path.isdir(source)
    if not is_table:
        session.prepare_jax()
    options = target.options()
    if is_table:
        table = jaxink.read_ink_table(source)
    else:
        table = jaxink.ink_table(jaxink.load_result(source), list(layers) or None)
    _write(table, target, options, f"Ink of {source}")
    return ExitCode.FITTED


def run_boundary(source: Path, sampling: dict[str, Any], target: Target) -> ExitCode:
    """Write the boundary of a surface file; ``sampling`` are keywords of `boundary_table`."""
    session.prepare_jax()
    from jaxink.ink.boundary import boundary_table
    from jaxink.ink.boundary_file import load_boundary
    from jaxink.ink.hemispherical_totals import excess_of_power

    options = target.options()
    boundary = load_boundary(source)
    table = boundary_table(boundary, **sampling)
    excess = excess_of_power(table)
    if excess is not None:
        raise InputRefusedError(
            f"{source}: the table of this boundary sends out {excess}; use more angles (--n-theta, --n-phi) "
            "if its lobes are narrow, or scale such directions down (--limit-power)."
        )
    remarks = [] if target.quiet else [*_judged(boundary), *_sampled(table)]
    _write(table, target, options, f"Boundary of {source} by {boundary.method}", remarks)
    return ExitCode.FITTED


def _write(
    table: "InkTable", target: Target, options: "ExportOptions", what: str, remarks: Sequence[str] = ()
) -> None:
    """Write the files and print what they contain."""
    from jaxink.export.formats import write_folder

    files = write_folder(table, target.format, target.folder, options)
    if target.quiet:
        return
    wavelengths = ", ".join(f"{wavelength_nm:g}" for wavelength_nm in table.wavelength_nm)
    lines = [f"{what} at {wavelengths} nm, for {target.format}.", *remarks]
    if options.drop:
        lines.append(f"Losses allowed: {', '.join(options.drop)}.")
    if options.regular_bin_deg is not None:
        lines.append(f"Regular part spread over cones of {options.regular_bin_deg:g} degrees.")
    typer.echo("\n".join([*lines, "Written: " + ", ".join(str(file) for file in files)]))


def _judged(boundary: "RoughBoundary") -> list[str]:
    """Lines on whether the theory is valid for a boundary."""
    from jaxink.ink.boundary_validity import INCIDENCES_DEG, validity_checks

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
