"""Commands that use a fitted ink: ``predict``, ``colour``, ``export``, ``render``, ``boundary``."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jaxink.cli.options import (
    AS_IN_FILE,
    DATA_HELP,
    Debug,
    OfMeasurement,
    Quiet,
    Reading,
    output_of,
    with_reading,
)
from jaxink.cli.session import CommandLine, one_sentence
from jaxink.solver import DEFAULT_ACCURACY

Format = Annotated[
    str,
    typer.Option(metavar="zemax|lighttools|speos|integra|radiance|mitsuba|csv|netcdf", help="Output format."),
]
Files = Annotated[Path, typer.Option(metavar="DIR", help="Folder for the files.")]
Name = Annotated[str, typer.Option(metavar="NAME", help="Prefix of the file names.")]
AllowLoss = Annotated[
    str,
    typer.Option(
        metavar="LOSS,...",
        help="What may be lost if the format cannot represent it: regular, beyond_critical, narrow_lobes, "
        "standard_errors, index_step.",
    ),
]
RegularBinDeg = Annotated[
    float | None,
    typer.Option(
        metavar="DEG",
        help="Spread the regular part over cones of this full width at half maximum.",
    ),
]
Basis = Annotated[str, typer.Option(metavar="klems|tensor_tree", help="Angular basis of Radiance files.")]


InterpolationError = Annotated[
    float,
    typer.Option(
        metavar="X",
        help="Largest error of linear interpolation, over the largest BSDF of an incidence, that leaving out "
        "angles may cause in Mitsuba's files.",
    ),
]


def choices_of(
    name: str, allow_loss: str, regular_bin_deg: float | None, basis: str, interpolation_error: float
) -> dict[str, Any]:
    """Fields of `ExportOptions`."""
    drop = tuple(loss.strip() for loss in allow_loss.split(",") if loss.strip())
    return {
        "name": name,
        "drop": drop,
        "regular_bin_deg": regular_bin_deg,
        "basis": basis,
        "interpolation_error": interpolation_error,
    }


def given_of(choices: dict[str, Any], name: str, quiet: bool, debug: bool) -> dict[str, Any]:
    """Options of `_choices` as they are typed; ``name`` is the default of the name."""
    return {
        "--name": choices["name"] if choices["name"] != name else None,
        "--allow-loss": ",".join(choices["drop"]) or None,
        "--regular-bin-deg": choices["regular_bin_deg"],
        "--basis": choices["basis"] if choices["basis"] != "klems" else None,
        "--interpolation-error": error if (error := choices["interpolation_error"]) != 0.005 else None,
        "--quiet": quiet,
        "--debug": debug,
    }


@with_reading
def predict(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT_OR_SAMPLE",
            help="Folder or result.json of a fit, the folder of a joint fit, or a sample or project file "
            "(.toml).",
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(
            metavar="FILE",
            help="File for the prediction: .csv or .nc; a folder for all measurements of a joint fit or "
            "project.",
        ),
    ],
    data: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="DATA",
            help=f"Measurement whose rows are predicted: {DATA_HELP} A result has its own.",
        ),
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Another value of a parameter, such as ink.thickness_um=60 (or 'ink.thickness_um=0.06 mm'); "
            "repeat the option for several.",
        ),
    ] = None,
    accuracy: Annotated[
        float | None,
        typer.Option(
            metavar="X",
            help="Largest relative error of the BSDF that the discretisation may cause; by default the "
            f"resolution of the result, or {DEFAULT_ACCURACY:g} for a sample file.",
        ),
    ] = None,
    measurement: OfMeasurement = None,
    reading: Reading = AS_IN_FILE,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Predict the BSDF of a fitted or described sample for every row of a measurement."""
    with one_sentence(debug):
        from jaxink.cli.joint_predict import run_joint_predict
        from jaxink.cli.one_measurement import is_of_many, of_measurement
        from jaxink.cli.predict import run_predict

        settings = set_ or ()
        if measurement is None and not data and is_of_many(source):
            raise typer.Exit(run_joint_predict(source, out, accuracy, settings, quiet))
        source = of_measurement(source, measurement)
        raise typer.Exit(run_predict(source, data or (), out, accuracy, reading.keywords(), quiet, settings))


def colour(
    source: Annotated[Path, typer.Argument(metavar="RESULT", help="Folder of a fit of several wavelengths.")],
    geometry: Annotated[
        list[str] | None,
        typer.Option(
            metavar="45:0|8:di|...",
            help="Illumination and view: 45:0, 0:45, 8:di, 8:de, di:8, de:8, a quantity of readings, or "
            "angles such as 30:15; repeat it for several. By default 45:0, 8:di and 8:de.",
        ),
    ] = None,
    illuminant: Annotated[
        str,
        typer.Option(
            metavar="D65|D50|A|E|FILE.csv", help="Light; a file has the columns wavelength_nm and power."
        ),
    ] = "D65",
    observer: Annotated[int, typer.Option(metavar="2|10", help="Standard observer, in degrees.")] = 2,
    thickness_um: Annotated[
        float | None, typer.Option(metavar="UM", help="Another thickness of the ink, in um.")
    ] = None,
    over: Annotated[
        str | None,
        typer.Option(
            metavar="R|nothing|FILE.csv",
            help="What is behind the sample: a reflectance, nothing, or a file with the columns "
            "wavelength_nm and reflectance.",
        ),
    ] = None,
    contact: Annotated[
        bool, typer.Option("--contact", help="The card is in optical contact with the last layer.")
    ] = False,
    lit_from: Annotated[
        str,
        typer.Option(metavar="front|back", help="Side that is lit: as measured, or the other."),
    ] = "front",
    free: Annotated[bool, typer.Option("--free", help="The ink alone, without its clear layers.")] = False,
    layer: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The ink whose thickness is given."),
    ] = None,
    measurement: OfMeasurement = None,
    json: Annotated[bool, typer.Option("--json", help="Print the colours as JSON.")] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Print the CIE colours of a fitted ink, as measured or in another arrangement."""
    with one_sentence(debug):
        from jaxink.cli.colour import ArrangementOptions, run_colour
        from jaxink.cli.one_measurement import of_measurement

        source = of_measurement(source, measurement)
        options = ArrangementOptions(thickness_um, over, contact, lit_from, free, layer)
        raise typer.Exit(
            run_colour(source, geometry or [], illuminant, observer, options, output_of(json, quiet))
        )


def export(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT",
            help="Folder of a fit, a joint fit or a diagnosis, a sample file (.toml), or an ink table "
            "written by jaxink (.nc).",
        ),
    ],
    format: Format,
    out: Files,
    layer: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Layer that is the ink; repeat the option for several layers."),
    ] = None,
    seen_from: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="LAYER",
            help="Layer that the ink is seen from, usually its plate; front or back for the surroundings.",
        ),
    ] = None,
    n_theta: Annotated[
        int | None,
        typer.Option(metavar="N", help="Number of polar angles; by default 61 to 181, as the ink needs."),
    ] = None,
    n_phi: Annotated[
        int | None,
        typer.Option(metavar="N", help="Number of azimuths; by default 37 to 91, as the ink needs."),
    ] = None,
    what: Annotated[
        str,
        typer.Option(
            "--as",
            metavar="surface|volume",
            help="The ink as a surface with its BSDF, or as a volume that scatters; a volume also for "
            "tracepro, fred and asap.",
        ),
    ] = "surface",
    name: Name = "ink",
    measurement: OfMeasurement = None,
    allow_loss: AllowLoss = "",
    regular_bin_deg: RegularBinDeg = None,
    basis: Basis = "klems",
    interpolation_error: InterpolationError = 0.005,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Write the BSDF of a fitted ink, as seen from inside its plate, for a ray tracer."""
    with one_sentence(debug):
        from jaxink.cli.export import Target, run_export
        from jaxink.cli.one_measurement import of_measurement
        from jaxink.errors import require_one_of

        source = of_measurement(source, measurement)

        require_one_of("--as", what, ("surface", "volume"))
        if what == "volume":
            from jaxink.cli.export_volume import run_volume

            raise typer.Exit(run_volume(source, layer or (), seen_from, format, out, name, quiet))
        choices = choices_of(name, allow_loss, regular_bin_deg, basis, interpolation_error)
        sampling = {"inside": seen_from, "n_theta": n_theta, "n_phi": n_phi}
        given = {
            "--format": format,
            "--out": out,
            "--layer": layer,
            "--from": seen_from,
            "--n-theta": n_theta,
            "--n-phi": n_phi,
            **given_of(choices, "ink", quiet, debug),
        }
        target = Target(format, out, choices, quiet, CommandLine("export", [source], given))
        raise typer.Exit(run_export(source, layer or (), sampling, target))


def render(
    source: Annotated[
        Path,
        typer.Argument(metavar="RESULT", help="Folder of a fit or of a diagnosis, or a sample file (.toml)."),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the picture and the numbers.")],
    scene: Annotated[
        str,
        typer.Option(
            metavar="lightguide|booth|sphere|plate|torus",
            help="Scene: an edge-lit plate with printed dots; or a sphere, a flat disc or a torus of printed "
            "plate in a light booth, which needs mitsuba; booth: all three.",
        ),
    ] = "lightguide",
    uncorrected: Annotated[
        Path | None,
        typer.Option(
            metavar="RESULT",
            help="The same ink by a model that lacks something, such as the fit before a diagnosis; it is "
            "rendered as a sheet beside the ink.",
        ),
    ] = None,
    layer: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Layer that is the ink; repeat the option for several layers."),
    ] = None,
    seen_from: Annotated[
        str | None,
        typer.Option("--from", metavar="LAYER", help="Layer that the ink is seen from, usually its plate."),
    ] = None,
    plate_index: Annotated[
        float | None,
        typer.Option(
            metavar="N",
            help="Refractive index of the plate, on which the ink is in optical contact; by default that of "
            "the medium that it is seen from.",
        ),
    ] = None,
    ink_alone: Annotated[
        bool,
        typer.Option(
            "--ink-alone",
            help="Leave out the effects of the sample, such as air between plate and ink.",
        ),
    ] = False,
    volume: Annotated[
        bool, typer.Option("--volume/--no-volume", help="Also trace every scattering within the ink.")
    ] = True,
    batches: Annotated[
        int, typer.Option(metavar="N", help="Number of independent batches, for standard errors.")
    ] = 8,
    paths: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Paths of a batch: from each bin of the light guide's exit face (60), or from the centre of "
            "the body in the booth (16000).",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the random numbers.")] = 0,
    measurement: OfMeasurement = None,
    json: Annotated[bool, typer.Option("--json", help="Print render.json instead of the tables.")] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Render a fitted ink in a scene; a stopped rendering goes on where it was."""
    with one_sentence(debug):
        from jaxink.cli.one_measurement import of_measurement
        from jaxink.cli.render import run_render

        source = of_measurement(source, measurement)
        effort = {"batches": batches, "seed": seed} | ({} if paths is None else {"paths": paths})
        given = (
            layer or (),
            seen_from,
            plate_index,
            ink_alone,
            uncorrected,
            effort,
            volume,
            output_of(json, quiet),
        )
        raise typer.Exit(run_render(source, scene, out, *given))


def boundary(
    source: Annotated[
        Path, typer.Argument(metavar="SURFACE.toml", help="Description of the surface and its media.")
    ],
    format: Format,
    out: Files,
    name: Name = "boundary",
    n_theta: Annotated[int, typer.Option(metavar="N", help="Number of polar angles.")] = 91,
    n_phi: Annotated[int, typer.Option(metavar="N", help="Number of azimuths.")] = 73,
    limit_power: Annotated[
        bool,
        typer.Option(
            "--limit-power",
            help="Scale down directions that would send out more power than arrives; keeps reciprocity.",
        ),
    ] = False,
    allow_loss: AllowLoss = "",
    regular_bin_deg: RegularBinDeg = None,
    basis: Basis = "klems",
    interpolation_error: InterpolationError = 0.005,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Write the BSDF of a rough boundary between two clear media for a ray tracer."""
    with one_sentence(debug):
        from jaxink.cli.export import Target, run_boundary

        sampling = {"n_theta": n_theta, "n_phi": n_phi, "limit_power": limit_power}
        choices = choices_of(name, allow_loss, regular_bin_deg, basis, interpolation_error)
        given = {
            "--format": format,
            "--out": out,
            "--n-theta": n_theta,
            "--n-phi": n_phi,
            "--limit-power": limit_power,
            **given_of(choices, "boundary", quiet, debug),
        }
        target = Target(format, out, choices, quiet, CommandLine("boundary", [source], given))
        raise typer.Exit(run_boundary(source, sampling, target))
