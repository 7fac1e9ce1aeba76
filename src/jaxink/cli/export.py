"""The command that writes an ink for ray tracers."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from jaxink.cli.folder import require_folder, whole_folder
from jaxink.cli.session import EXIT_FITTED, prepare_jax

if TYPE_CHECKING:
    from jaxink.export import InkTable


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
    is_table = source.suffix == ".nc" and not source.is_dir()
    if not is_table:
        prepare_jax()
    from jaxink.export import ExportOptions, write
    from jaxink.export.writing import require_format

    require_format(format)
    options = ExportOptions(**choices)
    require_folder(out)
    table = _read(source) if is_table else _compute(source, layers)
    with whole_folder(out) as folder:
        files = [out / file.name for file in write(table, format, folder, options)]
    if not quiet:
        wavelengths = ", ".join(f"{wavelength_nm:g}" for wavelength_nm in table.wavelength_nm)
        typer.echo(f"Ink of {source} at {wavelengths} nm, for {format}.")
        if options.drop:
            typer.echo(f"Allowed to be lost: {', '.join(options.drop)}.")
        if options.regular_bin_deg is not None:
            typer.echo(f"Regular part spread over cones of {options.regular_bin_deg:g} degrees.")
        typer.echo("Written: " + ", ".join(str(file) for file in files))
    return EXIT_FITTED


def _read(source: Path) -> "InkTable":
    from jaxink.export.netcdf import read_ink_table

    return read_ink_table(source)


def _compute(source: Path, layers: Sequence[str]) -> "InkTable":
    import jaxink
    from jaxink.export.inside import ink_table

    return ink_table(jaxink.load_result(source), list(layers) or None)
