"""Files and folders that are written whole or not at all."""

import errno
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jaxink.errors import InputRefusedError
from jaxink.files.exchange import must_stay, take_turns
from jaxink.files.moves import NEW, move_in, settle
from jaxink.files.reading import shown_path
from jaxink.files.staging import Stage, alone_in, staged_in, synced

_PAGE_BYTES = 4096


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
    OSError
        If it cannot be written; what was there before is then still there.
    """
    _require_name(path)
    settle(path.parent)
    with staged_in(path.parent) as stage:
        part = stage.path / path.name
        yield part
        synced(part)
        os.replace(part, path)
        _remember(path.parent)


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
    try:
        place = staging_place(out, owned)
        real = Path(os.path.realpath(out))
        for folder in {place, real}:
            settle(folder)
        with staged_in(place) as stage:
            new = stage.path / NEW
            new.mkdir()
            yield new
            for folder, _, files in os.walk(new):
                for path in (*(Path(folder, name) for name in files), Path(folder)):
                    synced(path)
            _take_place(stage, real, set(owned))
            _remember(real)
    except OSError as problem:
        raise InputRefusedError(
            f"{shown_path(out)}: the result cannot be written there ({problem.strerror or problem}); choose "
            "another folder."
        ) from None


def staging_place(out: str | Path, owned: Collection[str] = ()) -> Path:
    """Folder in which the content of another is staged: one of the same file system, that exists.

    Parameters
    ----------
    out, owned
        As of `whole_folder`.

    Returns
    -------
    Path
        Beside it, or in it where it has to remain the folder that it is.

    Raises
    ------
    OSError
        If it cannot be a folder.
    """
    _require_name(out)
    real = Path(os.path.realpath(out))
    if os.path.islink(out) and not real.exists():
        raise FileNotFoundError(errno.ENOENT, "it is a symbolic link to what does not exist")
    if real.is_dir():
        return real if must_stay(real, set(owned)) else real.parent
    while not real.is_dir():
        if os.path.lexists(real):
            raise NotADirectoryError(errno.ENOTDIR, f"{real} is a file")
        real = real.parent
    return real


def _require_name(path: str | Path) -> None:
    if "\0" in str(path):
        raise OSError(errno.EINVAL, "its name holds a zero byte, which no name can")


def require_room(folder: Path) -> None:
    """Write a little into an existing folder, and remove it again.

    Parameters
    ----------
    folder
        The folder.

    Raises
    ------
    OSError
        If that fails: then nothing else can be written there either.
    """
    with staged_in(folder) as stage:
        (stage.path / "room").write_bytes(bytes(_PAGE_BYTES))
        synced(stage.path / "room")


def _take_place(stage: Stage, out: Path, owned: set[str]) -> None:
    new = stage.path / NEW
    if not out.exists() and _is_taken(new, out):
        return
    written = set(os.listdir(new))
    with alone_in(out):
        if stage.path.parent != out:
            if take_turns(new, out, written | owned):
                return
            stage.move_into(out)
        move_in(stage, out, owned - written)


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


def _remember(folder: Path) -> None:
    """The renames are done: what the disk says to them changes nothing any more."""
    with suppress(OSError):
        synced(folder)
        synced(folder.parent)
