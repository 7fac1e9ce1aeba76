"""The commands that write an ink, or a rough boundary alone, for ray tracers."""

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
    """What a table is written as, and where.

    Parameters
    ----------
    format
        One of the formats.
    folder
        For the files.
    choices
        Fields of `ExportOptions`.
    quiet
        Print nothing.
    """

    format: str
    folder: Path
    choices: dict[str, Any]
    quiet: bool

    def options(self) -> "ExportOptions":
        """The choices; refused before anything is computed."""
        from jaxink.export import ExportOptions
        from jaxink.export.formats import require_format

        require_format(self.format)
        options = ExportOptions(**self.choices)
        require_folder(self.folder)
        return options


def run_export(source: Path, layers: Sequence[str], target: Target) -> ExitCode:
    """Write the ink of a result, or a table of one, for a ray tracer.

    Parameters
    ----------
    source
        Result folder, ``result.json``, or netCDF file of an ink table.
    layers
        Names of the layers that make the ink; empty: the only scattering one.
    target
        Where to.
    """
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
    """Write a rough boundary alone, between two clear media, for a ray tracer.

    Parameters
    ----------
    source
        Surface file.
    sampling
        Keywords of `jaxink.ink.boundary.boundary_table`.
    target
        Where to.
    """
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
            f"{source}: the table of this boundary sends out {excess}: give it more angles where lobes are "
            "narrow (--n-theta, --n-phi), or scale such directions down (--limit-power)."
        )
    remarks = [] if target.quiet else [*_judged(boundary), *_sampled(table)]
    _write(table, target, options, f"Boundary of {source} by {boundary.method}", remarks)
    return ExitCode.FITTED


def _write(
    table: "InkTable", target: Target, options: "ExportOptions", what: str, remarks: Sequence[str] = ()
) -> None:
    """Write the files, and say what they hold."""
    from jaxink.export.formats import write_folder

    files = write_folder(table, target.format, target.folder, options)
    if target.quiet:
        return
    wavelengths = ", ".join(f"{wavelength_nm:g}" for wavelength_nm in table.wavelength_nm)
    lines = [f"{what} at {wavelengths} nm, for {target.format}.", *remarks]
    if options.drop:
        lines.append(f"Allowed to be lost: {', '.join(options.drop)}.")
    if options.regular_bin_deg is not None:
        lines.append(f"Regular part spread over cones of {options.regular_bin_deg:g} degrees.")
    typer.echo("\n".join([*lines, "Written: " + ", ".join(str(file) for file in files)]))


def _judged(boundary: "RoughBoundary") -> list[str]:
    """Lines that say whether the theory holds for a boundary."""
    from jaxink.ink.boundary_validity import INCIDENCES_DEG, validity_checks

    checks = validity_checks(boundary)
    if not checks:
        return [
            "Facets hold where heights and lateral structure are much larger than the wavelength; a density "
            "of slopes does not tell."
        ]
    incidences = ", ".join(f"{angle:g}" for angle in INCIDENCES_DEG)
    lines = [f"Validity, over both sides and incidences of {incidences} degrees:"]
    for check in checks:
        low, high = f"{check.least:.3g}", f"{check.largest:.3g}"
        verdict = {True: "holds", None: "-"}.get(
            check.holds, f"does not hold: {check.worst:.3g} {check.where}"
        )
        span = low if low == high else f"{low} ... {high}"
        lines.append(f"  {check.name:<26}{span:<24}{check.asked:<34}{verdict}")
    return lines


def _sampled(table: "InkTable") -> list[str]:
    """Lines on the table as a table."""
    power = table.attrs["power_of_table"]
    lines = [
        f"Power that the table sends out, for incidence up to 80 degrees: {power} of the incident.",
        f"Largest error of linear interpolation in it: about {table.attrs['interpolation_error']:.2g} of the "
        "lobe.",
    ]
    if float(power.split()[-1]) > 1.01:
        lines.append(
            "More than arrives: lobes narrower than the steps of the table (--n-theta, --n-phi), or wave "
            "optics beyond where it holds."
        )
    if "least_power_factor" in table.attrs:
        factor = table.attrs["least_power_factor"]
        lines.append(f"Scaled down where that is more than arrives, by factors down to {factor:.4g}.")
    return lines
