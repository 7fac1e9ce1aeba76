"""Arguments and options of ``jaxink convert``."""

from pathlib import Path
from typing import Annotated

import typer

from jaxink.cli.reading_options import AS_IN_FILE, Data, Debug, Quiet, Reading, with_reading
from jaxink.cli.session import one_sentence


@with_reading
def convert(
    data: Data,
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="The CSV file to write.")],
    reading: Reading = AS_IN_FILE,
    face: Annotated[
        str | None,
        typer.Option(metavar="front|back", help="Face that the light meets, if the file has both."),
    ] = None,
    channel: Annotated[
        str | None, typer.Option(metavar="NAME", help="Channel to read, if the values are colours.")
    ] = None,
    rotation_deg: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Rotation of the sample to read, if the file has several."),
    ] = None,
    angle_unit: Annotated[
        str | None, typer.Option(metavar="deg|rad", help="Unit of the angles, if it is not clear.")
    ] = None,
    specular_phi_deg: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Azimuth of the specular or undeviated direction in the file."),
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option(metavar="X", help="Factor that makes the values BSDFs, if the file states no scale."),
    ] = None,
    every: Annotated[
        int | None, typer.Option(metavar="N", help="Read every N-th angle of the axes of a dense table.")
    ] = None,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Write files of instruments and ray tracers as one tidy CSV file (docs/manual/formats-in.md)."""
    with one_sentence(debug):
        from jaxink.cli.convert import run_convert

        stated = {
            "face": face,
            "channel": channel,
            "rotation_deg": rotation_deg,
            "angle_unit": angle_unit,
            "specular_phi_deg": specular_phi_deg,
            "scale": scale,
            "every": every,
        }
        stated = {name: value for name, value in stated.items() if value is not None}
        raise typer.Exit(run_convert(data, out, stated | reading.keywords(), quiet))
