"""A diagnosis that was stopped: what of it is finished, and whether it belongs to the present input."""

import dataclasses
import enum
import json
import shutil
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from jaxink.diagnosis.search.checkpoint import Checkpoint, code_version
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.effects import CATALOGUE
from jaxink.errors import InputRefusedError
from jaxink.files.decoding import read_json
from jaxink.files.reading import shown_path
from jaxink.files.writing import written_whole
from jaxink.fitting import FitResult, load_result, read_inputs
from jaxink.measurement import GonioData
from jaxink.numerics.fingerprint import fingerprint
from jaxink.numerics.named_files import read_named, write_named
from jaxink.sample import Sample

_ABOUT, _DECLARED = "about.json", "declared"
# It ties the fit in the folder `_DECLARED` to the input.
_TIE = "declared.tie"
_LARGEST_ABOUT_BYTES = 10_000


class FolderState(enum.Enum):
    """What a folder contains; the value is a sentence about it."""

    SAME = "the diagnosis goes on where it was stopped"
    EMPTY = "there is nothing to go on from; the diagnosis begins anew"
    OTHER_INPUT = (
        "what is there belongs to another measurement, sample or other options; it is not used, and the "
        "diagnosis begins anew"
    )
    OTHER_CODE = (
        "what is there was computed by another version of jaxink or of its libraries; it is not used, and "
        "the diagnosis begins anew"
    )
    UNKNOWN = "effects of your own cannot be recognised in another process; the diagnosis begins anew"


class Unfinished:
    """Folder of the finished pieces of one diagnosis.

    Parameters
    ----------
    folder
        Created by the first piece; `clear` removes it once the result is saved.
    data, sample, options
        See `diagnose`; another time limit makes no difference.

    Attributes
    ----------
    origin
        What the folder contains.
    """

    def __init__(
        self,
        folder: str | Path,
        data: GonioData | str | Path | Sequence[str | Path],
        sample: Sample | str | Path,
        options: DiagnosisOptions | None = None,
    ):
        self.folder = Path(folder)
        options = dataclasses.replace(options or DiagnosisOptions(), time_limit_s=None)
        self._own = tuple(effect for effect in options.catalogue if effect not in CATALOGUE)
        self._about = {
            "input": fingerprint(*read_inputs(data, sample), options),
            "code": code_version(),
        }
        self.origin = self._origin()

    @property
    def sentence(self) -> str:
        """What the folder contains, for a user."""
        return f"{shown_path(self.folder)}: {self.origin.value}."

    def begin(self, fitted: FitResult) -> Checkpoint:
        """Keep the fit of the declared model; remove what belongs to another diagnosis; return the pieces."""
        if self.origin is FolderState.SAME:
            return Checkpoint(self.folder)
        self.clear()
        if self._about["input"] is None:
            return Checkpoint()
        self._declare()
        self.keep(fitted)
        return Checkpoint(self.folder)

    def clear(self) -> None:
        """Remove the folder, if a diagnosis has made it."""
        if (self.folder / _ABOUT).exists():
            shutil.rmtree(self.folder, ignore_errors=True)
        self.origin = self._origin()

    def fitted(self) -> FitResult | None:
        """Fit of the declared model, if it is there."""
        if self.origin is not FolderState.SAME:
            return None
        with suppress(InputRefusedError):
            fitted = load_result(self.folder / _DECLARED, self._own)
            if read_named(self.folder / _TIE, str(self._about["input"])) == fitted.result_id.encode():
                return fitted
        return None

    def keep(self, fitted: FitResult) -> None:
        """Keep the fit of the declared model."""
        if self._about["input"] is not None:
            with suppress(InputRefusedError, OSError):
                fitted.save(self.folder / _DECLARED)
                write_named(self.folder / _TIE, self._about["input"], fitted.result_id.encode())

    def _declare(self) -> None:
        """Write what the folder belongs to; without space there will be nothing to go on from."""
        with suppress(OSError, InputRefusedError):
            self.folder.mkdir(parents=True, exist_ok=True)
            with written_whole(self.folder / _ABOUT) as part:
                part.write_text(json.dumps(self._about), encoding="utf-8")

    def _origin(self) -> FolderState:
        if self._about["input"] is None:
            return FolderState.UNKNOWN
        try:
            there = read_json(self.folder / _ABOUT, _LARGEST_ABOUT_BYTES, "file")
            same = {key: there[key] == value for key, value in self._about.items()}
        except (InputRefusedError, KeyError, TypeError):
            return FolderState.EMPTY
        if not same["code"]:
            return FolderState.OTHER_CODE
        return FolderState.SAME if same["input"] else FolderState.OTHER_INPUT
