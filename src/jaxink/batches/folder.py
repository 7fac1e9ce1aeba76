"""The folder of a batch: what comes back for each measurement, which rows there are, and what is written."""

import dataclasses
import os
import platform
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from jaxink.batches.row import RESULTS, Row, RowOutcome, row_from_dict
from jaxink.batches.task import MeasurementTask, Unreadable
from jaxink.errors import InputRefusedError
from jaxink.files.decoding import read_json
from jaxink.files.encoding import json_text
from jaxink.files.writing import require_folder, whole_folder, written_whole

ROWS, _LOCK, _RUNNING = "rows", ".lock", "running.json"
_LARGEST_ROW_BYTES = 10_000_000


@dataclasses.dataclass(frozen=True)
class Done:
    """A row, and the contents of the files of its folder by their names there."""

    row: Row
    files: dict[str, bytes]


def trouble(
    task: MeasurementTask | Unreadable,
    outcome: RowOutcome,
    sentence: str,
    seconds: float = 0.0,
    attempts: int = 1,
) -> Done:
    """Answer without a result."""
    row = Row(task.name, task.paths, task.inputs, outcome, sentence, seconds=round(seconds, 3))
    return Done(dataclasses.replace(row, attempts=attempts, host=platform.node(), finished=now()), {})


def now() -> str:
    """Date and time, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


try:
    import fcntl
except ImportError:  # Windows: nothing keeps two batches apart.
    fcntl = None  # type: ignore[assignment]


class BatchFolder:
    """The folder of a batch.

    Parameters
    ----------
    path
        Created if it does not exist.

    Raises
    ------
    InputRefusedError
        If it cannot be written, or if the folders in it are links: what is replaced there would be
        somebody else's.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        require_folder(self.path)
        for folder in (self.path, self.path / RESULTS, self.path / ROWS):
            if folder is not self.path and folder.is_symlink():
                raise InputRefusedError(
                    f"{folder}: is a symbolic link, and a batch removes old results there; remove the link."
                )
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as problem:
                raise InputRefusedError(f"{folder}: cannot be created ({problem.strerror}).") from None

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other batches out of the folder; the system releases it when the process ends in any way."""
        if fcntl is None:
            yield
            return
        with open(self._lock(), "rb") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise InputRefusedError(
                    f"{self.path}: another batch is writing to this folder; wait for its end, or choose "
                    "another one."
                ) from None
            yield

    def _lock(self) -> int:
        """The file that is locked; it is neither emptied nor, as a link, followed."""
        file = self.path / _LOCK
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        if file.is_symlink():
            raise InputRefusedError(f"{file}: is a symbolic link; remove it.")
        try:
            descriptor = os.open(file, flags, 0o666)
        except OSError as problem:
            raise InputRefusedError(f"{file}: cannot be opened ({problem.strerror}); remove it.") from None
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            os.close(descriptor)
            raise InputRefusedError(f"{file}: is not a regular file; remove it.")
        return descriptor

    def row(self, name: str) -> Row | None:
        """The row of a measurement; None if there is none, or if its file is damaged."""
        file = self._file_of(name)
        if not file.exists():
            return None
        try:
            row = row_from_dict(read_json(file, _LARGEST_ROW_BYTES, "row"))
        except InputRefusedError:
            return None
        if row.name != name or (row.ended.has_result and not self._has_page(row)):
            return None
        return row

    def _has_page(self, row: Row) -> bool:
        """Whether the page is there, and not elsewhere by a link."""
        page = self.path / row.page
        return page.is_file() and page.resolve().is_relative_to(self.path.resolve() / RESULTS / row.name)

    def names(self) -> set[str]:
        """Names of all rows, also of those of an earlier plan."""
        return {file.stem for file in (self.path / ROWS).glob("*.json")}

    def write(self, done: Done) -> None:
        """Write the files of a measurement whole, and then its row, which says that they are there."""
        place = self.path / RESULTS / done.row.name
        # Of other inputs; without its page, an old row counts as absent.
        if place.is_symlink() or place.is_file():
            place.unlink()
        shutil.rmtree(place, ignore_errors=True)
        if done.files:
            with whole_folder(place) as folder:
                for name, content in done.files.items():
                    (folder / name).parent.mkdir(parents=True, exist_ok=True)
                    (folder / name).write_bytes(content)
        self.write_row(done.row)

    def write_row(self, row: Row) -> None:
        """Write a row alone; whatever there is in its folder of results stays."""
        with written_whole(self._file_of(row.name)) as part:
            part.write_text(json_text(row.to_dict()) + "\n", encoding="utf-8")

    def _file_of(self, name: str) -> Path:
        return self.path / ROWS / f"{name}.json"

    def tries(self) -> dict[str, int]:
        """How often this process, or one before it, has begun a measurement that has no row."""
        file = self.path / _RUNNING
        if not file.exists():
            return {}
        try:
            found = read_json(file, _LARGEST_ROW_BYTES, "note of a batch")
        except InputRefusedError:
            return {}
        known = found.items() if isinstance(found, dict) else ()
        return {name: count for name, count in known if isinstance(count, int)}

    def note_tries(self, tries: dict[str, int]) -> None:
        """Keep these numbers for the case that the process ends."""
        with written_whole(self.path / _RUNNING) as part:
            part.write_text(json_text(tries), encoding="utf-8")
