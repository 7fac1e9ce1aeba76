"""What comes back for one measurement."""

import dataclasses
import platform
from datetime import UTC, datetime

from jaxink.batches.row import Row, RowOutcome
from jaxink.batches.task import Task, Unreadable


@dataclasses.dataclass(frozen=True)
class Done:
    """A row, and the contents of the files of its folder by their names there."""

    row: Row
    files: dict[str, bytes]


def trouble(
    task: Task | Unreadable, outcome: RowOutcome, sentence: str, seconds: float = 0.0, attempts: int = 1
) -> Done:
    """Answer without a result."""
    row = Row(task.name, task.paths, task.inputs, outcome, sentence, seconds=round(seconds, 3))
    return Done(dataclasses.replace(row, attempts=attempts, host=platform.node(), finished=now()), {})


def now() -> str:
    """Date and time, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")
