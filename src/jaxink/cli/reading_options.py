"""Arguments and options that several commands share, most of them those that read a measurement."""

import shlex
from pathlib import Path
from typing import Annotated, Any

import typer

from jaxink.errors import InputRefusedError

DATA_HELP = (
    "CSV, workbook (.xlsx, .ods), netCDF written by jaxink, or a file of an instrument or ray tracer "
    "(docs/formats-in.md); several files are joined."
)
Data = Annotated[list[Path], typer.Argument(metavar="DATA", help=f"Measurement: {DATA_HELP}")]
WavelengthNm = Annotated[
    float | None,
    typer.Option(metavar="NM", help="Wavelength of every row, if the file has no column for it."),
]
Side = Annotated[
    str | None,
    typer.Option(
        metavar="R|T",
        help="Side of every row, if the file has no column for it; R,T for two files, one of each side.",
    ),
]
Sheet = Annotated[
    str | None,
    typer.Option(
        metavar="NAME[=R|T],...",
        help="Sheet of a workbook, if several are not empty, or several that are joined: R,T or A=R,B=T.",
    ),
]
ThetaIDeg = Annotated[
    str | None,
    typer.Option(
        metavar="DEG", help="Angle of incidence of every row, if no column has it; for several files 0,30,60."
    ),
]
PhiDeg = Annotated[
    float | None,
    typer.Option(metavar="DEG", help="Relative azimuth of every row, if the file has no column for it."),
]
PhiODeg = Annotated[
    float | None,
    typer.Option(metavar="DEG", help="Azimuth of view of every row, if the file has only that of incidence."),
]
Matrix = Annotated[
    str | None,
    typer.Option(
        metavar="DOWN,ALONG",
        help="Edges of a matrix of values that does not name them, such as theta_o_deg,theta_i_deg.",
    ),
]
SignedAngles = Annotated[
    bool,
    typer.Option(
        "--signed-angles",
        help="A negative theta_o_deg means the other half-plane (without phi_deg, that of the source).",
    ),
]
CosineWeighted = Annotated[
    bool | None,
    typer.Option(
        "--cosine-weighted/--no-cosine-weighted",
        help="Whether the values are the BSDF times cos(theta_o), by which they are then divided.",
    ),
]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=HEADER",
        help="Header of a column that has another name, such as theta_o_deg=arm; once for each column.",
    ),
]
Which = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Sample to read, if the column `sample` of the file has several."),
]
# Of `jaxink init`; hidden where a sample file chooses the wavelengths.
NotWavelengths = Annotated[str | None, typer.Option("--wavelengths", hidden=True)]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an unexpected error.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only error messages.")]


def columns_of(
    wavelength_nm: float | None,
    side: str | None,
    which: str | None,
    signed_angles: bool,
    cosine_weighted: bool | None,
    angles: tuple[str | None, float | None, float | None],
    layout: tuple[str | None, list[str] | None, str | None],
) -> dict[str, Any]:
    """Keywords of `jaxink.read` for what the files do not state.

    ``angles`` are theta_i_deg, phi_deg and phi_o_deg, ``layout`` the sheet, the columns and the edges of a
    matrix.
    """
    theta_i_deg, phi_deg, phi_o_deg = angles
    sheet, columns, matrix = layout
    sides = None if side is None else [each.strip() for each in side.split(",")]
    given: dict[str, Any] = {"wavelength_nm": wavelength_nm, "side": sides, "sample": which, "sheet": sheet}
    given |= {"signed_angles": signed_angles or None, "cosine_weighted": cosine_weighted}
    given["columns"] = _headers(columns) if columns else None
    given["theta_i_deg"] = numbers_of("--theta-i-deg", theta_i_deg)
    given |= {"phi_deg": phi_deg, "phi_o_deg": phi_o_deg, "matrix": matrix}
    return {name: value for name, value in given.items() if value is not None}


def refuse_wavelengths(given: str | None) -> None:
    """Say what chooses the wavelengths where ``--wavelengths`` does not."""
    if given is not None:
        raise InputRefusedError(
            "--wavelengths is an option of jaxink init; here wavelength_nm of the sample file chooses what "
            "is fitted: edit it, or write another by jaxink init --wavelengths "
            f"{shlex.quote(given)}."
        )


def numbers_of(option: str, text: str | None) -> list[float] | None:
    """Numbers separated by commas."""
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputRefusedError(
            f"{option} is {text!r}; it must be a number, or several with commas."
        ) from None


def _headers(columns: list[str]) -> dict[str, str]:
    """Header of each column, from ``NAME=HEADER``."""
    headers: dict[str, str] = {}
    for text in columns:
        name, equals, header = (part.strip() for part in text.partition("="))
        if not (name and equals and header):
            raise InputRefusedError(f"--columns is {text!r}; write NAME=HEADER, such as theta_o_deg=arm.")
        if name in headers:
            raise InputRefusedError(f"--columns names {name} twice; give one header for each column.")
        headers[name] = header
    return headers
