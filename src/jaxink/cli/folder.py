"""Output that is written whole or not at all."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jaxink.errors import InputRefusedError


def require_folder(out: Path) -> None:
    """Refuse, before anything is computed, a folder that cannot be written.

    Parameters
    ----------
    out
        Where results shall go.

    Raises
    ------
    InputRefusedError
        If it is a file, lies below a file, or may not be written.
    """
    if out.exists() and not out.is_dir():
        raise InputRefusedError(f"{out}: is a file, but --out needs a folder; name another one.")
    at = out.absolute()
    while not at.exists():
        at = at.parent
    _require_writable(at, out)


def require_writable_file(path: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse, before anything is computed, a file that cannot be written; as `require_folder`."""
    if path.suffix not in suffixes:
        raise InputRefusedError(
            f"{path}: the suffix '{path.suffix}' is not one of {', '.join(suffixes)}, which name the format."
        )
    if path.is_dir():
        raise InputRefusedError(f"{path}: is a folder, but --out needs a file; name one inside it.")
    if not path.absolute().parent.is_dir():
        raise InputRefusedError(f"{path}: the folder does not exist; create it first.")
    _require_writable(path.absolute().parent, path)


def _require_writable(folder: Path, wanted: Path) -> None:
    if not folder.is_dir():
        raise InputRefusedError(f"{wanted}: {folder} is a file, so nothing can be written below it.")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputRefusedError(f"{wanted}: {folder} may not be written to; choose another place for --out.")


@contextmanager
def whole_folder(out: Path, owned: tuple[str, ...] = ()) -> Iterator[Path]:
    """A hidden folder beside ``out`` whose content takes its place once it is complete.

    Parameters
    ----------
    out
        The folder; entries of the same names are replaced, all others stay.
    owned
        Folders inside it that are removed if they are not written anew: they would belong to an older result.

    Yields
    ------
    Path
        Where to write.

    Raises
    ------
    InputRefusedError
        If writing fails; ``out`` is then as it was.
    """
    out = out.absolute()
    staging = out.parent / f".{out.name}.jaxink-{os.getpid()}"
    try:
        staging.mkdir(parents=True)
        yield staging
        _take_place(staging, out, owned)
    except OSError as problem:
        raise InputRefusedError(
            f"{out}: the result cannot be written there ({problem.strerror or problem}); choose another "
            "folder."
        ) from None
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _take_place(staging: Path, out: Path, owned: tuple[str, ...]) -> None:
    if not out.exists():
        os.rename(staging, out)
        return
    old = staging / ".old"
    old.mkdir()
    written = {entry.name for entry in staging.iterdir() if entry != old}
    for name in sorted(written | set(owned)):
        target = out / name
        if target.is_dir():
            os.rename(target, old / name)
        if name in written:
            os.replace(staging / name, target)
