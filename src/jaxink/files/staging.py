"""Hidden folders in which output is written before it takes its place.

Their names are random: ids of processes come again, in containers from one start to the next. Each is locked
while its run lives; the system lifts the lock when the run dies, however it dies, so that a later run can
tell what is left over from what is in use.
"""

import errno
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: nothing is locked, and so nothing is ever taken for a left-over.
    fcntl = None

# In a staging folder: what a run had decided to put in place, which must not be lost.
DECIDED = "decided"
_PREFIX = ".jaxink-"
_LOCK = "lock"
_LOCK_BYTES = 4096
_TRIES = 100
# The second form is that of a jaxink that named them by process and did not lock them.
_NAMES = re.compile(r"\.jaxink-\w{8}|\..+\.jaxink-\d+")
# From when on one without a lock is not of a run that is just starting.
_OLD_SECONDS = 24 * 3600


@contextmanager
def staged_in(folder: Path) -> Iterator[Path]:
    """A hidden folder, removed at the end, unless it holds what is `DECIDED` and not in its place.

    Where nothing can be written making it fails, for the file of its lock takes a page of the disk.

    Parameters
    ----------
    folder
        An existing folder, in which it is made.
    """
    stage, lock = _new_stage(folder)
    try:
        yield stage
    finally:
        if not (stage / DECIDED).exists():
            shutil.rmtree(stage, ignore_errors=True)
        os.close(lock)


def left_over(folder: Path) -> Iterator[Path]:
    """Staging folders in a folder of the user's own runs that are dead, each locked while it is looked at."""
    with suppress(OSError, ValueError):
        for entry in [entry for entry in os.scandir(folder) if _NAMES.fullmatch(entry.name)]:
            if entry.is_dir(follow_symlinks=False) and _is_own(entry):
                yield from _if_dead(Path(entry.path))


def _is_own(entry: os.DirEntry) -> bool:
    """Where several users write, another's folder could be made to look like a left-over."""
    return os.name != "posix" or entry.stat(follow_symlinks=False).st_uid == os.geteuid()


def _if_dead(path: Path) -> Iterator[Path]:
    try:
        lock = os.open(path / _LOCK, os.O_RDWR)
    except FileNotFoundError:
        if time.time() - path.stat().st_mtime > _OLD_SECONDS:
            yield path
        return
    except OSError:
        return
    try:
        if _locked(lock):
            yield path
    finally:
        os.close(lock)


def _new_stage(folder: Path) -> tuple[Path, int]:
    for _ in range(_TRIES):
        path = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=folder))
        try:
            (path / _LOCK).write_bytes(bytes(_LOCK_BYTES))
            synced(path / _LOCK)
            lock = os.open(path / _LOCK, os.O_RDWR)
        except OSError:
            shutil.rmtree(path, ignore_errors=True)
            raise
        # Between the lines above, another run can have taken it for a left-over.
        if _locked(lock) is not False:
            return path, lock
        os.close(lock)
    raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))


def _locked(descriptor: int) -> bool | None:
    """Whether a file could be locked; None where files cannot be locked at all."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other run replaces what is in a folder; where folders cannot be locked, do not wait."""
    lock = None
    with suppress(OSError, AttributeError):
        lock = os.open(folder, os.O_RDONLY)
        fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if lock is not None:
            os.close(lock)


def synced(path: Path) -> None:
    """Have a file or a folder written to the disk: what a full disk refuses is refused here at the latest."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as problem:
        # Some file systems cannot do it.
        if problem.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)
