"""Entries of a folder replaced one by one, in a way that can be taken back, or finished after a kill.

A staging folder inside the folder holds ``new``, which one rename turns into ``decided``; from then on the
old entries go to ``old``, and those decided take their places. ``removed`` names old entries without a
successor.
"""

import os
import shutil
from contextlib import suppress
from pathlib import Path

from jaxink.files.staging import Stage, left_over

NEW, _DECIDED, _OLD, _REMOVED = "new", "decided", "old", "removed"


def move_in(stage: Stage, out: Path, removed: set[str]) -> None:
    """Replace entries of a folder by those of the stage's ``new``.

    Parameters
    ----------
    stage
        In the folder.
    out
        The folder.
    removed
        Names of entries that go without a successor.

    Raises
    ------
    OSError
        If a step fails; the folder is then as it was.
    """
    here = stage.path
    for name in (_OLD, _REMOVED):
        (here / name).mkdir()
    for name in removed:
        (here / _REMOVED / name).touch()
    os.rename(here / NEW, here / _DECIDED)
    written = _names(here / _DECIDED)
    stage.keep = True
    try:
        _finish(here, out)
    except BaseException:
        _take_back(here, out, written)
        stage.keep = False
        raise
    stage.keep = False


def settle(folder: str | Path) -> None:
    """Finish in a folder what killed runs had decided, and remove what they had not.

    Parameters
    ----------
    folder
        The folder; where it may not be written to, nothing happens.
    """
    for path in left_over(Path(folder)):
        with suppress(OSError):
            if (path / _DECIDED).is_dir():
                _finish(path, Path(folder))
            shutil.rmtree(path, ignore_errors=True)


def _finish(here: Path, out: Path) -> None:
    """Each step leaves what tells whether it has been done."""
    for name in sorted(_names(here / _DECIDED) | _names(here / _REMOVED)):
        target, old = out / name, here / _OLD / name
        if os.path.lexists(target) and not os.path.lexists(old):
            os.rename(target, old)
        if os.path.lexists(here / _DECIDED / name):
            os.rename(here / _DECIDED / name, target)


def _take_back(here: Path, out: Path, written: set[str]) -> None:
    for name in sorted(written - _names(here / _DECIDED)):
        os.rename(out / name, here / _DECIDED / name)
    for name in sorted(_names(here / _OLD)):
        os.rename(here / _OLD / name, out / name)


def _names(folder: Path) -> set[str]:
    return {entry.name for entry in os.scandir(folder)}
