"""Two folders that change places in one step, and what the new one takes over from the old one."""

import ctypes
import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path

_AT_WORKING_FOLDER = -100
_RENAME_EXCHANGE = 2
_rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None) if os.name == "posix" else None


def must_stay(out: Path, replaced: set[str]) -> bool:
    """Whether an existing folder has to remain the folder that it is.

    Parameters
    ----------
    out
        The folder, without symbolic links in its path.
    replaced
        Names of its entries that may be replaced.

    Returns
    -------
    bool
        So if the system cannot exchange folders, something is mounted there, the folder around it may not be
        written to, this process works in it, or it holds folders that are the user's own.
    """
    if _rename is None or os.path.ismount(out) or not os.access(out.parent, os.W_OK | os.X_OK):
        return True
    with suppress(OSError):
        if Path.cwd().is_relative_to(out):
            return True
    return any(entry.is_dir(follow_symlinks=False) for entry in _own(out, replaced))


def take_turns(new: Path, out: Path, replaced: set[str]) -> bool:
    """Exchange a new folder for an old one, whose other entries it takes over.

    Parameters
    ----------
    new, out
        The folders; afterwards `new` is the old one.
    replaced
        Names of entries of the old one that are not taken over.

    Returns
    -------
    bool
        False, and nothing is changed, where that cannot be done.

    Raises
    ------
    OSError
        If it fails though it could be done; nothing is changed then either.
    """
    linked: list[Path] = []
    try:
        for entry in _own(out, replaced):
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
    for entry in _own(new, replaced):
        with suppress(OSError):
            if not _is_same(Path(entry.path), out / entry.name):
                os.replace(entry.path, out / entry.name)
    return True


def _own(folder: Path, replaced: set[str]) -> list[os.DirEntry]:
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
