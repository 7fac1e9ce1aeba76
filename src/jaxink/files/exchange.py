"""Replacing the contents of a folder by those of a staged one; no failure leaves the exchange half done.

If the system and the folder allow it, the old and the new folder are exchanged in one step. Otherwise the
entries are moved one by one; this is undone after an error, and completed by `settle` after a kill. A rename
first makes the new folder ``decided`` in a staging folder inside the old one; the old entries then go to
``old`` beside it, and the decided ones take their places. ``removed`` lists old entries without successor.
"""

import ctypes
import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path

from jaxink.files.staging import DECIDED, alone_in, left_over, staged_in

_OLD, _REMOVED, _TAKEN_BACK = "old", "removed", "taken back"
_AT_WORKING_FOLDER = -100
_RENAME_EXCHANGE = 2
_rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None) if os.name == "posix" else None


def take_place(new: Path, out: Path, owned: set[str]) -> None:
    """Replace the contents of a folder; after an OSError it is as it was.

    Parameters
    ----------
    new
        The new folder, staged in a place chosen by `must_stay`.
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
        if new.parent.parent == out or not _is_exchanged(new, out, written | owned):
            _move_in(new, out, owned - written)


def must_stay(out: Path, replaced: set[str]) -> bool:
    """Whether an existing folder cannot be exchanged, so that new contents are staged inside it.

    This is the case if the system cannot exchange folders, the folder is a mount point, its parent is not
    writable, it contains this process's working folder, or it has subfolders that are not in `replaced`.
    """
    if _rename is None or os.path.ismount(out) or not os.access(out.parent, os.W_OK | os.X_OK):
        return True
    with suppress(OSError):
        if Path.cwd().is_relative_to(out):
            return True
    return any(entry.is_dir(follow_symlinks=False) for entry in _others(out, replaced))


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


def _is_exchanged(new: Path, out: Path, replaced: set[str]) -> bool:
    """Link the old folder's other entries into the new one and exchange them; False if that is impossible."""
    linked: list[Path] = []
    try:
        for entry in _others(out, replaced):
            os.link(entry.path, new / entry.name, follow_symlinks=False)
            linked.append(new / entry.name)
        _make_alike(new, out)
        _exchange(new, out)
    except OSError as problem:
        for link in linked:
            link.unlink()
        if problem.errno in (errno.ENOSPC, errno.EDQUOT, errno.EIO):
            raise
        return False
    # Entries that the user added to the old folder between the two steps.
    for entry in _others(new, replaced):
        with suppress(OSError):
            if not _is_same(Path(entry.path), out / entry.name):
                os.replace(entry.path, out / entry.name)
    return True


def _others(folder: Path, replaced: set[str]) -> list[os.DirEntry]:
    return [entry for entry in os.scandir(folder) if entry.name not in replaced]


def _make_alike(new: Path, out: Path) -> None:
    """Copy owner and permissions of the old folder."""
    there, here = out.stat(), new.stat()
    if (there.st_uid, there.st_gid) != (here.st_uid, here.st_gid):
        os.chown(new, there.st_uid, there.st_gid)
    shutil.copystat(out, new)
    os.utime(new)


def _is_same(first: Path, second: Path) -> bool:
    try:
        return os.path.samestat(first.lstat(), second.lstat())
    except FileNotFoundError:
        return False


def _exchange(first: Path, second: Path) -> None:
    if _rename is None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))
    paths = [os.fsencode(path) for path in (first, second)]
    if _rename(_AT_WORKING_FOLDER, paths[0], _AT_WORKING_FOLDER, paths[1], _RENAME_EXCHANGE):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


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
