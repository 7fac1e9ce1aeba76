"""Places for output, refused before anything is computed if nothing can be written there."""

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.writing import require_room, staging_place


def require_folder(out: Path, owned: Collection[str] = ()) -> None:
    """Refuse a folder that cannot be written.

    Parameters
    ----------
    out
        Where results shall go.
    owned
        As of `jaxink.files.writing.whole_folder`.

    Raises
    ------
    InputRefusedError
        If it is a file, a symbolic link to nothing, lies below a file, or may not be written.
    """
    with _one_sentence(out):
        if out.is_symlink() and not out.exists():
            raise InputRefusedError(
                f"{out}: is a symbolic link to {out.readlink()}, which does not exist; create that folder, "
                "or name another one."
            )
        if out.exists() and not out.is_dir():
            raise InputRefusedError(f"{out}: is a file, but --out needs a folder; name another one.")
        at = out.absolute()
        while not at.exists():
            at = at.parent
        _require_writable(at, out)
        require_room(staging_place(out, owned))


def require_writable_file(path: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse a file that cannot be written; as `require_folder`."""
    if path.suffix not in suffixes:
        raise InputRefusedError(
            f"{shown_path(path)}: the suffix '{path.suffix}' is not one of {', '.join(suffixes)}, which name "
            "the format."
        )
    with _one_sentence(path):
        if path.is_dir():
            raise InputRefusedError(f"{path}: is a folder, but --out needs a file; name one inside it.")
        if path.exists() and not path.is_file():
            raise InputRefusedError(f"{path}: is a pipe or a device, but --out needs a file; name one.")
        if not path.absolute().parent.is_dir():
            raise InputRefusedError(f"{path}: the folder does not exist; create it first.")
        # A name that is too long is refused by this alone.
        path.is_symlink()
        _require_writable(path.absolute().parent, path)
        require_room(path.absolute().parent)


@contextmanager
def _one_sentence(wanted: Path) -> Iterator[None]:
    name = shown_path(wanted)
    try:
        yield
    except OSError as problem:
        raise InputRefusedError(
            f"{name}: nothing can be written there ({problem.strerror or problem}); choose another place for "
            "--out."
        ) from None


def _require_writable(folder: Path, wanted: Path) -> None:
    if not folder.is_dir():
        raise InputRefusedError(f"{wanted}: {folder} is a file, so nothing can be written below it.")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputRefusedError(f"{wanted}: {folder} may not be written to; choose another place for --out.")
