"""What jaxink computes as plain data, as JSON, and as a folder; `jaxink.files.decoding` is the way back."""

import abc
import dataclasses
import json
import math
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jaxink.files.writing import whole_folder


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


def json_text(data: Any) -> str:
    """Plain data as text.

    Parameters
    ----------
    data
        As `plain` makes it.
    """
    return json.dumps(data, indent=1, allow_nan=False)


class SavedInFolder(abc.ABC):
    """What is saved as a folder: a file of JSON, and what JSON does not hold beside it."""

    json_file: ClassVar[str]

    @abc.abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in the file of JSON."""

    def files_beside(self) -> dict[str, bytes | memoryview]:
        """Content of the other files, by name."""
        return {}

    def save(self, directory: str | Path) -> Path:
        """Write the files, all or none.

        Parameters
        ----------
        directory
            Made if it does not exist.

        Returns
        -------
        Path
            Of the file of JSON.

        Raises
        ------
        InputRefusedError
            If the directory cannot be written.
        """
        with whole_folder(directory) as folder:
            self.write_into(folder)
        return Path(directory) / self.json_file

    def write_into(self, folder: Path) -> None:
        """Write the same files into a folder that, with more in it, is about to take its place as a whole.

        Parameters
        ----------
        folder
            As `whole_folder` yields it.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        for name, content in self.files_beside().items():
            (folder / name).write_bytes(content)
        (folder / self.json_file).write_text(json_text(self.to_dict()) + "\n", encoding="utf-8")
