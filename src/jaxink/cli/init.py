"""``jaxink init``."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

import jaxink
from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.writing import require_file, written_whole
from jaxink.sample.draft import ORDERS, PHASE_FUNCTIONS, Draft, lit_order, sample_text

_QUESTIONS = {
    "order": f"Layers in the order in which light meets them ({' | '.join(ORDERS)})",
    "plate_index": "Refractive index of the plate",
    "plate_mm": "Thickness of the plate, mm",
    "ink_index": "Refractive index of the ink's binder",
    "ink_um": "Thickness of the ink, um (or: opaque)",
    "phase_function": f"Phase function of the ink ({' | '.join(PHASE_FUNCTIONS)})",
    "particle_index": "Refractive index of the particles",
    "radius_nm": "Radius of the particles, nm (a guess)",
}


def run_init(
    data_files: Sequence[Path],
    out: Path,
    given: dict[str, Any],
    columns: dict[str, Any],
    options: Sequence[str],
    force: bool,
    quiet: bool,
) -> ExitCode:
    """Write a first sample file for a measurement.

    ``given`` are fields of `Draft`, None if not stated; ``columns`` are keywords of `jaxink.read`, and
    ``options`` the same for the command line.
    """
    if out.exists() and not force:
        raise InputRefusedError(f"{shown_path(out)}: exists already; choose another name, or add --force.")
    require_file(out)
    data = jaxink.read(data_files, **columns)
    stated = {name: _number_or_word(name, value) for name, value in given.items() if value is not None}
    if "order" not in stated and (order := lit_order(data)) is not None:
        stated["order"] = order
    if _is_terminal() and not quiet:
        stated = _asked(stated)
    draft = Draft(**stated)
    assumed = [name for name in draft.needed if name not in stated]
    text = sample_text(data, draft, assumed)
    # What is written can be read, or the reason is said.
    sample = jaxink.parse_sample(text, shown_path(out), out.parent)
    with written_whole(out) as part:
        part.write_text(text, encoding="utf-8")
    if not quiet:
        _show(data, sample, draft, assumed, out)
        command = ["jaxink", "fit", *map(str, data_files), "--sample", str(out), *options, "--out", "result"]
        typer.echo(f"Next: {shlex.join(command)}")
    return ExitCode.FITTED


def _is_terminal() -> bool:
    """Whether there is somebody to ask."""
    return sys.stdin.isatty()


def _number_or_word(name: str, value: Any) -> Any:
    """The ink's thickness is a number or a word."""
    if name != "ink_um":
        return value
    try:
        return float(value)
    except ValueError:
        return value.strip().lower()


def _asked(stated: dict[str, Any]) -> dict[str, Any]:
    """What is known, completed by questions; an empty answer takes the usual value."""
    answers = dict(stated)
    typer.echo("Enter takes the value in brackets; all of them can be changed in the file.")
    for name, question in _QUESTIONS.items():
        # Which questions there are depends on the order of the layers and on the phase function.
        so_far = Draft(**{key: answers[key] for key in ("order", "phase_function") if key in answers})
        if name in answers or name not in so_far.needed:
            continue
        usual = getattr(Draft(), name)
        words = {"order": ORDERS, "phase_function": PHASE_FUNCTIONS}.get(name)
        while True:
            answer = typer.prompt(question, default=usual, type=type(usual) if name != "ink_um" else str)
            if words is None or answer in words:
                break
            typer.echo(f"One of: {', '.join(words)}.")
        answers[name] = _number_or_word(name, answer)
    return answers


def _show(data: jaxink.GonioData, sample: jaxink.Sample, draft: Draft, assumed: list[str], out: Path) -> None:
    sides = " and ".join(sorted(set(data.side.tolist())))
    lines = [f"Read {data.source}: {len(data)} rows in {len(data.scans)} scans, {sides}."]
    lines += [f"  {note}" for note in data.notes]
    layers, n_free = ", ".join(layer.name for layer in sample.layers), len(sample.parameters.free)
    lines.append(f"Written {out}: layers {layers}; {n_free} free parameters.")
    if assumed:
        values = " ".join(f"--{name.replace('_', '-')} {getattr(draft, name)}" for name in assumed)
        lines.append(
            f"Assumed, because nobody stated it: {values}. Correct it in the file, or state it here."
        )
    typer.echo("\n".join(lines))
