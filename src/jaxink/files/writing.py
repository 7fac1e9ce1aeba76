"""Files and folders that are written whole or not at all, and places where they cannot be."""

import errno
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jaxink.errors import InputRefusedError
from jaxink.files.exchange import must_stay, settle, take_place
from jaxink.files.reading import shown_path
from jaxink.files.staging import staged_in, synced


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Where to write a file; it takes the place of `path` once it is complete.

    Parameters
    ----------
    path
        The file; its folder exists.

    Yields
    ------
    Path
        In a hidden folder beside it, so that the last step is a rename within one file system.

    Raises
    ------
    InputRefusedError
        If it cannot be written; what was there before is then still there.
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
    """A hidden folder whose content takes the place of that of ``out`` once it is complete.

    Parameters
    ----------
    out
        The folder, made if it does not exist; entries of the same names are replaced, all others stay.
    owned
        Entries that are removed if they are not written anew: they would belong to an older result.

    Yields
    ------
    Path
        Where to write.

    Raises
    ------
    InputRefusedError
        If writing fails; ``out`` is then as it was.
    """
    with _one_sentence(out):
        real, place = _places(Path(out), owned)
        for folder in {place, real}:
            settle(folder)
        with staged_in(place) as stage:
            new = stage / "new"
            new.mkdir()
            yield new
            for folder, _, files in os.walk(new):
                for path in (*(Path(folder, name) for name in files), Path(folder)):
                    synced(path)
            take_place(new, real, set(owned))
            _remember(real)


def require_file(path: Path) -> None:
    """Refuse a file that `written_whole` could not write, before anything is computed for it."""
    with _one_sentence(path), staged_in(_folder_of(path)):
        pass


def require_folder(out: Path, owned: Collection[str] = ()) -> None:
    """Refuse a folder that `whole_folder` could not write, before anything is computed for it."""
    with _one_sentence(out), staged_in(_places(out, owned)[1]):
        pass


@contextmanager
def _one_sentence(wanted: str | Path) -> Iterator[None]:
    name = shown_path(wanted)
    try:
        if "\0" in str(wanted):
            raise OSError(errno.EINVAL, "its name holds a zero byte, which no name can")
        yield
    except OSError as problem:
        raise InputRefusedError(
            f"{name}: cannot be written there ({problem.strerror or problem}); choose another folder."
        ) from None


def _folder_of(path: Path) -> Path:
    """The folder of a file, where the file can be written."""
    folder = path.absolute().parent
    if path.is_dir():
        raise InputRefusedError(f"{path}: is a folder, but a file is needed; name one inside it.")
    if path.exists() and not path.is_file():
        raise InputRefusedError(f"{path}: is a pipe or a device, but a file is needed; name one.")
    if not folder.is_dir():
        raise InputRefusedError(f"{path}: the folder does not exist; create it first.")
    _is_there(path)
    _require_writable(folder, path)
    return folder


def _places(out: Path, owned: Collection[str]) -> tuple[Path, Path]:
    """A folder without symbolic links, and the one that exists in the same file system to stage it in."""
    if out.is_symlink() and not out.exists():
        raise InputRefusedError(
            f"{out}: is a symbolic link to {out.readlink()}, which does not exist; create that folder, or "
            "name another one."
        )
    if out.exists() and not out.is_dir():
        raise InputRefusedError(f"{out}: is a file, but a folder is needed; name another one.")
    real = place = Path(os.path.realpath(out))
    while not _is_there(place):
        place = place.parent
    if not place.is_dir():
        raise InputRefusedError(f"{out}: {place} is a file, so nothing can be written below it.")
    _require_writable(place, out)
    is_beside = place == real and not must_stay(real, set(owned))
    return real, real.parent if is_beside else place


def _is_there(path: Path) -> bool:
    """Whether there is such an entry; a name that is too long is an error."""
    with suppress(FileNotFoundError, NotADirectoryError):
        path.lstat()
        return True
    return False


def _require_writable(folder: Path, wanted: Path) -> None:
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputRefusedError(f"{wanted}: {folder} may not be written to; choose another folder.")


def _remember(folder: Path) -> None:
    """The renames are done: what the disk says to them changes nothing any more."""
    with suppress(OSError):
        synced(folder)
        synced(folder.parent)
