"""The command ``jaxink``."""

import gc
from pathlib import Path
from typing import Annotated

import typer

from jaxink.cli.fit_commands import batch, diagnose, fit, plan
from jaxink.cli.ink_commands import boundary, colour, export, predict, render
from jaxink.cli.measurement_commands import convert, init
from jaxink.cli.options import Debug, NoFigures, Quiet
from jaxink.cli.session import draw_to_files, one_sentence, silence_xla
from jaxink.files.version import installed_version

app = typer.Typer(
    name="jaxink",
    help="Optical properties of printed and painted inks from goniometer BSDF measurements.",
    epilog="Exit codes: 0 fitted, 3 unexplained misfit, 4 did not converge, 5 invalid input, "
    "6 ended by its time limit or a lost scheduler, 2 unknown option, 130 interrupted, 1 anything else.",
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


def materials(debug: Debug = False) -> None:
    """List the pigments and binders whose complex index a sample file can name."""
    with one_sentence(debug):
        from jaxink.materials import listing

        typer.echo(listing())


def cache(
    action: Annotated[str, typer.Argument(metavar="info|clear", help="What to do.")] = "info",
    debug: Debug = False,
) -> None:
    """Show or empty the store of compiled programs, which makes the next command start faster."""
    with one_sentence(debug):
        from jaxink.cli.cache import run_cache

        raise typer.Exit(run_cache(action))


# In the order of the help.
for command in (
    fit,
    convert,
    init,
    diagnose,
    batch,
    plan,
    predict,
    colour,
    export,
    render,
    boundary,
    demo,
    materials,
    cache,
):
    app.command()(command)
