"""Files of compiled programs: the user's cache folder, within a bound."""

import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

FOLDER_VARIABLE = "JAXINK_CACHE_DIR"
# XLA logs to stderr from this level on; 3: fatal errors only, 1: what JAX sets by default.
LOG_LEVEL, FATAL_ONLY, JAX_LOG_LEVEL = "TF_CPP_MIN_LOG_LEVEL", 3, "1"
# About two hundred diagnoses of different samples.
LARGEST_BYTES = 1_000_000_000
# A full store is cleared down to this share, oldest files first.
_KEPT_SHARE = 0.8
# StableHLO of jaxink's programs, and what XLA makes of them.
_TRACED, _COMPILED = "traced", "compiled"
_SUFFIX = ".program"
_MAGIC = b"jaxink program 1\n"
_DIGEST_BYTES = hashlib.sha256().digest_size
_LARGEST_FILE_BYTES = 256_000_000


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
    """Folder of the store; None if it is switched off or cannot be written.

    The environment variable ``JAXINK_CACHE_DIR`` names it, and switches it off if it is empty; by default it
    is ``jaxink`` in the user's cache folder.
    """
    named = os.environ.get(FOLDER_VARIABLE)
    if named == "":
        return None
    try:
        root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(named) if named else Path(root) / "jaxink"
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    return folder if os.access(folder, os.W_OK | os.X_OK) else None


def compiled_folder() -> Path | None:
    """Folder for JAX's own cache of compiled programs."""
    folder = store_folder()
    return None if folder is None else folder / _COMPILED


def read_program(name: str) -> bytes | None:
    """A stored program; None if there is none, or if its file is damaged or somebody else's."""
    path = _path(name)
    if path is None:
        return None
    try:
        if path.stat().st_size > _LARGEST_FILE_BYTES:
            return None
        content = path.read_bytes()
    except OSError:
        return None
    head = len(_MAGIC) + _DIGEST_BYTES
    data = content[head:]
    if not content.startswith(_MAGIC) or hashlib.sha256(data).digest() != content[len(_MAGIC) : head]:
        return None
    # Its age decides what a full store drops.
    with suppress(OSError):
        os.utime(path)
    return data


def write_program(name: str, data: bytes) -> None:
    """Store a program; a store that cannot be written is left as it was."""
    path = _path(name)
    if path is None:
        return
    with suppress(OSError):
        path.parent.mkdir(exist_ok=True)
        handle, part = tempfile.mkstemp(dir=path.parent, suffix=".part")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(_MAGIC + hashlib.sha256(data).digest() + data)
            os.replace(part, path)
        except BaseException:
            os.unlink(part)
            raise


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


def lend_to_jax() -> float | None:
    """Let JAX keep what it compiles in the store, unless the process has chosen a folder of its own.

    Returns
    -------
    float or None
        JAX's earlier shortest compile time of what it keeps, in seconds; None if nothing has changed.
    """
    import jax
    from jax.experimental.compilation_cache import compilation_cache

    # JAX makes the attributes of its configuration at run time.
    config: Any = jax.config
    folder = None if config.jax_compilation_cache_dir else compiled_folder()
    if folder is None:
        return None
    seconds = config.jax_persistent_cache_min_compile_time_secs
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    # JAX decides once whether it has a folder: what was compiled before had none.
    compilation_cache.reset_cache()
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
def kept_by_jax() -> Iterator[None]:
    """As `lend_to_jax`, and restored afterwards.

    Meanwhile XLA logs fatal errors only, unless the process has chosen a level: loading a stored program logs
    what its loader does not know, at length and without consequence; real failures are raised.
    """
    seconds = lend_to_jax()
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
            from jax.experimental.compilation_cache import compilation_cache

            jax.config.update("jax_compilation_cache_dir", None)
            jax.config.update("jax_persistent_cache_min_compile_time_secs", seconds)
            # Otherwise JAX would go on using the folder for the caller's own programs.
            compilation_cache.reset_cache()


def _path(name: str) -> Path | None:
    folder = store_folder()
    return None if folder is None else folder / _TRACED / f"{name}{_SUFFIX}"


def _files(folder: Path) -> Iterator[tuple[float, int, Path]]:
    """Time of last use, size and path of each file of the store; other files are never touched."""
    for part in (_TRACED, _COMPILED):
        with suppress(OSError), os.scandir(folder / part) as entries:
            for entry in entries:
                with suppress(OSError):
                    if entry.is_file(follow_symlinks=False):
                        about = entry.stat(follow_symlinks=False)
                        yield about.st_mtime, about.st_size, Path(entry.path)
