"""Commands that fit: ``jaxink fit``, ``diagnose``, ``batch`` and ``plan``."""

from pathlib import Path
from typing import Annotated

import typer

from jaxink.cli.options import (
    AS_IN_FILE,
    Accuracy,
    Debug,
    FitData,
    NoFigures,
    NotWavelengths,
    Quiet,
    Reading,
    is_toml,
    output_of,
    refuse_wavelengths,
    simplex_steps,
    stated_sample,
    with_reading,
)
from jaxink.cli.session import one_sentence
from jaxink.solver import DEFAULT_ACCURACY


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
        float | None,
        typer.Option(
            metavar="S",
            help="Longest run time of all searches, without compilation and without tests of the input.",
        ),
    ] = None,
    goal: Annotated[
        float | None,
        typer.Option(
            metavar="X",
            help="RMSD of the objective at which to stop; for chi_square in standard deviations of noise.",
        ),
    ] = None,
    simplex_step: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=STEP",
            help="With --method simplex, how far its first corner along a parameter is from the start, in "
            "the parameter's unit, such as ink.scattering_per_mm=10; repeat the option for several.",
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
    input_check: Annotated[
        bool,
        typer.Option(
            "--input-check/--no-input-check",
            help="Test mistakes in the input if the fit misses the noise, by one refit for each; this may "
            "take longer than the fit.",
        ),
    ] = True,
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
            "simplex_steps": simplex_steps(simplex_step),
            "seed": seed,
            "profile": profile,
            "accuracy": accuracy,
            "layer_method": layer_method,
        }
        formats = () if no_figures else ("png", "pdf") if pdf else ("png",)
        output = output_of(json, quiet)
        stated = reading.keywords()
        if is_toml(data):
            from jaxink.cli.joint_fit import require_project_alone, run_joint_fit

            project = require_project_alone(data, stated, sample)
            raise typer.Exit(run_joint_fit(project, out, options, formats, output))
        from jaxink.cli.fit import run_fit

        raise typer.Exit(
            run_fit(
                data, stated_sample(sample), out, options, stated, formats, output, figures_at, input_check
            )
        )


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
        output = output_of(json, quiet)
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
        raise typer.Exit(run_batch(plan, out, where, retry, output_of(json, quiet)))


def plan(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT",
            help="Folder of a fit, of a joint fit or of a diagnosis; or a project file, to be fitted first.",
        ),
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

        raise typer.Exit(run_plan(source, target or (), readings, out, seed, output_of(json, quiet)))
