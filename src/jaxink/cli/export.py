"""The commands that write an ink, or a rough boundary alone, for ray tracers."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from jaxink.cli.session import EXIT_FITTED, prepare_jax
from jaxink.errors import InputRefusedError
from jaxink.files.writing import require_folder

if TYPE_CHECKING:
    from jaxink.export import ExportOptions
    from jaxink.ink import InkTable
    from jaxink.ink.boundary_file import RoughBoundary


def run_export(
    source: Path,
    format: str,
    out: Path,
    layers: Sequence[str],
    choices: dict[str, Any],
    quiet: bool,
) -> int:
    """Write the ink of a result, or a table of one, for a ray tracer.

    Parameters
    ----------
    source
        Result folder, ``result.json``, or netCDF file of an ink table.
    format
        One of the formats.
    out
        Folder for the files.
    layers
        Names of the layers that make the ink; empty: the only scattering one.
    choices
        Fields of `ExportOptions`.
    quiet
        Print nothing.

    Returns
    -------
    int
        Exit code.
    """
    is_table = source.suffix == ".nc" and not os.path.isdir(source)
    if not is_table:
        prepare_jax()
    options = _options(format, out, choices)
    table = _read(source) if is_table else _compute(source, layers)
    lines = _written(table, format, out, options)
    if not quiet:
        _tell(f"Ink of {source}", table, format, lines)
    return EXIT_FITTED


def run_boundary(
    source: Path,
    format: str,
    out: Path,
    sampling: dict[str, Any],
    choices: dict[str, Any],
    quiet: bool,
) -> int:
    """Write a rough boundary alone, between two clear media, for a ray tracer.

    Parameters
    ----------
    source
        Surface file.
    format
        One of the formats.
    out
        Folder for the files.
    sampling
        Keywords of `jaxink.ink.boundary.boundary_table`.
    choices
        Fields of `ExportOptions`.
    quiet
        Print nothing.

    Returns
    -------
    int
        Exit code.
    """
    prepare_jax()
    from jaxink.ink.boundary import boundary_table
    from jaxink.ink.boundary_file import load_boundary
    from jaxink.ink.hemispherical_totals import excess_of_power

    options = _options(format, out, choices)
    boundary = load_boundary(source)
    table = boundary_table(boundary, **sampling)
    excess = excess_of_power(table)
    if excess is not None:
        raise InputRefusedError(
            f"{source}: the table of this boundary sends out {excess}: give it more angles where lobes are "
            "narrow (--n-theta, --n-phi), or scale such directions down (--limit-power)."
        )
    lines = [] if quiet else [*_judged(boundary), *_sampled(table)]
    lines += _written(table, format, out, options)
    if not quiet:
        _tell(f"Boundary of {source} by {boundary.method}", table, format, lines)
    return EXIT_FITTED


def _options(format: str, out: Path, choices: dict[str, Any]) -> "ExportOptions":
    """The choices; refused before anything is computed."""
    from jaxink.export import ExportOptions
    from jaxink.export.formats import require_format

    require_format(format)
    options = ExportOptions(**choices)
    require_folder(out)
    return options


def _read(source: Path) -> "InkTable":
    from jaxink.ink.table import read_ink_table

    return read_ink_table(source)


def _compute(source: Path, layers: Sequence[str]) -> "InkTable":
    import jaxink
    from jaxink.ink.tabulate import ink_table

    return ink_table(jaxink.load_result(source), list(layers) or None)


def _written(table: "InkTable", format: str, out: Path, options: "ExportOptions") -> list[str]:
    """Write the files; lines that say what they hold."""
    from jaxink.export.formats import write_folder

    files = write_folder(table, format, out, options)
    lines = []
    if options.drop:
        lines.append(f"Allowed to be lost: {', '.join(options.drop)}.")
    if options.regular_bin_deg is not None:
        lines.append(f"Regular part spread over cones of {options.regular_bin_deg:g} degrees.")
    return [*lines, "Written: " + ", ".join(str(file) for file in files)]


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


def _tell(what: str, table: "InkTable", format: str, lines: Sequence[str]) -> None:
    wavelengths = ", ".join(f"{wavelength_nm:g}" for wavelength_nm in table.wavelength_nm)
    typer.echo("\n".join([f"{what} at {wavelengths} nm, for {format}.", *lines]))
