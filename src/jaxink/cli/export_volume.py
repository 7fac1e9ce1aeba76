"""``jaxink export --as volume``."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import typer

import jaxink
from jaxink.cli import session
from jaxink.cli.one_measurement import is_described
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.writing import require_folder


def run_volume(
    source: Path, layers: Sequence[str], inside: str | None, format: str, out: Path, name: str, quiet: bool
) -> ExitCode:
    """Write the ink of a result as a volume.

    Parameters
    ----------
    source
        Folder of a fit or of a diagnosis, or a sample file.
    layers, inside
        As for `jaxink.ink.find_ink`.
    format, out, name
        As for `jaxink.export.volume.write_volume`.
    quiet
        Whether to print nothing.
    """
    if source.suffix == ".nc":
        raise InputRefusedError(
            f"{source}: is the table of a surface; a volume (--as volume) needs the folder of a fit or of a "
            "diagnosis."
        )
    session.prepare_jax()
    from jaxink.export import VOLUME_FORMATS, medium_of, remark_on_dots, write_volume
    from jaxink.ink import find_ink

    require_one_of("format", format, VOLUME_FORMATS)
    require_folder(out)
    if is_described(source):
        sample = jaxink.load_sample(source)
        wavelengths = list(sample.wavelengths_nm)
    else:
        result = jaxink.load_result(source)
        sample, wavelengths = result.sample, np.unique(result.data.wavelength_nm[result.data.used]).tolist()
    if not wavelengths:
        raise InputRefusedError(f"{source}: names no wavelength_nm, which a volume needs; add it.")
    ink = find_ink(sample, list(layers) or None, inside)
    files = write_volume(medium_of(ink, wavelengths), format, out, name, remark_on_dots(ink, wavelengths))
    if not quiet:
        shown = ", ".join(f"{wavelength:g}" for wavelength in wavelengths)
        typer.echo("\n".join([f"Volume of {source} at {shown} nm, for {format}.", *map(str, files)]))
    return ExitCode.FITTED
