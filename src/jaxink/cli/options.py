"""Arguments and options that several commands share, most of them those that read a measurement."""

import dataclasses
import functools
import inspect
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from jaxink.errors import InputRefusedError

DATA_HELP = (
    "CSV, workbook (.xlsx, .ods), netCDF written by jaxink, or a file of an instrument or ray tracer "
    "(docs/manual/formats-in.md); several files are joined."
)
Data = Annotated[list[Path], typer.Argument(metavar="DATA", help=f"Measurement: {DATA_HELP}")]
FitData = Annotated[
    list[Path],
    typer.Argument(
        metavar="DATA", help=f"Measurement: {DATA_HELP} Or a project file (.toml), without --sample."
    ),
]
# Of `jaxink init`; hidden where a sample file chooses the wavelengths.
NotWavelengths = Annotated[str | None, typer.Option("--wavelengths", hidden=True)]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an unexpected error.")]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Draw no figures.")]
Accuracy = Annotated[
    float,
    typer.Option(metavar="X", help="Largest relative error of the BSDF that the discretisation may cause."),
]
OfMeasurement = Annotated[
    str | None,
    typer.Option(
        "--measurement", metavar="NAME", help="Of a joint fit, the measurement whose sample is meant."
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only error messages.")]


def output_of(json: bool, quiet: bool) -> str:
    """What a command prints: ``tables``, ``json`` or ``quiet``."""
    return "json" if json else "quiet" if quiet else "tables"


def is_toml(files: Sequence[Path]) -> bool:
    """Whether the first of some files is a project file, which no measurement is."""
    return bool(files) and files[0].suffix.lower() == ".toml"


def stated_sample(sample: Path | None) -> Path:
    """The sample file of a command that needs one."""
    if sample is None:
        raise InputRefusedError(
            "--sample is missing; give the description of the sample, which `jaxink init` writes, or a "
            "project file instead of the measurement."
        )
    return sample


# An option that states of a measurement what its files do not.
_stated = functools.partial(typer.Option, rich_help_panel="What the files do not state")


@dataclasses.dataclass(frozen=True)
class Reading:
    """What the user states of a measurement that its files do not; each field is an option."""

    wavelength_nm: Annotated[
        float | None,
        _stated(metavar="NM", help="Wavelength of every row, if the file has no column for it."),
    ] = None
    side: Annotated[
        str | None,
        _stated(
            metavar="R|T",
            help="Side of every row, if the file has no column for it; R,T for two files, one of each side.",
        ),
    ] = None
    which: Annotated[
        str | None,
        _stated(metavar="NAME", help="Sample to read, if the column `sample` of the file has several."),
    ] = None
    sheet: Annotated[
        str | None,
        _stated(
            metavar="NAME[=R|T],...",
            help="Sheet of a workbook, if several are not empty, or several that are joined: R,T or A=R,B=T.",
        ),
    ] = None
    signed_angles: Annotated[
        bool,
        _stated(
            "--signed-angles",
            help="A negative theta_o_deg means the other half-plane (without phi_deg, that of the source).",
        ),
    ] = False
    cosine_weighted: Annotated[
        bool | None,
        _stated(
            "--cosine-weighted/--no-cosine-weighted",
            help="Whether the values are the BSDF times cos(theta_o), by which they are then divided.",
        ),
    ] = None
    columns: Annotated[
        list[str] | None,
        _stated(
            metavar="NAME=HEADER",
            help="Header of a column that has another name, such as theta_o_deg=arm; once for each column.",
        ),
    ] = None
    rows: Annotated[
        list[str] | None,
        _stated(
            metavar="COLUMN=VALUE",
            help="Rows to read, of a file with several conditions, such as lit_side=ink; once for each.",
        ),
    ] = None
    theta_i_deg: Annotated[
        str | None,
        _stated(
            metavar="DEG",
            help="Angle of incidence of every row, if no column has it; for several files 0,30,60.",
        ),
    ] = None
    phi_deg: Annotated[
        float | None,
        _stated(metavar="DEG", help="Relative azimuth of every row, if the file has no column for it."),
    ] = None
    phi_o_deg: Annotated[
        float | None,
        _stated(metavar="DEG", help="Azimuth of view of every row, if the file has only that of incidence."),
    ] = None
    matrix: Annotated[
        str | None,
        _stated(
            metavar="DOWN,ALONG",
            help="Edges of a matrix of values that does not name them, such as theta_o_deg,theta_i_deg.",
        ),
    ] = None
    face: Annotated[
        str | None,
        _stated(metavar="front|back", help="Face that the light meets, if the file has both."),
    ] = None
    channel: Annotated[
        str | None, _stated(metavar="NAME", help="Channel to read, if the values are colours.")
    ] = None
    rotation_deg: Annotated[
        float | None,
        _stated(metavar="DEG", help="Rotation of the sample to read, if the file has several."),
    ] = None
    angle_unit: Annotated[
        str | None, _stated(metavar="deg|rad", help="Unit of the angles, if it is not clear.")
    ] = None
    specular_phi_deg: Annotated[
        float | None,
        _stated(metavar="DEG", help="Azimuth of the specular or undeviated direction in the file."),
    ] = None
    scale: Annotated[
        float | None,
        _stated(metavar="X", help="Factor that makes the values BSDFs, if the file states no scale."),
    ] = None
    every: Annotated[
        int | None, _stated(metavar="N", help="Read every N-th angle of the axes of a dense table.")
    ] = None

    def keywords(self) -> dict[str, Any]:
        """Keywords of `jaxink.read`.

        Raises
        ------
        InputRefusedError
            If an option has another form.
        """
        sides = None if self.side is None else [each.strip() for each in self.side.split(",")]
        given: dict[str, Any] = {"wavelength_nm": self.wavelength_nm, "side": sides, "sample": self.which}
        given |= {"sheet": self.sheet, "signed_angles": self.signed_angles or None}
        given |= {"cosine_weighted": self.cosine_weighted}
        given["columns"] = _pairs("--columns", self.columns, "NAME=HEADER", "theta_o_deg=arm")
        given["rows"] = _pairs("--rows", self.rows, "COLUMN=VALUE", "lit_side=ink")
        given["theta_i_deg"] = numbers_of("--theta-i-deg", self.theta_i_deg)
        as_given = ("phi_deg", "phi_o_deg", "matrix", "face", "channel", "rotation_deg", "angle_unit")
        for name in (*as_given, "specular_phi_deg", "scale", "every"):
            given[name] = getattr(self, name)
        return {name: value for name, value in given.items() if value is not None}


AS_IN_FILE = Reading()


def with_reading(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the fields of `Reading` as options, in the place of its parameter ``reading``."""
    hints = get_type_hints(Reading, include_extras=True)
    options = [
        inspect.Parameter(
            field.name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=hints[field.name]
        )
        for field in dataclasses.fields(Reading)
    ]
    parameters: list[inspect.Parameter] = []
    for own in inspect.signature(command).parameters.values():
        parameters += options if own.name == "reading" else [own.replace(kind=own.KEYWORD_ONLY)]

    @functools.wraps(command)
    def with_options(**given: Any) -> None:
        stated = {option.name: given.pop(option.name) for option in options}
        command(**given, reading=Reading(**stated))

    # Typer reads both.
    with_options.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    with_options.__annotations__ = {one.name: one.annotation for one in parameters}
    return with_options


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


def simplex_steps(given: list[str] | None) -> dict[str, float] | None:
    """Steps by name, each as ``NAME=STEP``; None if none is given."""
    example = "ink.scattering_per_mm=10"
    steps = _pairs("--simplex-step", given, "NAME=STEP", example)
    if steps is None:
        return None
    try:
        return {name: float(step) for name, step in steps.items()}
    except ValueError:
        words = " ".join(given or ())
        raise InputRefusedError(
            f"--simplex-step is '{words}'; the step must be a number, such as {example}."
        ) from None


def _pairs(option: str, given: list[str] | None, form: str, example: str) -> dict[str, str] | None:
    """What an option gives by name, each as ``NAME=VALUE``; None if it is not given."""
    if not given:
        return None
    found: dict[str, str] = {}
    for text in given:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise InputRefusedError(f"{option} is {text!r}; write {form}, such as {example}.")
        if name in found:
            raise InputRefusedError(f"{option} names {name} twice; give it once.")
        found[name] = value
    return found
