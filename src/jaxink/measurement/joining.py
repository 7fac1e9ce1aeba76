"""One measurement from several files; every row keeps its file and its row there."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jaxink.measurement.conditions import refuse_several_conditions
from jaxink.measurement.dataset import FILE_COLUMN, GonioData
from jaxink.measurement.pairs import direction_groups
from jaxink.measurement.table import refusal

_COLUMNS = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "is_transmission", "bsdf_per_sr")
# Between the workbook and the sheet in the name of what was read.
_SHEET = ", sheet "


def join(parts: Sequence[GonioData]) -> GonioData:
    """Measurements of one sample as a single one, in the order given.

    The extra column ``source_file`` names the file of each row. A column that one of the files lacks is empty
    in its rows.

    Raises
    ------
    InputRefusedError
        If two files have the same name or state different samples, only some have ``sigma_per_sr``, or rows
        with equal directions were measured under different conditions.
    """
    names = [part.source for part in parts]
    for name in names:
        if names.count(name) > 1:
            raise refusal(name, "is given twice; give each file once")
    _refuse_partial_sigma(parts)
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in (*_COLUMNS, "row")
    }
    sigma = [part.sigma_per_sr for part in parts if part.sigma_per_sr is not None]
    data = GonioData(
        **columns,
        mask=np.concatenate([part.mask for part in parts]),
        sigma_per_sr=np.concatenate(sigma) if sigma else None,
        extra=_extra(parts),
        source=" + ".join(names),
        attrs=_attributes(parts),
    )
    refuse_several_conditions(data)
    sizes = ", ".join(f"{part.source} ({len(part)} rows)" for part in parts)
    what = "sheets" if all(_SHEET in part.source for part in parts) else "files"
    notes = [f"{len(parts)} {what} were joined: {sizes}."]
    notes += _merged_notes(parts, what)
    return data.replace(notes=[*notes, *_shared_directions(data, parts)])


def _merged_notes(parts: Sequence[GonioData], what: str) -> list[str]:
    """The notes of all parts, each once and after those to which it applies."""
    found: dict[str, dict[str, None]] = {}
    for part in parts:
        for note in part.notes:
            found.setdefault(note, {})[part.source] = None
    return [f"{_places(list(sources), parts, what)}: {note}" for note, sources in found.items()]


def _places(sources: list[str], parts: Sequence[GonioData], what: str) -> str:
    if len(sources) == 1:
        return sources[0]
    if len(sources) == len(parts):
        return f"Both {what}" if len(parts) == 2 else f"All {what}"
    books, _, names = zip(*(source.rpartition(_SHEET) for source in sources), strict=True)
    return (
        f"{books[0]}, sheets {', '.join(names)}" if len({*books}) == 1 and books[0] else " and ".join(sources)
    )


def _refuse_partial_sigma(parts: Sequence[GonioData]) -> None:
    without = [part.source for part in parts if part.sigma_per_sr is None]
    if without and len(without) < len(parts):
        other = next(part.source for part in parts if part.sigma_per_sr is not None)
        text = f"has no column sigma_per_sr, but {other} has one; add it here, or remove it there"
        raise refusal(without[0], text)


def _extra(parts: Sequence[GonioData]) -> dict[str, np.ndarray]:
    """All other columns; one that is text in any file is text in all."""
    names = dict.fromkeys(name for part in parts for name in part.extra if name != FILE_COLUMN)
    joined: dict[str, np.ndarray] = {}
    for name in names:
        held = [part.extra.get(name) for part in parts]
        if all(values is None or values.dtype.kind == "f" for values in held):
            pieces = [
                np.full(len(part), np.nan) if values is None else values
                for part, values in zip(parts, held, strict=True)
            ]
        else:
            pieces = [
                np.full(len(part), "") if values is None else _as_text(values)
                for part, values in zip(parts, held, strict=True)
            ]
        joined[name] = np.concatenate(pieces)
    joined[FILE_COLUMN] = np.concatenate([np.full(len(part), part.source) for part in parts])
    return joined


def _as_text(values: np.ndarray) -> np.ndarray:
    if values.dtype.kind != "f":
        return values
    return np.array(["" if value != value else f"{value:.15g}" for value in values.tolist()])


def _attributes(parts: Sequence[GonioData]) -> Mapping[str, str | int | float]:
    joined: dict[str, str | int | float] = {}
    first: dict[str, str] = {}
    for part in parts:
        for name, value in part.attrs.items():
            if joined.setdefault(name, value) != value:
                text = (
                    f"states {name} = '{value}', but {first[name]} '{joined[name]}'; join files of one sample"
                )
                raise refusal(part.source, text)
            first.setdefault(name, part.source)
    return joined


def _shared_directions(data: GonioData, parts: Sequence[GonioData]) -> list[str]:
    """A note on directions that more than one of the files contains."""
    group = direction_groups(data)
    file = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    pairs = np.unique(np.column_stack([group, file]), axis=0)
    shared, first, count = np.unique(pairs[:, 0], return_index=True, return_counts=True)
    several = np.flatnonzero(count > 1)
    if not several.size:
        return []
    here = shared[several[0]]
    places = [
        data.place(int(np.flatnonzero((group == here) & (file == pairs[first[several[0]] + k, 1]))[0]))
        for k in range(2)
    ]
    which = "1 direction is" if several.size == 1 else f"{several.size} directions are"
    return [f"{which} in more than one file ({' and '.join(places)}); all rows were kept as repeats."]
