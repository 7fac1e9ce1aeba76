"""Reading files within bounds."""

import codecs
import difflib
import errno
import os
import stat
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from jaxink.errors import InputRefusedError

_LONGEST_SHOWN = 200
_BLOCK_BYTES = 1 << 20
_OTHER_KINDS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def shown_path(path: str | Path) -> str:
    """A path for a message: on one line, and shortened if very long."""
    text = str(path)
    text = text if text.isprintable() else ascii(text)
    half = _LONGEST_SHOWN // 2
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:half]}...{text[-half:]}"


@contextmanager
def open_bounded(
    path: str | Path, limit_bytes: int, what: str, others: Collection[Path] = ()
) -> Iterator[BinaryIO]:
    """Open a regular file for reading; anything that would block, never end or be too large is rejected.

    Parameters
    ----------
    path
        The file.
    limit_bytes
        Largest size allowed.
    what
        Expected kind of file, such as ``sample file``, for messages.
    others
        Files that are known to be something else, not suggested for a missing one.

    Raises
    ------
    InputRefusedError
        If the file is missing, not a regular file, too large, or cannot be read; also while it is being read.
    """
    name = shown_path(path)
    if "\0" in str(path):
        raise InputRefusedError(f"{name}: a file name cannot contain a zero byte; give a {what}.")
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            _require_ordinary(os.fstat(file.fileno()), name, limit_bytes, what)
            yield file
    except FileNotFoundError:
        raise InputRefusedError(f"{name}: there is no such {what}{_near(Path(path), others)}.") from None
    except IsADirectoryError:
        raise InputRefusedError(f"{name}: is a directory; give a {what}.") from None
    except OSError as problem:
        if problem.errno == errno.ENAMETOOLONG:
            text = f"the name is too long for a file; give a {what}"
        else:
            text = f"cannot be read ({problem.strerror or problem})"
        raise InputRefusedError(f"{name}: {text}.") from None


def read_bounded(path: str | Path, limit_bytes: int, what: str, others: Collection[Path] = ()) -> bytes:
    """Content of a regular file; parameters and errors as for `open_bounded`."""
    with open_bounded(path, limit_bytes, what, others) as file:
        content = bytearray()
        # The reported size is no bound: files may grow, and those of the system report 0.
        while block := file.read(_BLOCK_BYTES):
            content += block
            _require_size(len(content), shown_path(path), limit_bytes, what)
    return bytes(content)


def utf8_text(content: bytes, name: str) -> str:
    """Text of a UTF-8 file without a byte-order mark; a message about another encoding names file and row."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise InputRefusedError(f"{name}: is UTF-16 text; save it as UTF-8.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        row, byte = content[: problem.start].count(b"\n") + 1, content[problem.start]
        raise InputRefusedError(
            f"{name}, row {row}: byte 0x{byte:02x} is not UTF-8 text; save the file as UTF-8."
        ) from None


def _without_waiting(path: str, flags: int) -> int:
    """Open a file without blocking, as a pipe would until somebody writes to it."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _require_ordinary(found: os.stat_result, name: str, limit_bytes: int, what: str) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = next((kind for is_kind, kind in _OTHER_KINDS if is_kind(found.st_mode)), "not a regular file")
        raise InputRefusedError(f"{name}: is {kind}; save the {what} as a regular file.")
    _require_size(found.st_size, name, limit_bytes, what)


def _require_size(n_bytes: int, name: str, limit_bytes: int, what: str) -> None:
    if n_bytes > limit_bytes:
        raise InputRefusedError(
            f"{name}: is too large; a {what} may have at most {limit_bytes / 1e6:.3g} MB."
        )


def _near(path: Path, others: Collection[Path]) -> str:
    """Hint at the most similar name in the folder of a missing file."""
    try:
        names = [entry.name for entry in path.parent.iterdir() if entry not in others]
    except OSError:
        return ""
    near = difflib.get_close_matches(path.name, names, n=1)
    return f"; the most similar name there is {near[0]}" if near else ""
