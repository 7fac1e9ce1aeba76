"""Files that are written whole or not at all, and values as JSON holds them."""

import dataclasses
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np


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
        Beside it, so that the last step is a rename within one file system.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def plain(value: Any) -> Any:
    """Strings, numbers, lists and None; numbers that are not finite become None.

    Parameters
    ----------
    value
        Of dataclasses, dictionaries, sequences, arrays and numbers.

    Returns
    -------
    Any
        As `json.dumps` takes it.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, tuple | list):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
