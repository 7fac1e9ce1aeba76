"""Writing files and folders completely or not at all."""

import errno
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jaxink.errors import InputRefusedError
from jaxink.files.exchange import settle, take_place
from jaxink.files.reading import shown_path
from jaxink.files.staging import staged_in, synced


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Path of a temporary file that replaces the file at `path` once it is complete.

    It is in a hidden folder beside `path`, so that the last step is a rename within one file system.

    Raises
    ------
    InputRefusedError
        If the folder does not exist or the file cannot be written; an existing file is then unchanged.
    """
    with _one_sentence(path):
        folder = _folder_of(path)
        settle(folder)
        with staged_in(folder) as stage:
            part = stage / path.name
            yield part
            synced(part)
            os.replace(part, path)
            _remember(folder)


@contextmanager
def whole_folder(out: str | Path, owned: Collection[str] = ()) -> Iterator[Path]:
    """Hidden folder to write to; its contents replace those of ``out`` once they are complete.

    Parameters
    ----------
    out
        The folder, created if it does not exist. Entries with the same names are replaced, all others remain.
    owned
        Entries that are removed unless they are written again, because they would belong to an older result.

    Raises
    ------
    InputRefusedError
        If writing fails; ``out`` is then as it was.
    """
    with _one_sentence(out):
        real, place = _places(Path(out))
        for folder in {place, real, real.parent}:
            settle(folder)
        with staged_in(place) as stage:
            new = stage / "new"
            new.mkdir()
            yield new
            for inner, _, files in os.walk(new):
                for path in (*(Path(inner, name) for name in files), Path(inner)):
                    synced(path)
            take_place(new, real, set(owned))
            _remember(real)


def require_file(path: Path) -> None:
    """Reject a file that `written_whole` could not write, before anything is computed for it."""
    with _one_sentence(path), staged_in(_folder_of(path)):
        pass


def require_folder(out: Path) -> None:
    """Reject a folder that `whole_folder` could not write, before anything is computed for it."""
    with _one_sentence(out), staged_in(_places(out)[1]):
        pass


@contextmanager
def _one_sentence(wanted: str | Path) -> Iterator[None]:
    name = shown_path(wanted)
    try:
        if "\0" in str(wanted):
            raise OSError(errno.EINVAL, "a name cannot contain a zero byte")
        yield
    except OSError as problem:
        raise InputRefusedError(
            f"{name}: cannot be written there ({problem.strerror or problem}); choose another folder."
        ) from None


def _folder_of(path: Path) -> Path:
    """Folder of a file that can be written."""
    folder = path.absolute().parent
    if path.is_dir():
        raise InputRefusedError(f"{path}: is a folder; give the name of a file, for example inside it.")
    if path.exists() and not path.is_file():
        raise InputRefusedError(f"{path}: is a pipe or a device; give the name of a regular file.")
    if not folder.is_dir():
        raise InputRefusedError(f"{path}: the folder does not exist; create it first.")
    _is_there(path)
    _require_writable(folder, path)
    return folder


def _places(out: Path) -> tuple[Path, Path]:
    """The folder with symbolic links resolved, and an existing one in the same file system for staging."""
    if out.is_symlink() and not out.exists():
        raise InputRefusedError(
            f"{out}: is a symbolic link to {out.readlink()}, which does not exist; create that folder, or "
            "choose another one."
        )
    if out.exists() and not out.is_dir():
        raise InputRefusedError(f"{out}: is a file; give the name of a folder.")
    real = place = Path(os.path.realpath(out))
    while not _is_there(place):
        place = place.parent
    if not place.is_dir():
        raise InputRefusedError(f"{out}: {place} is a file, not a folder; choose another folder.")
    _require_writable(place, out)
    return real, place


def _is_there(path: Path) -> bool:
    """Whether the path exists; a name that is too long is an error."""
    with suppress(FileNotFoundError, NotADirectoryError):
        path.lstat()
        return True
    return False


def _require_writable(folder: Path, wanted: Path) -> None:
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputRefusedError(f"{wanted}: {folder} is not writable; choose another folder.")


def _remember(folder: Path) -> None:
    """Flush the renames; they are done, so errors of the disk no longer matter."""
    with suppress(OSError):
        synced(folder)
        synced(folder.parent)
