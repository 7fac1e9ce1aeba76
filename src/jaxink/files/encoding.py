"""Results as plain data, as JSON, and as a folder; `jaxink.files.decoding` is the inverse."""

import abc
import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jaxink.files.writing import whole_folder


def plain(value: Any) -> Any:
    """Convert dataclasses, dictionaries, sequences, arrays and numbers to data that `json.dumps` accepts.

    Non-finite numbers become None.
    """
    # Most values are these, and a result has thousands.
    kind = type(value)
    if kind is float:
        return value if math.isfinite(value) else None
    if kind is str or kind is int or kind is bool or value is None:
        return value
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


def json_text(data: Any) -> str:
    """JSON text of the data that `plain` returns, with a line for each entry of the first two levels.

    Indenting all levels takes ten times as long, as Python's fast encoder does not indent.
    """
    return _opened(data, lambda inner: _opened(inner, _compact, " "), "")


def _opened(data: Any, written: Callable[[Any], str], margin: str) -> str:
    """A table or list with a line for each entry."""
    if isinstance(data, dict) and data:
        lines, brackets = [f"{_compact(str(key))}: {written(value)}" for key, value in data.items()], "{}"
    elif isinstance(data, list) and any(isinstance(value, dict | list) for value in data):
        lines, brackets = [written(value) for value in data], "[]"
    else:
        return _compact(data)
    inside = ",\n".join(f"{margin} {line}" for line in lines)
    return f"{brackets[0]}\n{inside}\n{margin}{brackets[1]}"


def _compact(data: Any) -> str:
    return json.dumps(data, allow_nan=False)


class SavedInFolder(abc.ABC):
    """A result saved as a folder: a JSON file, and further files for what JSON does not hold."""

    json_file: ClassVar[str]
    # Folders that are replaced as a whole, because parts of an older result could remain.
    owned: ClassVar[tuple[str, ...]] = ()

    @abc.abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in the JSON file."""

    def files_beside(self) -> dict[str, bytes]:
        """Contents of the other files, by name, which may include a folder."""
        return {}

    def save(self, directory: str | Path) -> Path:
        """Write all files or none, and return the path of the JSON file.

        Parameters
        ----------
        directory
            Created if it does not exist.

        Raises
        ------
        InputRefusedError
            If the directory cannot be written.
        """
        with whole_folder(directory, self.owned) as folder:
            self.write_into(folder)
        return Path(directory) / self.json_file

    def files(self) -> dict[str, bytes]:
        """Contents of all files, by name."""
        text = json_text(self.to_dict()) + "\n"
        return {**self.files_beside(), self.json_file: text.encode()}

    def write_into(self, folder: Path) -> None:
        """Write the same files, among others, into a folder that `whole_folder` has yielded."""
        for name, content in self.files().items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
