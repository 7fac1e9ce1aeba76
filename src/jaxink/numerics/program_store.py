"""Files of compiled programs: the user's cache folder, within a bound.

What is read there is run. The folder and its files must therefore belong to the user, and nobody else may
write to them; who can rename the folders above can still put no file of the user's there.
"""

import logging
import os
import shlex
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from platformdirs import user_cache_path

from jaxink.numerics.named_files import is_own, read_named, write_named

FOLDER_VARIABLE = "JAXINK_CACHE_DIR"
# XLA logs to stderr from this level on; 3: fatal errors only, 1: what JAX sets by default.
LOG_LEVEL, FATAL_ONLY, JAX_LOG_LEVEL = "TF_CPP_MIN_LOG_LEVEL", 3, "1"
# About two hundred diagnoses of different samples.
LARGEST_BYTES = 1_000_000_000
# A full store is cleared down to this share, oldest files first.
_KEPT_SHARE = 0.8
_MODE = 0o700
# StableHLO of jaxink's programs, and what XLA makes of them.
TRACED, COMPILED = "traced", "compiled"
_SUFFIX = ".program"
_LOG = logging.getLogger("jaxink")


class Stored(NamedTuple):
    """Contents of the store.

    Parameters
    ----------
    folder
        Where it is; None if programs are not stored.
    files, size_bytes
        Number of files, and their size.
    """

    folder: Path | None
    files: int
    size_bytes: int


def store_folder() -> Path | None:
    """Folder of the store; None if it is switched off, cannot be written, or others can write to it.

    The environment variable ``JAXINK_CACHE_DIR`` names it, and switches it off if it is empty; by default it
    is ``jaxink`` in the user's cache folder. That others can write to it is logged, once.
    """
    folder = _writable_folder()
    danger = None if folder is None else _danger(folder)
    if danger is not None:
        _warn_once(danger)
        return None
    return folder


def why_not_stored() -> str | None:
    """A sentence on why programs are not stored; None if they are."""
    folder = _writable_folder()
    if folder is None:
        return f"programs are not stored: {FOLDER_VARIABLE} is empty, or the folder cannot be written."
    return _danger(folder)


def _writable_folder() -> Path | None:
    named = os.environ.get(FOLDER_VARIABLE)
    if named == "":
        return None
    try:
        folder = Path(named) if named else user_cache_path("jaxink", appauthor=False)
        folder.mkdir(_MODE, parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    return folder if os.access(folder, os.W_OK | os.X_OK) else None


def _danger(folder: Path) -> str | None:
    """A sentence on who else could have programs run, and what to do about it."""
    for part in (folder, folder / TRACED, folder / COMPILED):
        with suppress(OSError):
            about = part.stat()
            if is_own(about):
                continue
            what, remedy = "belongs to another user", ""
            if about.st_uid == os.geteuid():
                what = "can be written by other users"
                remedy = f"run `chmod -R go-w {shlex.quote(str(folder))}`, or "
            return (
                f"programs are not stored: {part} {what}, whose programs jaxink would run; {remedy}name a "
                f"folder of your own with {FOLDER_VARIABLE}."
            )
    return None


@cache
def _warn_once(sentence: str) -> None:
    _LOG.warning("%s", sentence)


def read_program(name: str, kind: str = TRACED) -> bytes | None:
    """A stored program; None if there is none, or if its file is damaged, of another name or another user."""
    path = _path(name, kind)
    data = None if path is None else read_named(path, f"{kind} {name}", only_own=True)
    if path is not None and data is not None:
        # Its age decides what a full store drops.
        with suppress(OSError):
            os.utime(path)
    return data


def write_program(name: str, data: bytes, kind: str = TRACED) -> None:
    """Store a program; a store that cannot be written is left as it was."""
    path = _path(name, kind)
    if path is None:
        return
    with suppress(OSError):
        path.parent.mkdir(_MODE, exist_ok=True)
        write_named(path, f"{kind} {name}", data)


def stored() -> Stored:
    """What the store contains."""
    folder = store_folder()
    sizes = [] if folder is None else [size for _, size, _ in _files(folder)]
    return Stored(folder, len(sizes), sum(sizes))


def bound_store(largest_bytes: int = LARGEST_BYTES) -> None:
    """Drop the oldest files if the store is larger than its bound."""
    folder = store_folder()
    if folder is None:
        return
    files = sorted(_files(folder))
    size = sum(size for _, size, _ in files)
    if size <= largest_bytes:
        return
    for _, bytes_, path in files:
        if size <= _KEPT_SHARE * largest_bytes:
            break
        with suppress(OSError):
            path.unlink()
            size -= bytes_


def clear_store() -> Stored:
    """Remove all stored programs; return what is left."""
    bound_store(0)
    return stored()


class _Compiled:
    """What JAX asks of a cache of compiled programs (its ``CacheInterface``).

    JAX's own cache does not notice a file that has been exchanged for another, and writes in place.
    """

    def __init__(self, folder: Path):
        # JAX logs it.
        self._path = folder

    def get(self, key: str) -> bytes | None:
        return read_program(key, COMPILED)

    def put(self, key: str, value: bytes) -> None:
        write_program(key, value, COMPILED)


def share_cache_with_jax() -> float | None:
    """Let JAX keep what it compiles in the store, unless the process has a cache of its own.

    JAX has no public function for it. A version that does it in another way compiles everything anew: it is
    never given the folder, which it would read without checking.

    Returns
    -------
    float or None
        JAX's earlier shortest compile time of what it keeps, in seconds; None if nothing has changed.
    """
    import jax

    # JAX makes the attributes of its configuration at run time.
    config: Any = jax.config
    folder = None if config.jax_compilation_cache_dir else store_folder()
    if folder is None:
        return None
    try:
        from jax._src import compilation_cache

        if compilation_cache._cache is not None:
            return None
        seconds = config.jax_persistent_cache_min_compile_time_secs
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    except (ImportError, AttributeError):
        return None
    compilation_cache._cache = _Compiled(folder)  # type: ignore[assignment]
    return seconds


def limit_xla_log(level: int) -> None:
    """Let XLA log to stderr from a level on, also if JAX has been imported already.

    Parameters
    ----------
    level
        0 ... 3, from everything to fatal errors only.
    """
    with suppress(ImportError, AttributeError):
        from jaxlib import utils

        utils.absl_set_min_log_level(level)


@contextmanager
def cached_by_jax() -> Iterator[None]:
    """As `share_cache_with_jax`, and restored afterwards.

    Meanwhile XLA logs fatal errors only, unless the process has chosen a level: loading a stored program logs
    what its loader does not know, at length and without consequence; real failures are raised.
    """
    seconds = share_cache_with_jax()
    silences = seconds is not None and os.environ.get(LOG_LEVEL, JAX_LOG_LEVEL) == JAX_LOG_LEVEL
    if silences:
        limit_xla_log(FATAL_ONLY)
    try:
        yield
    finally:
        if silences:
            limit_xla_log(int(JAX_LOG_LEVEL))
        if seconds is not None:
            import jax
            from jax._src import compilation_cache

            jax.config.update("jax_persistent_cache_min_compile_time_secs", seconds)
            # Otherwise JAX would go on using the store for the caller's own programs.
            compilation_cache._cache = None


def _path(name: str, kind: str) -> Path | None:
    folder = store_folder()
    return None if folder is None else folder / kind / f"{name}{_SUFFIX}"


def _files(folder: Path) -> Iterator[tuple[float, int, Path]]:
    """Time of last use, size and path of each file of the store; other files are never touched."""
    for part in (TRACED, COMPILED):
        with suppress(OSError), os.scandir(folder / part) as entries:
            for entry in entries:
                with suppress(OSError):
                    if entry.is_file(follow_symlinks=False):
                        about = entry.stat(follow_symlinks=False)
                        yield about.st_mtime, about.st_size, Path(entry.path)
