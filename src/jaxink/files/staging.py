"""Hidden folders in which output is staged.

Their names are random, because process ids are reused (in containers, at every start). Each folder is locked
while its run is alive. The system releases the lock when the run ends, in whatever way, so a later run can
distinguish leftovers from folders in use.
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
except ImportError:  # Windows: nothing is locked, so nothing is ever treated as a leftover.
    fcntl = None  # type: ignore[assignment]

# Entry of a staging folder: output that a run has decided to put in place, which must not be lost.
DECIDED = "decided"
_PREFIX = ".jaxink-"
_LOCK = "lock"
_LOCK_BYTES = 4096
_TRIES = 100
# Earlier versions used the second form, named by process and not locked.
_NAMES = re.compile(r"\.jaxink-\w{8}|\..+\.jaxink-\d+")
# A folder without lock that is older than this does not belong to a run that is just starting.
_OLD_SECONDS = 24 * 3600


@contextmanager
def staged_in(folder: Path) -> Iterator[Path]:
    """Hidden folder in an existing one, removed at the end unless it still contains `DECIDED` output.

    Creating it fails if nothing can be written, because its lock file occupies a page of the disk.
    """
    stage, lock = _new_stage(folder)
    try:
        yield stage
    finally:
        if not (stage / DECIDED).exists():
            shutil.rmtree(stage, ignore_errors=True)
        os.close(lock)


def left_over(folder: Path) -> Iterator[Path]:
    """Staging folders that the user's dead runs have left in a folder, each locked while it is yielded."""
    with suppress(OSError, ValueError):
        for entry in [entry for entry in os.scandir(folder) if _NAMES.fullmatch(entry.name)]:
            if entry.is_dir(follow_symlinks=False) and _is_own(entry):
                yield from _if_dead(Path(entry.path))


def _is_own(entry: os.DirEntry) -> bool:
    """In a shared folder, somebody else could fake a leftover."""
    return not hasattr(os, "geteuid") or entry.stat(follow_symlinks=False).st_uid == os.geteuid()


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
        # Another run may have taken it for a leftover before it was locked.
        if _locked(lock) is not False:
            return path, lock
        os.close(lock)
    raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))


def _locked(descriptor: int) -> bool | None:
    """Whether a file could be locked; None if locking is not supported."""
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
    """Wait until no other run is replacing a folder's contents; do not wait if folders cannot be locked."""
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
    """Flush a file or a folder to the disk, so that errors such as a full disk appear now at the latest."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as problem:
        # Some file systems do not support it.
        if problem.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)
