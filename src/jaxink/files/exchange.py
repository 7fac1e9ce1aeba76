"""Replacing the contents of a folder by those of a staged one; no failure leaves the exchange half done.

The entries are moved one by one; this is undone after an error, and completed by `settle` after a kill. A
rename first makes the new folder ``decided`` in a staging folder inside the old one; the old entries then go
to ``old`` beside it, and the decided ones take their places. ``removed`` lists old entries without successor.
"""

import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path

from jaxink.files.staging import DECIDED, alone_in, left_over, staged_in

_OLD, _REMOVED, _TAKEN_BACK = "old", "removed", "taken back"


def take_place(new: Path, out: Path, owned: set[str]) -> None:
    """Replace the contents of a folder; after an OSError it is as it was.

    Parameters
    ----------
    new
        The new folder, staged in the same file system.
    out
        The folder to replace, which need not exist; no symbolic links in its path. Entries with other names
        remain.
    owned
        Names of entries that are removed even without a successor.
    """
    if not out.exists() and _is_taken(new, out):
        return
    written = set(os.listdir(new))
    with alone_in(out):
        _move_in(new, out, owned - written)


def settle(folder: str | Path) -> None:
    """Complete what killed runs had decided in a folder, and remove what they had not, as far as possible."""
    for stage in left_over(Path(folder)):
        with suppress(OSError):
            if (stage / DECIDED).is_dir():
                _finish(stage, Path(folder))
            shutil.rmtree(stage, ignore_errors=True)


def _is_taken(new: Path, out: Path) -> bool:
    """Move a new folder to a place that is still free; False if another run was faster."""
    made = [folder for folder in reversed(out.parents) if not folder.exists()]
    try:
        for folder in made:
            folder.mkdir(exist_ok=True)
        os.rename(new, out)
    except OSError as problem:
        if problem.errno in (errno.ENOTEMPTY, errno.EEXIST):
            return False
        for folder in reversed(made):
            with suppress(OSError):
                folder.rmdir()
        raise
    return True


def _move_in(new: Path, out: Path, removed: set[str]) -> None:
    """Move the entries one by one."""
    with staged_in(out) as stage:
        for name in (_OLD, _REMOVED):
            (stage / name).mkdir()
        for name in removed:
            (stage / _REMOVED / name).touch()
        os.rename(new, stage / DECIDED)
        written = _names(stage / DECIDED)
        try:
            _finish(stage, out)
        except BaseException:
            _take_back(stage, out, written)
            raise


def _finish(stage: Path, out: Path) -> None:
    """Move the entries; every step leaves evidence of whether it has been done."""
    for name in sorted(_names(stage / DECIDED) | _names(stage / _REMOVED)):
        target, old = out / name, stage / _OLD / name
        if os.path.lexists(target) and not os.path.lexists(old):
            os.rename(target, old)
        if os.path.lexists(stage / DECIDED / name):
            os.rename(stage / DECIDED / name, target)
    (stage / DECIDED).rmdir()


def _take_back(stage: Path, out: Path, written: set[str]) -> None:
    for name in sorted(written - _names(stage / DECIDED)):
        os.rename(out / name, stage / DECIDED / name)
    for name in sorted(_names(stage / _OLD)):
        os.rename(stage / _OLD / name, out / name)
    os.rename(stage / DECIDED, stage / _TAKEN_BACK)


def _names(folder: Path) -> set[str]:
    return {entry.name for entry in os.scandir(folder)}
