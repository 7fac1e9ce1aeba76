"""``jaxink render``."""

import math
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from jaxink.cli import session
from jaxink.cli.fit_tables import console
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.encoding import json_text
from jaxink.files.writing import require_folder, written_whole
from jaxink.numerics.digits import with_uncertainty

if TYPE_CHECKING:
    from jaxink.render import BoothRendering, GuideRendering, PrintedPlate

LIGHTGUIDE = "lightguide"
# Bodies in the light booth, as in `jaxink.render.BODIES`.
BODIES = "sphere", "plate", "torus"
# All of them, each in a folder of its own.
BOOTH = "booth"
SCENES = (LIGHTGUIDE, BOOTH, *BODIES)
NUMBERS = "render.json"


def run_render(
    source: Path,
    scene: str,
    out: Path,
    layers: Sequence[str],
    inside: str | None,
    plate_index: float | None,
    alone: bool,
    uncorrected: Path | None,
    effort: dict[str, int],
    with_volume: bool,
    output: str,
) -> ExitCode:
    """Render the ink of a result, or of a sample file, in a scene.

    Parameters
    ----------
    source, uncorrected
        Folders of results or sample files; the second one of a model that lacks something.
    scene
        One of `SCENES`.
    out
        Folder of the numbers, the picture and the batches; of the booth, with a folder for each body.
    layers, inside, plate_index, alone
        As for `jaxink.render.RenderedInk.of`, for the ink; the uncorrected one must be clear from its sample.
    effort
        Fields of `jaxink.render.Effort`, or of `jaxink.render.BoothEffort`.
    with_volume
        Whether to render the volume.
    output
        ``tables``, ``json`` or ``quiet``.
    """
    require_one_of("--scene", scene, SCENES)
    if scene != LIGHTGUIDE:
        for option, value in (("--plate-index", plate_index), ("--uncorrected", uncorrected)):
            if value is not None:
                raise InputRefusedError(
                    f"{option} {value} is for the light guide only; leave it out with --scene {scene}."
                )
    if scene == BOOTH and output == "json":
        bodies = f"{', '.join(BODIES[:-1])} or {BODIES[-1]}"
        raise InputRefusedError(f"--json prints the numbers of one body; give --scene {bodies}.")
    places = {body: out / body for body in BODIES} if scene == BOOTH else {scene: out}
    for place in places.values():
        require_folder(place)
    session.prepare_jax()
    chosen = list(layers) or None
    # One plate for all bodies: its tables take the longest of what comes before the paths.
    plate = cache(partial(_printed_plate, source, chosen, inside, alone))
    for name, place in places.items():
        picture = place / f"{name}.png"
        if name in BODIES:
            make = partial(_booth, plate, name, place, effort, with_volume)
        else:
            inks = (source, chosen, inside, plate_index, alone), uncorrected
            make = partial(_light_guide, *inks, place, effort, with_volume)
        _render_into(place, picture, make, output)
    return ExitCode.FITTED


def _render_into(out: Path, picture: Path, make: Callable[..., Any], output: str) -> None:
    """Render one scene with a display of its progress, and write and show its numbers."""
    from jaxink.numerics.progress import log_progress

    try:
        with session.progress(quiet=output != "tables") as following:
            numbers, show = make(follow=following or log_progress, picture=picture)
    except KeyboardInterrupt:
        typer.echo("jaxink: the finished batches are kept; go on with the same command.", err=True)
        raise
    with written_whole(out / NUMBERS) as file:
        file.write_text(json_text(numbers) + "\n", encoding="utf-8")
    if output == "json":
        typer.echo(json_text(numbers))
    elif output == "tables":
        show()
        console().print(f"\nWritten: {picture}, {out / NUMBERS}.", soft_wrap=True)


def _light_guide(given, uncorrected: Path | None, out: Path, effort, with_volume, follow, picture: Path):
    """Render it, write the picture, and return the numbers and what shows them."""
    from jaxink.render import Effort, RenderedInk, render_guide, save_guide_figure

    wanted, (*_, plate_index, alone) = Effort(**effort), given
    ink, other = RenderedInk.of(*given), None
    if uncorrected is not None:
        other = RenderedInk.of(uncorrected, None, None, plate_index, alone)
    found = render_guide(ink, out, None, other, wanted, with_volume, follow)
    save_guide_figure(found, picture)
    return found.to_dict(), lambda: _show(found)


def _printed_plate(source: Path, layers: list[str] | None, inside: str | None, alone: bool) -> "PrintedPlate":
    from jaxink.render import PrintedPlate, require_mitsuba

    # Before the tables are computed.
    require_mitsuba()
    return PrintedPlate.of(source, layers, inside, alone)


def _booth(
    plate: Callable[[], "PrintedPlate"], body: str, out: Path, effort, with_volume, follow, picture: Path
):
    """As `_light_guide`, for a body in the booth."""
    from jaxink.render import BODIES as KINDS
    from jaxink.render import Booth, BoothEffort, render_booth, save_booth_figure

    wanted, booth = BoothEffort(**effort), Booth(KINDS[body]())
    found = render_booth(plate(), out, booth, wanted, with_volume, follow)
    save_booth_figure(found, picture)
    return found.to_dict(), lambda: _show_booth(found)


def _show(found: "GuideRendering") -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    to = console()
    to.print(f"Light guide: {found.guide.words}.", soft_wrap=True)
    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    table.add_column("")
    for light in found.lights:
        table.add_column(light.name, justify="right", no_wrap=True)
    for label, of in _ROWS.items():
        each = [of(light) for light in found.lights]
        if any(cells is not None for cells in each):
            table.add_row(label, *("" if cell is None else _cell(cell) for cell in each))
    to.print(table)
    for name, against in (("sheet", "volume"), ("uncorrected", "sheet")):
        ratio = found.relative(name, against)
        if ratio is not None:
            mean, columns = ratio
            worst = max(range(len(columns.value)), key=lambda k: abs(columns.value[k]))
            to.print(
                f"Luminance, {name} against {against}: {100 * mean.value:+.2f} ± {100 * mean.error:.2f} %; "
                f"of a column at most {100 * columns.value[worst]:+.1f} ± "
                f"{100 * columns.error[worst]:.1f} %, at {found.guide.columns_mm[worst]:g} mm.",
                soft_wrap=True,
            )


def _show_booth(found: "BoothRendering") -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    to = console()
    to.print(f"Booth: {found.booth.words}.", soft_wrap=True)
    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    table.add_column("centre")
    for light in found.lights:
        table.add_column(light.name, justify="right", no_wrap=True)
    table.add_row("luminance / white body's", *(_cell(found.luminance_factor(one)) for one in found.lights))
    table.add_row("luminance / lamps'", *(_cell(one.luminance) for one in found.lights))
    if found.lights[0].chromaticity is not None:
        for k, name in enumerate("xy"):
            table.add_row(name, *(_cell(_part(one.chromaticity, k)) for one in found.lights))
    to.print(table)
    for one, other in found.pairs:
        ratio, xy = found.compared(one, other)
        words = (
            f"{one.name} against {other.name}: luminance {100 * ratio.value:+.2f} ± {100 * ratio.error:.2f} %"
        )
        if xy is not None:
            words += ", " + ", ".join(
                f"{name} {xy.value[k]:+.4f} ± {xy.error[k]:.4f}" for k, name in enumerate("xy")
            )
        to.print(f"{words}.", soft_wrap=True)


_ROWS: dict[str, Any] = {
    "luminance / that of the lamp": lambda light: light.mean_luminance,
    "flux out / flux in": lambda light: light.efficiency,
    "least / largest column": lambda light: light.uniformity,
    "least / largest of nine points": lambda light: light.nine_points,
    "x, far less near": lambda light: _part(light.colour_shift, 0),
    "y, far less near": lambda light: _part(light.colour_shift, 1),
}


def _part(estimate, k: int):
    return None if estimate is None else type(estimate)(estimate.value[k], estimate.error[k])


def _cell(estimate) -> str:
    error = float(estimate.error)
    return with_uncertainty(float(estimate.value), error if math.isfinite(error) else None)
