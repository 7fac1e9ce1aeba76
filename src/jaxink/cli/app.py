"""Arguments and options of the commands."""

import gc
from pathlib import Path
from typing import Annotated

import typer

from jaxink.cli.convert_command import convert
from jaxink.cli.export_options import (
    AllowLoss,
    Basis,
    Files,
    Format,
    InterpolationError,
    Name,
    RegularBinDeg,
    choices_of,
    given_of,
)
from jaxink.cli.reading_options import (
    AS_IN_FILE,
    DATA_HELP,
    Data,
    Debug,
    FitData,
    NotWavelengths,
    Quiet,
    Reading,
    is_toml,
    refuse_wavelengths,
    stated_sample,
    with_reading,
)
from jaxink.cli.session import CommandLine, draw_to_files, one_sentence, silence_xla
from jaxink.errors import InputRefusedError
from jaxink.files.version import installed_version
from jaxink.solver.accuracy import DEFAULT_ACCURACY

app = typer.Typer(
    name="jaxink",
    help="Optical properties of printed and painted inks from goniometer BSDF measurements.",
    epilog="Exit codes: 0 fitted, 3 unexplained misfit, 4 did not converge, 5 invalid input, "
    "6 ended by its time limit or a lost scheduler, 2 unknown option, 1 anything else.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """Run the command ``jaxink`` in a process of its own."""
    silence_xla()
    draw_to_files()
    # Tracing makes millions of objects, few of them garbage; full collections would take seconds.
    gc.set_threshold(100_000, 20, 100)
    app()


def _version(wanted: bool) -> bool:
    if wanted:
        typer.echo(f"jaxink {installed_version()}")
        raise typer.Exit
    return wanted


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


SampleFile = Annotated[Path, typer.Option(metavar="SAMPLE.toml", help="Description of the sample.")]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Draw no figures.")]
Accuracy = Annotated[
    float,
    typer.Option(metavar="X", help="Largest relative error of the BSDF that the discretisation may cause."),
]


def _output(json: bool, quiet: bool) -> str:
    return "json" if json else "quiet" if quiet else "tables"


@app.command()
@with_reading
def fit(
    data: FitData,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for report.html, result.json, result.nc and figures.")
    ],
    sample: Annotated[
        Path | None,
        typer.Option(metavar="SAMPLE.toml", help="Description of the sample; a project has its own."),
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            metavar="gradient|simplex|...",
            help="Gradient-based search, Nelder-Mead simplex, or others for comparison "
            "(docs/manual/result.md).",
        ),
    ] = "gradient",
    objective: Annotated[
        str,
        typer.Option(
            metavar="chi_square|absolute|relative|logarithmic|intensity|photometric",
            help="Objective to minimise.",
        ),
    ] = "chi_square",
    starts: Annotated[
        int,
        typer.Option(
            metavar="N",
            help="Number of starts: the sample file's values, then random ones. The result tells how many "
            "of them end in which minimum.",
        ),
    ] = 1,
    scan: Annotated[
        bool | None,
        typer.Option(
            "--scan/--no-scan",
            help="Scan the radius of particles first; by default before the gradient-based search only.",
        ),
    ] = None,
    max_steps: Annotated[
        int | None, typer.Option(metavar="N", help="Largest number of steps of each search.")
    ] = None,
    max_evaluations: Annotated[
        int | None,
        typer.Option(metavar="N", help="Largest number of evaluations of the model by all searches."),
    ] = None,
    max_seconds: Annotated[
        float | None, typer.Option(metavar="S", help="Longest run time of all searches, without compilation.")
    ] = None,
    goal: Annotated[
        float | None,
        typer.Option(
            metavar="X",
            help="RMSD of the objective at which to stop; for chi_square in standard deviations of noise.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the random starts.")] = 0,
    profile: Annotated[
        str,
        typer.Option(
            metavar="auto|all|none",
            help="Profile likelihoods of weak (at most 6), all or no parameters.",
        ),
    ] = "auto",
    accuracy: Accuracy = DEFAULT_ACCURACY,
    layer_method: Annotated[
        str,
        typer.Option(
            metavar="fastest|discrete_ordinates|adding_doubling",
            help="Method that computes the response of a layer.",
        ),
    ] = "fastest",
    reading: Reading = AS_IN_FILE,
    no_figures: NoFigures = False,
    figures_at: Annotated[
        list[float] | None,
        typer.Option(
            metavar="NM",
            help="Wavelength whose scans are drawn; repeat the option for several. By default all, of more "
            "than three the three that are fitted worst.",
        ),
    ] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Also write the figures as PDF.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print result.json instead of the tables.")] = False,
    quiet: Quiet = False,
    wavelengths: NotWavelengths = None,
    debug: Debug = False,
) -> None:
    """Fit the free parameters of a sample to a measurement, or those of a project to all its measurements."""
    with one_sentence(debug):
        refuse_wavelengths(wavelengths)

        options = {
            "method": method,
            "objective": objective,
            "starts": starts,
            "scan": scan,
            "max_steps": max_steps,
            "max_evaluations": max_evaluations,
            "max_seconds": max_seconds,
            "goal": goal,
            "seed": seed,
            "profile": profile,
            "accuracy": accuracy,
            "layer_method": layer_method,
        }
        formats = () if no_figures else ("png", "pdf") if pdf else ("png",)
        output = _output(json, quiet)
        stated = reading.keywords()
        if is_toml(data):
            from jaxink.cli.joint_fit import require_project_alone, run_joint_fit

            project = require_project_alone(data, stated, sample)
            raise typer.Exit(run_joint_fit(project, out, options, formats, output))
        from jaxink.cli.fit import run_fit

        raise typer.Exit(
            run_fit(data, stated_sample(sample), out, options, stated, formats, output, figures_at)
        )


app.command()(convert)


@app.command()
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
        from jaxink.measurement.columns import option_words

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


@app.command()
@with_reading
def diagnose(
    data: FitData,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for report.html, report.json and figures.")
    ],
    sample: Annotated[
        Path | None,
        typer.Option(metavar="SAMPLE.toml", help="Description of the sample; required but for a project."),
    ] = None,
    max_effects: Annotated[int, typer.Option(metavar="N", help="Largest number of effects to add.")] = 3,
    max_parameters: Annotated[
        int | None,
        typer.Option(metavar="N", help="Largest number of free parameters; unlimited by default."),
    ] = None,
    level: Annotated[
        float, typer.Option(metavar="X", help="Family-wise significance level of the screen.")
    ] = 0.05,
    bootstrap: Annotated[
        int, typer.Option(metavar="N", help="Number of simulated null data sets (noise only).")
    ] = 2000,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of these data sets.")] = 20260,
    time_limit: Annotated[
        float | None,
        typer.Option(metavar="S", help="Seconds after which to end with the best verdict so far."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on where a diagnosis with the same --out was stopped.")
    ] = False,
    accuracy: Accuracy = DEFAULT_ACCURACY,
    reading: Reading = AS_IN_FILE,
    no_figures: NoFigures = False,
    json: Annotated[bool, typer.Option("--json", help="Print report.json instead of the tables.")] = False,
    quiet: Quiet = False,
    wavelengths: NotWavelengths = None,
    debug: Debug = False,
) -> None:
    """Find the effects that the model lacks, add them, and report the error before and after."""
    with one_sentence(debug):
        refuse_wavelengths(wavelengths)
        limits = {"max_effects": max_effects, "max_parameters": max_parameters}
        choices = limits | {"level": level, "n_bootstrap": bootstrap, "seed": seed}
        choices |= {"time_limit_s": time_limit}
        output = _output(json, quiet)
        if is_toml(data):
            from jaxink.cli.joint_diagnose import require_searches_in_one_go, run_joint_diagnose
            from jaxink.cli.joint_fit import require_project_alone

            require_searches_in_one_go(choices, resume)
            project = require_project_alone(data, reading.keywords(), sample)
            whole = project, out, choices, accuracy, not no_figures, output
            raise typer.Exit(run_joint_diagnose(*whole))
        from jaxink.cli.diagnose import run_diagnose

        arguments = (
            data,
            stated_sample(sample),
            out,
            choices,
            accuracy,
            reading.keywords(),
            not no_figures,
            output,
        )
        raise typer.Exit(run_diagnose(*arguments, is_resumed=resume))


@app.command()
def batch(
    plan: Annotated[Path, typer.Argument(metavar="PLAN.toml", help="Which measurements, and what to do.")],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for the results, summary.csv and report.html.")
    ],
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Processes on this machine; by default one for each core; 0: none, one after the other.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Dask scheduler whose workers do the work instead."),
    ] = None,
    devices: Annotated[
        str,
        typer.Option(metavar="0,1,...", help="Graphics processors that the workers here share out."),
    ] = "",
    retry: Annotated[
        bool, typer.Option("--retry", help="Do again what was ended by a limit or failed unexpectedly.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Fit or diagnose many measurements on many processes; a stopped batch goes on where it was."""
    with one_sentence(debug):
        from jaxink.cli.batch import run_batch

        named = [name.strip() for name in devices.split(",") if name.strip()]
        where = {"workers": workers, "scheduler": scheduler, "devices": named}
        raise typer.Exit(run_batch(plan, out, where, retry, _output(json, quiet)))


@app.command()
def plan(
    source: Annotated[
        Path,
        typer.Argument(metavar="RESULT", help="Folder of a fit, of a joint fit or of a diagnosis."),
    ],
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Parameter that is to be determined; repeat for several. By default all."
        ),
    ] = None,
    readings: Annotated[
        int, typer.Option(metavar="N", help="Number of readings of each further measurement.")
    ] = 100,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="NEXT.toml",
            help="Project file with the first of them; its empty table is written beside it.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the simulated fits.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print the plan as JSON.")] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Say which further measurement would settle what a fit leaves open."""
    with one_sentence(debug):
        from jaxink.cli.plan import run_plan

        raise typer.Exit(run_plan(source, target or (), readings, out, seed, _output(json, quiet)))


@app.command()
@with_reading
def predict(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT_OR_SAMPLE", help="Folder or result.json of a fit, or a sample file (.toml)."
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="File for the prediction: .csv or .nc.")],
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
    reading: Reading = AS_IN_FILE,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Predict the BSDF of a fitted or described sample for every row of a measurement."""
    with one_sentence(debug):
        from jaxink.cli.predict import run_predict

        stated = reading.keywords()
        raise typer.Exit(run_predict(source, data or (), out, accuracy, stated, quiet, set_ or ()))


@app.command()
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
    json: Annotated[bool, typer.Option("--json", help="Print the colours as JSON.")] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Print the CIE colours of a fitted ink, as measured or in another arrangement."""
    with one_sentence(debug):
        from jaxink.cli.colour import ArrangementOptions, run_colour

        options = ArrangementOptions(thickness_um, over, contact, lit_from, free, layer)
        raise typer.Exit(
            run_colour(source, geometry or [], illuminant, observer, options, _output(json, quiet))
        )


@app.command()
def export(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT",
            help="Folder of a fit or of a diagnosis, or an ink table written by jaxink (.nc).",
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
        from jaxink.errors import require_one_of

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


@app.command()
def render(
    source: Annotated[
        Path,
        typer.Argument(metavar="RESULT", help="Folder of a fit or of a diagnosis, or a sample file (.toml)."),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the picture and the numbers.")],
    scene: Annotated[
        str, typer.Option(metavar="lightguide", help="Scene: an edge-lit plate with printed dots.")
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
        int, typer.Option(metavar="N", help="Paths of a batch from each of the bins of the exit face.")
    ] = 60,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the random numbers.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print render.json instead of the tables.")] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Render a fitted ink in a scene; a stopped rendering goes on where it was."""
    with one_sentence(debug):
        from jaxink.cli.render import run_render

        effort = {"batches": batches, "paths": paths, "seed": seed}
        given = (
            layer or (),
            seen_from,
            plate_index,
            ink_alone,
            uncorrected,
            effort,
            volume,
            _output(json, quiet),
        )
        raise typer.Exit(run_render(source, scene, out, *given))


@app.command()
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


@app.command()
def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for all files.")] = Path("jaxink-demo"),
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Show the whole way on an embedded simulated measurement: fit, diagnosis, corrected model, export."""
    with one_sentence(debug):
        from jaxink.cli.demo import run_demo

        raise typer.Exit(run_demo(out, () if no_figures else ("png",), quiet))


@app.command()
def materials(debug: Debug = False) -> None:
    """List the pigments and binders whose complex index a sample file can name."""
    with one_sentence(debug):
        from jaxink.materials import listing

        typer.echo(listing())


@app.command()
def cache(
    action: Annotated[str, typer.Argument(metavar="info|clear", help="What to do.")] = "info",
    debug: Debug = False,
) -> None:
    """Show or empty the store of compiled programs, which makes the next command start faster."""
    with one_sentence(debug):
        from jaxink.cli.cache import run_cache

        raise typer.Exit(run_cache(action))
