"""A folder's content replaced by what was written beside it, in a way that no fault leaves half done.

Where the system and the folder allow it, the old folder and the new one change places in one step. Else the
entries are moved one by one, which is taken back after a fault, and finished by `settle` after a kill: one
rename makes the new folder ``decided`` in a staging folder inside the old one; from then on the old entries
go to ``old`` beside it, and those decided take their places. ``removed`` names old entries without a
successor.
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
    """Put the content of a new folder in the place of that of an old one.

    Parameters
    ----------
    new
        The new one, staged where `must_stay` tells.
    out
        The folder, which need not exist, without symbolic links in its path. Entries of other names stay.
    owned
        Names of entries that go even without a successor.

    Raises
    ------
    OSError
        If it fails; the folder is then as it was.
    """
    if not out.exists() and _is_taken(new, out):
        return
    written = set(os.listdir(new))
    with alone_in(out):
        if new.parent.parent == out or not _is_exchanged(new, out, written | owned):
            _move_in(new, out, owned - written)


def must_stay(out: Path, replaced: set[str]) -> bool:
    """Whether an existing folder has to remain the folder that it is, so that its content is staged in it.

    So if the system cannot exchange folders, something is mounted there, the folder around it may not be
    written to, this process works in it, or it holds folders that are the user's own: not among `replaced`.
    """
    if _rename is None or os.path.ismount(out) or not os.access(out.parent, os.W_OK | os.X_OK):
        return True
    with suppress(OSError):
        if Path.cwd().is_relative_to(out):
            return True
    return any(entry.is_dir(follow_symlinks=False) for entry in _others(out, replaced))


def settle(folder: str | Path) -> None:
    """Finish in a folder what killed runs had decided, and remove what they had not, if it can be done."""
    for stage in left_over(Path(folder)):
        with suppress(OSError):
            if (stage / DECIDED).is_dir():
                _finish(stage, Path(folder))
            shutil.rmtree(stage, ignore_errors=True)


def _is_taken(new: Path, out: Path) -> bool:
    """Put a new folder where none is; False if another run was faster."""
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
    """Let a new folder take over the other entries of the old one, and its place; False if that cannot be."""
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
    # What the user put into the old folder between the two steps.
    for entry in _others(new, replaced):
        with suppress(OSError):
            if not _is_same(Path(entry.path), out / entry.name):
                os.replace(entry.path, out / entry.name)
    return True


def _others(folder: Path, replaced: set[str]) -> list[os.DirEntry]:
    return [entry for entry in os.scandir(folder) if entry.name not in replaced]


def _make_alike(new: Path, out: Path) -> None:
    """Owner and permissions as they were."""
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
    """Each step leaves what tells whether it has been done."""
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
