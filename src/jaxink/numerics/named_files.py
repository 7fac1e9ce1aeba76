"""Files that hold their own name: one that is damaged, or exchanged for another, is not read."""

import hashlib
import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

_MAGIC = b"jaxink named file 1\n"
_HEAD_BYTES = len(_MAGIC) + hashlib.sha256().digest_size
LARGEST_BYTES = 256_000_000


def read_named(path: Path, name: str, only_own: bool = False) -> bytes | None:
    """Content that was written under a name.

    Parameters
    ----------
    path
        The file; one that would block, never end or be too large is not read.
    name
        As it was written.
    only_own
        Whether it must be a file that only this user can change; see `is_own`.

    Returns
    -------
    bytes or None
        None if there is no such content.
    """
    try:
        # Opening a pipe would wait until somebody writes to it.
        with open(path, "rb", opener=_without_waiting) as file:
            about = os.fstat(file.fileno())
            is_ordinary = stat.S_ISREG(about.st_mode) and about.st_size <= LARGEST_BYTES
            if not is_ordinary or (only_own and not is_own(about)):
                return None
            content = file.read(about.st_size)
    except OSError:
        return None
    data = content[_HEAD_BYTES:]
    return data if content[:_HEAD_BYTES] == _head(name, data) else None


def write_named(path: Path, name: str, data: bytes) -> None:
    """Write a file whole or not at all, readable by this user only; one too large to be read is not written.

    Raises
    ------
    OSError
        It cannot be written.
    """
    if _HEAD_BYTES + len(data) > LARGEST_BYTES:
        return
    handle, part = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(_head(name, data))
            file.write(data)
        os.replace(part, path)
    except BaseException:
        with suppress(OSError):
            os.unlink(part)
        raise


def is_own(about: os.stat_result) -> bool:
    """Whether a file or folder belongs to this user, and nobody else may write to it.

    Windows has other rules, which Python does not show: there, the answer is yes.
    """
    if not hasattr(os, "geteuid"):
        return True
    return about.st_uid == os.geteuid() and not about.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _head(name: str, data: bytes) -> bytes:
    digest = hashlib.sha256(f"{name}\0".encode())
    digest.update(data)
    return _MAGIC + digest.digest()


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
