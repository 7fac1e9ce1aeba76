"""Reading a measurement from one file or several; every row keeps its file and its row there."""

from collections.abc import Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.netcdf import read_dataset
from jaxink.files.reading import open_bounded
from jaxink.measurement.conditions import refuse_several_conditions
from jaxink.measurement.dataset import FILE_COLUMN, GonioData
from jaxink.measurement.formats.catalogue import HEAD_BYTES, format_of, read_exchange
from jaxink.measurement.formats.exchange_options import STATED_BY
from jaxink.measurement.netcdf import MOST_BYTES
from jaxink.measurement.pairs import direction_groups
from jaxink.measurement.rows import Conditions
from jaxink.measurement.sheets import Wanted, wanted_of
from jaxink.measurement.table import AS_CSV, TextTable, is_frame, kind_of, refusal, table_of
from jaxink.measurement.text_file import FROM_ITS_SOURCE, FROM_PYTHON, read_table, remedy_for
from jaxink.measurement.tidy import ReadOptions, measurement_of, stated_conditions
from jaxink.measurement.workbook import EXCEL_SUFFIXES, OPENDOCUMENT_SUFFIXES, read_sheets

_CSV_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc")
_WORKBOOK_SUFFIXES = (*EXCEL_SUFFIXES, *OPENDOCUMENT_SUFFIXES)
_REGULAR = (
    "is a list of regular reflectances or transmittances, not of BSDFs",
    "read it with jaxink.read_readings, or name it as readings in a project",
)
# What these files are.
_FOREIGN = {
    ".xls": ("is a workbook of Excel 2003 or older", AS_CSV),
    ".xlsb": ("is a binary workbook of Excel", AS_CSV),
    ".numbers": ("is a workbook of Numbers", "export it as CSV (in Numbers: File, Export To, CSV)"),
    ".pdf": ("is a document", FROM_ITS_SOURCE),
    ".mat": (
        "is a file of Matlab",
        "write its arrays as a table there (writetable, or writematrix for a matrix)",
    ),
    ".npy": ("is an array of numpy", FROM_PYTHON),
    ".npz": ("is an archive of numpy arrays", FROM_PYTHON),
    ".pkl": ("is a pickle of Python", FROM_PYTHON),
    ".parquet": ("is a table in parquet", FROM_PYTHON),
    ".json": ("is a JSON file", FROM_PYTHON),
    ".sdr": _REGULAR,
    ".sdt": _REGULAR,
    ".toml": ("is a sample file, not a measurement", "give it with --sample, and the measurement as DATA"),
}
# Of exchange files; their content, not the name, says which format they have.
_EXCHANGE_SUFFIXES = (".bsdf", ".brdf", ".btdf", ".anisotropicbsdf", ".astm", ".binary", ".ddr", ".ddt")
# What may be stated for each of several files.
ONE_A_FILE = ("side", "theta_i_deg")
# What only exchange files leave open.
_EXCHANGE_ONLY = {*STATED_BY} - {"wavelength_nm", "side", "theta_i_deg", "cosine_weighted"}
# A file, or a table in memory such as a pandas DataFrame.
Source = str | Path | Any
_COLUMNS = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "is_transmission", "bsdf_per_sr")
# Between the workbook and the sheet in the name of what was read.
_SHEET = ", sheet "


def read(path: Source | Sequence[Source], **overrides: Any) -> GonioData:
    """Read a measurement; files of instruments and ray tracers are recognised by their content.

    Parameters
    ----------
    path
        A text table (``.csv``, ``.txt``, ``.tsv``, ``.dat``, ``.asc``), a workbook (``.xlsx``, ``.xlsm``,
        ``.ods``), a ``.nc`` file of ``GonioData.to_netcdf``, or a file of any name in one of the formats of
        `jaxink.measurement.formats`. The rows of several files, given as a list, are joined; each keeps its
        file (extra column ``source_file``) and its row there. A table in memory with named columns, a pandas
        DataFrame or a dict of columns, is read as a text table; its rows are counted from 0, as by ``iloc``.
    **overrides
        Keyword arguments of ``read_csv`` or ``read_workbook``; for other formats the fields of
        `jaxink.measurement.formats.exchange_options.ExchangeOptions`; none for a netCDF file. With several
        files, ``side`` and ``theta_i_deg`` may be lists with one entry for each.

    Raises
    ------
    InputRefusedError
        If a file cannot be read as a BSDF measurement.
    """
    if is_frame(path):
        return _read_frame(path, kind_of(path), **overrides)
    if isinstance(path, str | Path):
        path = [path]
    if not isinstance(path, Sequence) or not all(isinstance(p, str | Path) or is_frame(p) for p in path):
        kind = type(path).__name__
        raise InputRefusedError(
            f"what to read is of type {kind}; it must be a file, a DataFrame, a dict of columns, or a list "
            "of these."
        )
    paths = list(path)
    if not paths:
        raise InputRefusedError("there is no measurement file; give at least one.")
    of_files = overrides_of_files(len(paths), overrides)
    read_parts = [
        (file, _parts(file, f"{kind_of(file)} {k + 1}", **of_files[k])) for k, file in enumerate(paths)
    ]
    parts = [(file, part) for file, held in read_parts for part in held]
    names = [part.source for _, part in parts]
    # Files with the same name are told apart by their folders.
    return _joined(
        [
            part.replace(source=part.source.replace(Path(file).name, str(file), 1))
            if names.count(part.source) > 1
            else part
            for file, part in parts
        ]
    )


def read_conditions(path: str | Path, **overrides: Any) -> list[Conditions]:
    """Read which conditions a file states: of the whole file, or of each sheet that the caller wants.

    Parameters
    ----------
    path
        The file. Those of instruments and ray tracers, and netCDF files, state none by columns.
    **overrides
        Keyword arguments of ``read_csv`` or ``read_workbook``.

    Raises
    ------
    InputRefusedError
        If the file cannot be read, or ``rows`` names what it does not have.
    """
    path = Path(path)
    with open_bounded(path, MOST_BYTES, "measurement file") as file:
        is_exchange = format_of(file.read(HEAD_BYTES)) is not None
    suffix = path.suffix.lower()
    if is_exchange or suffix not in (*_CSV_SUFFIXES, *_WORKBOOK_SUFFIXES):
        return []
    _refuse_options_of_exchange(path, overrides)
    if suffix in _WORKBOOK_SUFFIXES:
        return [stated_conditions(*each) for each in _sheet_tables(path, **overrides)]
    stated = _stated({name: value for name, value in overrides.items() if name != "sheet"})
    return [stated_conditions(read_table(path, stated.columns.values(), stated.edges), stated)]


def overrides_of_files(n_files: int, overrides: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What is stated about each of several files: the same for all, or entries of a list."""
    each = {name: _of_each(name, overrides.get(name), n_files) for name in ONE_A_FILE}
    shared = {name: value for name, value in overrides.items() if name not in ONE_A_FILE}
    return [
        shared | {name: values[k] for name, values in each.items() if values[k] is not None}
        for k in range(n_files)
    ]


def _joined(parts: list[GonioData]) -> GonioData:
    return parts[0] if len(parts) == 1 else join(parts)


def _of_each(name: str, values: Any, n_files: int) -> list[Any]:
    """What is stated about each file, given once for all or in a list with one entry for each."""
    if values is None or isinstance(values, str | Real):
        return [values] * n_files
    if len(values) not in (1, n_files):
        files = "1 file" if n_files == 1 else f"{n_files} files"
        text = f"{name} has {len(values)} entries for {files}; give one for each file"
        if name == "side":
            text += ", or for sheets of a workbook with their names, such as --sheet A=R,B=T"
        raise InputRefusedError(f"{text}.")
    return [*values] * (n_files if len(values) == 1 else 1)


def _parts(path: Source, called: str, **overrides: Any) -> list[GonioData]:
    """What a file contains: one measurement, or one of each sheet that the caller wants."""
    if is_frame(path):
        return [_read_frame(path, called, **overrides)]
    path = Path(path)
    with open_bounded(path, MOST_BYTES, "measurement file") as file:
        head = file.read(HEAD_BYTES)
    if (found := format_of(head)) is not None:
        overrides.pop("needs_values", None)
        return [read_exchange(path, found, overrides)]
    if path.suffix.lower() in _WORKBOOK_SUFFIXES:
        _refuse_options_of_exchange(path, overrides)
        return _read_sheets(path, **overrides)
    return [_read_file(path, head, **overrides)]


def _read_frame(frame: Any, called: str, **overrides: Any) -> GonioData:
    if other := sorted(({*_EXCHANGE_ONLY} | {"sheet", "matrix"}) & overrides.keys()):
        raise refusal(called, f"is a table in memory, for which {other[0]} has no meaning; leave it out")
    stated = _stated(overrides)
    return measurement_of(table_of(frame, called), stated)


def _stated(overrides: Mapping[str, Any]) -> ReadOptions:
    return ReadOptions(**{name: value for name, value in overrides.items() if value is not None})


def _refuse_options_of_exchange(path: Path, overrides: Mapping[str, Any]) -> None:
    if other := sorted(_EXCHANGE_ONLY & overrides.keys()):
        option = STATED_BY[other[0]].partition(" ")[0]
        raise refusal(path, f"is a table of its own, for which {option} has no meaning; leave it out")


def _read_file(path: Path, head: bytes, **overrides: Any) -> GonioData:
    _refuse_options_of_exchange(path, overrides)
    suffix = path.suffix.lower()
    if suffix in _CSV_SUFFIXES:
        if "sheet" in overrides:
            raise refusal(path, "a text file has no sheets; leave out the sheet")
        return read_csv(path, **overrides)
    if suffix == ".nc":
        overrides.pop("needs_values", None)
        if overrides:
            raise refusal(path, f"a netCDF file is complete; do not give {', '.join(overrides)}")
        return read_netcdf(path)
    if suffix in _FOREIGN:
        what, remedy = _FOREIGN[suffix]
        unread = "" if (what, remedy) == _REGULAR else ", which jaxink does not read"
        raise refusal(path, f"{what}{unread}; {remedy}")
    if suffix in _EXCHANGE_SUFFIXES:
        text = f"the content is in none of the formats that jaxink knows, whatever the suffix '{suffix}' says"
        raise refusal(path, f"{text}; {remedy_for(head)}")
    known = ", ".join((*_CSV_SUFFIXES, *_WORKBOOK_SUFFIXES))
    raise refusal(path, f"the suffix is '{suffix}'; it must be one of {known}, .nc; {remedy_for(head)}")


def read_netcdf(path: str | Path) -> GonioData:
    """Read a measurement written by `GonioData.to_netcdf`, identical to the last bit.

    Raises
    ------
    InputRefusedError
        If the file is missing, not a netCDF file, or has another schema.
    """
    path = Path(path)
    return GonioData.from_dataset(read_dataset(path, MOST_BYTES, "measurement file"), str(path))


def read_csv(
    path: str | Path,
    *,
    wavelength_nm: float | None = None,
    side: str | None = None,
    sample: str | None = None,
    columns: Mapping[str, str] | None = None,
    signed_angles: bool = False,
    cosine_weighted: bool = False,
    theta_i_deg: float | None = None,
    phi_deg: float | None = None,
    phi_o_deg: float | None = None,
    matrix: str | Sequence[str] | None = None,
    needs_values: bool = True,
    rows: Mapping[str, Any] | None = None,
) -> GonioData:
    """Read a text table: each row is the BSDF value of one pair of directions, or each cell of a matrix.

    The columns are separated by commas, semicolons or tabs. Decimal commas, lines of a title above the
    header, a row of units below it, and text in UTF-16 or Latin-1 are understood and noted.

    Columns theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, side (R or T) and bsdf_per_sr are required,
    sigma_per_sr is optional, others are kept. Rows keep their order. Rows with equal directions are repeats;
    if another column says that conditions differed (`jaxink.measurement.conditions`), they are rejected.

    Parameters
    ----------
    path
        The file.
    wavelength_nm
        Wavelength of all rows, if the file does not state it.
    side
        ``"R"`` or ``"T"`` for all rows, if the file does not state it.
    sample
        The sample to read, if column ``sample`` contains several.
    columns
        Names of known columns in the file, for instance ``{"theta_o_deg": "detector angle"}``.
    signed_angles
        Whether a negative ``theta_o_deg`` means the other half-plane: phi is turned by 180 degrees. Without a
        column ``phi_deg``, phi is 180 (towards the peak) at positive and 0 (towards the source) at negative
        angles.
    cosine_weighted
        Whether the values are the BSDF times cos(theta_o), by which they are then divided.
    theta_i_deg, phi_deg, phi_o_deg
        Angle of all rows in degrees, if the file does not state it: of incidence, relative azimuth, azimuth
        of view (with a column or a title ``phi_i_deg``).
    matrix
        For values in a matrix that does not say what its edges are: the quantity down the first column and
        that along the row above the values, such as ``("theta_o_deg", "theta_i_deg")``; of a wide table with
        several columns left of the values, the latter only.
    needs_values
        Whether the column ``bsdf_per_sr`` is required. A table of directions for a prediction may lack it;
        all values are then 0.
    rows
        Which rows to read, if the file has several conditions: the cell by column, for instance
        ``{"lit_side": "ink"}``. Numbers are compared as numbers.

    Returns
    -------
    GonioData
        With ``notes`` on everything that was changed, and negative values masked.

    Raises
    ------
    InputRefusedError
        If the file is invalid; the message names file, row and column.
    """
    stated = ReadOptions(
        wavelength_nm,
        side,
        sample,
        columns or {},
        signed_angles,
        cosine_weighted,
        theta_i_deg,
        phi_deg,
        phi_o_deg,
        matrix,
        needs_values,
        rows or {},
    )
    return measurement_of(read_table(Path(path), stated.columns.values(), stated.edges), stated)


def read_workbook(path: str | Path, *, sheet: Wanted | None = None, **overrides: Any) -> GonioData:
    """Read a table as in `read_csv` from a sheet of a workbook, or from several, which are joined.

    Parameters
    ----------
    path
        The workbook.
    sheet
        Name of the sheet, or a list of names; None: the only one that is not empty. A sheet without a column
        for the side has that of its name (such as Reflexion), or the one stated: ``{"A": "R", "B": "T"}``, or
        ``"A=R,B=T"``.
    **overrides
        Keyword arguments of `read_csv`.

    Raises
    ------
    InputRefusedError
        As for `read_csv`, or if several sheets are not empty and none is stated.
    """
    return _joined(_read_sheets(Path(path), sheet=sheet, **overrides))


def _read_sheets(path: Path, sheet: Any = None, **overrides: Any) -> list[GonioData]:
    return [measurement_of(*each) for each in _sheet_tables(path, sheet, **overrides)]


def _sheet_tables(path: Path, sheet: Any = None, **overrides: Any) -> list[tuple[TextTable, ReadOptions]]:
    """The wanted sheets, and what is stated about each."""
    stated = _stated(overrides)
    sheets = read_sheets(path, wanted_of(sheet), stated.columns.values(), stated.edges)
    return [
        (each.table, stated if each.side is None else stated.of_side(each.side, each.table.source))
        for each in sheets
    ]


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
