"""``jaxink init``."""

import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import typer

import jaxink
from jaxink.cli.answers import quantity, word
from jaxink.cli.session import CommandLine, ExitCode, StoppedError
from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.writing import require_file, written_whole
from jaxink.measurement import refuse_other_samples
from jaxink.sample import (
    ASYMMETRIES,
    DRAFTED_PHASE_FUNCTIONS,
    OPAQUE,
    ORDERS,
    Draft,
    chosen_wavelengths,
    draft_text,
    lit_order,
)

_QUESTIONS = {
    "order": f"Layers in the order in which light meets them ({' | '.join(ORDERS)})",
    "plate_index": "Refractive index of the plate",
    "plate_mm": "Thickness of the plate, mm",
    "ink_index": "Refractive index of the ink's binder",
    "ink_um": "Thickness of the ink, um (or: opaque)",
    "phase_function": f"Phase function of the ink ({' | '.join(DRAFTED_PHASE_FUNCTIONS)})",
    "particle_index": "Refractive index of the particles",
    "radius_nm": "Radius of the particles, nm (a guess)",
    "asymmetry": f"Asymmetry g: one for all {{n}} wavelengths, or each its own ({' | '.join(ASYMMETRIES)})",
}
_WORDS = {"order": ORDERS, "phase_function": DRAFTED_PHASE_FUNCTIONS, "asymmetry": ASYMMETRIES}


def run_init(
    data_files: Sequence[Path],
    out: Path,
    given: dict[str, str | None],
    columns: dict[str, Any],
    options: Sequence[str],
    force: bool,
    quiet: bool,
    colour_from_reflectance: bool = False,
) -> ExitCode:
    """Write a first sample file for a measurement.

    ``given`` are fields of `Draft` as texts, None if not stated; ``columns`` are keywords of `jaxink.read`,
    and ``options`` the same for the command line. With ``colour_from_reflectance`` the spectrum of the ink
    has the shape that its diffuse reflectance gives it.
    """
    require_new(out, force)
    stated = stated_fields(given) | {"colour_from_reflectance": colour_from_reflectance}
    data = jaxink.read(data_files, **columns)
    refuse_other_samples(
        data,
        "Write a sample file for each; if it is one sample, give one of the files or rows (--rows "
        "COLUMN=VALUE) here, and state as relative in [noise] how well its readings reproduce",
    )
    command = CommandLine(
        "init",
        data_files,
        {
            "--out": out,
            "--force": force,
            "--wavelengths": given["wavelengths_nm"],
            "--colour-from-reflectance": colour_from_reflectance,
        },
    )
    draft, assumed = drafted(data, stated, None if quiet else command, options)
    text = draft_text(data, draft, assumed)
    # What is written can be read, or the reason is said.
    sample = jaxink.parse_sample(text, shown_path(out), out.parent)
    with written_whole(out) as part:
        part.write_text(text, encoding="utf-8")
    if not quiet:
        show(data, sample, draft, assumed, out)
        command_words = [
            "jaxink",
            "fit",
            *map(str, data_files),
            "--sample",
            str(out),
            *options,
            "--out",
            "result",
        ]
        typer.echo(f"Next: {shlex.join(command_words)}")
    return ExitCode.FITTED


def require_new(out: Path, force: bool, otherwise: str = "choose another name") -> None:
    """Reject a file that exists, unless the user wants it replaced, or that cannot be written."""
    if out.exists() and not force:
        raise InputRefusedError(f"{shown_path(out)}: exists already; {otherwise}, or add --force.")
    require_file(out)


def stated_fields(given: Mapping[str, str | None]) -> dict[str, Any]:
    """Fields of `Draft` that the options state."""
    return {name: _stated(name, text) for name, text in given.items() if text is not None}


def drafted(
    data: jaxink.GonioData, stated: dict[str, Any], command: CommandLine | None, options: Sequence[str]
) -> tuple[Draft, list[str]]:
    """What is known of the sample, after questions to the user, and the fields that are assumed.

    Parameters
    ----------
    data
        The measurement.
    stated
        Fields of `Draft` that are known.
    command, options
        The command, which goes on where the user stops; None: nobody is asked.
    """
    stated = dict(stated)
    if "order" not in stated and (order := lit_order(data)) is not None:
        stated["order"] = order
    stated["wavelengths_nm"] = tuple(chosen_wavelengths(data, stated.get("wavelengths_nm", ())))
    if command is not None and _is_terminal():
        stated = _asked(data, stated, command, options)
    draft = Draft(**stated)
    return draft, [name for name in draft.needed if name not in stated]


def _is_terminal() -> bool:
    """Whether there is somebody to ask."""
    return sys.stdin.isatty()


def _stated(name: str, text: str) -> Any:
    """The value of a field of `Draft` that a text states."""
    if name in _WORDS:
        return word(name, text, _WORDS[name])
    if name == "ink_um" and text.strip().lower() == OPAQUE:
        return OPAQUE
    if name == "wavelengths_nm":
        return _wavelengths(text)
    try:
        return quantity(name, text)
    except InputRefusedError as problem:
        if name == "ink_um" and not text.strip()[:1].isdigit():
            raise InputRefusedError(f"{str(problem)[:-1]}, or {OPAQUE}.") from None
        raise


def _wavelengths(text: str) -> tuple[float, ...]:
    """Wavelengths with commas, semicolons or spaces between them, each perhaps with its unit."""
    parts = [part for part in re.split(r"[;,]|\s+(?=\d)", text) if part.strip()]
    try:
        return tuple(quantity("wavelengths_nm", part) for part in parts)
    except InputRefusedError:
        raise InputRefusedError(
            f"--wavelengths is {text!r}; write wavelengths in nm separated by commas, such as 450,550,650."
        ) from None


def _asked(
    data: jaxink.GonioData, stated: dict[str, Any], command: CommandLine, options: Sequence[str]
) -> dict[str, Any]:
    """What is known, completed by questions; an empty answer takes the usual value.

    Raises
    ------
    StoppedError
        If the user ends the questions; it keeps the answers in the command that goes on.
    """
    answers = dict(stated)
    typer.echo("Enter takes the value in brackets; all of them can be changed in the file.")
    for name, question in _QUESTIONS.items():
        # Which questions there are depends on the order of the layers and on the phase function.
        known = ("order", "phase_function", "wavelengths_nm", "colour_from_reflectance")
        so_far = Draft(**{key: answers[key] for key in known if key in answers})
        if name in answers or name not in so_far.needed:
            continue
        try:
            answers[name] = _answer(data, answers, name, question.format(n=len(so_far.wavelengths_nm)))
        except (typer.Abort, EOFError, KeyboardInterrupt):
            raise _stopped(answers, command, options) from None
    return answers


def _answer(data: jaxink.GonioData, known: dict[str, Any], name: str, question: str) -> Any:
    """The answer to one question, which is asked again until it is understood and possible."""
    usual = getattr(Draft(), name)
    usual = f"{usual:g}" if isinstance(usual, float) else usual
    while True:
        text = typer.prompt(question, default=usual, type=str)
        try:
            answer = _stated(name, text)
            # Refuses what is out of its range, by the sentence of the sample file.
            jaxink.parse_sample(draft_text(data, Draft(**known, **{name: answer})), name)
        except InputRefusedError as problem:
            typer.echo(str(problem).removeprefix(f"{name}: "))
        else:
            return answer


def _stopped(answers: dict[str, Any], command: CommandLine, options: Sequence[str]) -> StoppedError:
    held = {f"--{name.replace('_', '-')}": value for name, value in answers.items() if name in _QUESTIONS}
    words = " ".join([command.changed(held), *map(shlex.quote, options)])
    typer.echo(err=True)
    return StoppedError("stopped; nothing was written.", [("With the answers so far it goes on by", words)])


def _coefficients(draft: Draft) -> str:
    if draft.colour_from_reflectance:
        return "with a spectrum of the shape that the diffuse reflectance gives"
    return "each with its own coefficients"


def show(data: jaxink.GonioData, sample: jaxink.Sample, draft: Draft, assumed: list[str], out: Path) -> None:
    """Print what was read, written and assumed."""
    sides = " and ".join(sorted(set(data.side.tolist())))
    lines = [f"Read {data.source}: {len(data)} rows in {len(data.scans)} scans, {sides}."]
    lines += [f"  {note}" for note in data.notes]
    layers, n_free = ", ".join(layer.name for layer in sample.layers), len(sample.parameters.free)
    lines.append(f"Written {out}: layers {layers}; {n_free} free parameters.")
    n_held, kept = np.unique(data.wavelength_nm).size, draft.wavelengths_nm
    if len(kept) < n_held:
        shown = ", ".join(f"{nm:g}" for nm in kept)
        lines.append(f"Of {n_held} wavelengths, {len(kept)} are fitted, as requested: {shown} nm.")
    elif n_held > 1:
        some = [f"{kept[k]:g}" for k in sorted({0, n_held // 2, n_held - 1})]
        fewer = f"; fewer are faster: --wavelengths {','.join(some)}" if len(some) < n_held else ""
        every = "Both" if n_held == 2 else f"All {n_held}"
        lines.append(f"{every} wavelengths are fitted, {_coefficients(draft)}{fewer}")
    if assumed:
        values = " ".join(f"--{name.replace('_', '-')} {getattr(draft, name)}" for name in assumed)
        lines.append(
            f"Assumed, because nobody stated it: {values}. Correct it in the file, or state it here."
        )
    typer.echo("\n".join(lines))
