"""The page docs/manual/as-people-have-it.md: what becomes of each situation when its command is run."""

import shlex
from pathlib import Path
from typing import NamedTuple

from tests.docs.situation_files import Situation
from tests.docs.situations import GROUPS

_TOP = """# As people have it

Written by `python docs/manual/as_people_have_it.py`, which makes each of these files, runs the command,
and writes down what it says; a test repeats that. The words are those after `jaxink convert`, with
`--out tidy.csv` behind them; `fit`, `diagnose`, `predict`, `init` and `jaxink.read` understand and refuse the
same. The rules are on the pages on [measurement files](measurement-file.md) and
[files of instruments and ray tracers](formats-in.md).
"""
_HEADS = ("what there is", "command", "what becomes of it", "then")


class Outcome(NamedTuple):
    """First line that the command prints with what concerns the values, or the sentence of its "
    "refusal; and the measurement, if "
    "it is read."""

    sentence: str
    tidy: Path | None


def command_of(situation: Situation, options: str) -> list[str]:
    """The words after ``jaxink``."""
    return ["convert", *situation.files, *shlex.split(options), "--out", "tidy.csv"]


def outcome(situation: Situation, options: str, folder: Path) -> Outcome:
    """Make the files in a folder, which is the current one, and run the command."""
    from typer.testing import CliRunner

    from jaxink.cli.app import app

    for name, make in situation.files.items():
        make(folder / name)
    tidy = folder / "tidy.csv"
    tidy.unlink(missing_ok=True)
    done = CliRunner().invoke(app, command_of(situation, options))
    if done.exit_code == 0:
        first, *notes = done.stdout.splitlines()
        told = [note for note in notes if "masked" in note or "kept as repeats" in note]
        return Outcome(" ".join([first, *told]), tidy)
    assert (done.exit_code, done.stdout) == (5, ""), done.output
    return Outcome(done.stderr.strip().removeprefix("jaxink: "), None)


def line(situation: Situation, folder: Path) -> str:
    """Row of the page."""
    found = outcome(situation, situation.options, folder)
    kind = "**read:**" if found.tidy else "**refused:**"
    if found.tidy:
        then = ""
    elif situation.then is None:
        then = "change the file"
    else:
        again = outcome(situation, situation.then, folder)
        then = f"`{_shown(situation, situation.then)}` **read:** {again.sentence}"
    cells = (situation.what, f"`{_shown(situation, situation.options)}`", f"{kind} {found.sentence}", then)
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"


def _shown(situation: Situation, options: str) -> str:
    return " ".join([*situation.files, *([options] if options else [])])


def page(folder: Path) -> str:
    """Text of the page."""
    parts = [_TOP]
    for title, situations in GROUPS.items():
        head = f"| {' | '.join(_HEADS)} |\n" + "|---" * len(_HEADS) + "|\n"
        parts.append(f"\n## {title}\n\n{head}{''.join(line(each, folder) for each in situations)}")
    return "".join(parts)
