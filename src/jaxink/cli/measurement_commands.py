"""Commands that read a measurement: ``jaxink convert`` and ``jaxink init``."""

from pathlib import Path
from typing import Annotated

import typer

from jaxink.cli.options import (
    AS_IN_FILE,
    Data,
    Debug,
    Quiet,
    Reading,
    with_reading,
)
from jaxink.cli.session import one_sentence
from jaxink.errors import InputRefusedError


@with_reading
def convert(
    data: Data,
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="The CSV file to write.")],
    reading: Reading = AS_IN_FILE,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Write files of instruments and ray tracers as one tidy CSV file (docs/manual/formats-in.md)."""
    with one_sentence(debug):
        from jaxink.cli.convert import run_convert

        raise typer.Exit(run_convert(data, out, reading.keywords(), quiet))


@with_reading
def init(
    data: Data,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="The file to write; by default sample.toml, or project.toml with --project.",
        ),
    ] = None,
    project: Annotated[
        bool,
        typer.Option(
            "--project",
            help="Write a project, with one measurement for each file, and the common sample.toml beside it.",
        ),
    ] = False,
    order: Annotated[
        str | None,
        typer.Option(
            metavar="plate,ink|ink,plate|ink", help="Layers in the order in which light meets them."
        ),
    ] = None,
    plate_index: Annotated[
        str | None, typer.Option(metavar="N", help="Refractive index of the plate.")
    ] = None,
    plate_mm: Annotated[
        str | None, typer.Option(metavar="MM", help="Thickness of the plate, in mm or with its unit.")
    ] = None,
    ink_index: Annotated[
        str | None, typer.Option(metavar="N", help="Refractive index of the ink's binder.")
    ] = None,
    ink_um: Annotated[
        str | None, typer.Option(metavar="UM|opaque", help="Thickness of the ink, in um or with its unit.")
    ] = None,
    phase_function: Annotated[
        str | None,
        typer.Option(
            metavar="henyey_greenstein|two_term_henyey_greenstein|rayleigh|mie",
            help="Phase function of the ink.",
        ),
    ] = None,
    particle_index: Annotated[
        str | None, typer.Option(metavar="N", help="Refractive index of Mie particles.")
    ] = None,
    radius_nm: Annotated[
        str | None, typer.Option(metavar="NM", help="Guess of the radius of Mie particles.")
    ] = None,
    wavelengths: Annotated[
        str | None,
        typer.Option(metavar="NM,...", help="Wavelengths of the measurement to fit; all by default."),
    ] = None,
    asymmetry: Annotated[
        str | None,
        typer.Option(metavar="one|each", help="One asymmetry g for all wavelengths, or one for each."),
    ] = None,
    colour_from_reflectance: Annotated[
        bool,
        typer.Option(
            "--colour-from-reflectance",
            help="Take the shape of the spectrum from the diffuse reflectance; only its mean is fitted.",
        ),
    ] = False,
    reading: Reading = AS_IN_FILE,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Write a first sample file, with comments, from a measurement, options and a few questions."""
    with one_sentence(debug):
        from jaxink.cli.init import run_init
        from jaxink.measurement import option_words

        given = {"order": order, "plate_index": plate_index, "plate_mm": plate_mm, "ink_index": ink_index}
        given |= {"ink_um": ink_um, "phase_function": phase_function}
        given |= {"particle_index": particle_index, "radius_nm": radius_nm}
        given |= {"wavelengths_nm": wavelengths, "asymmetry": asymmetry}
        stated = reading.keywords()
        options = option_words(stated)
        if project:
            from jaxink.cli.init_project import run_init_project

            out = out or Path("project.toml")
            if colour_from_reflectance:
                raise InputRefusedError(
                    "--colour-from-reflectance is for one measurement; leave out --project, and copy the "
                    "shape into the sample file of the project."
                )
            raise typer.Exit(run_init_project(data, out, given, stated, options, force, quiet))
        out = out or Path("sample.toml")
        shaped = colour_from_reflectance
        raise typer.Exit(run_init(data, out, given, stated, options, force, quiet, shaped))
