"""Reading and checking plan files; anything unknown is rejected before a measurement is touched.

Keys of a plan file: tables, valid values and meanings.

`docs/manual/tables.py` generates the tables of docs/manual/batch.md from these.
"""

import dataclasses
from functools import cached_property
from pathlib import Path
from typing import Any

from jaxink.batches.listing import ListedMeasurement, listed_files, listed_rows
from jaxink.diagnosis import DiagnosisOptions
from jaxink.errors import InputRefusedError
from jaxink.fitting import FitOptions
from jaxink.sample import (
    Entry,
    Quantity,
    Sample,
    bounded,
    choice,
    document_of,
    load_sample,
    only,
    quoted,
    refuse_sample,
    require_version,
    table_of,
    text_of,
    true_or_false,
)

PLAN_VERSION = 1
WORK = ("fit", "diagnose", "both")
TOP = {
    "schema_version": Entry(f"`{PLAN_VERSION}`", "required", "version of the plan file"),
    "title": Entry("text", "the name of the file", "heading of the report"),
    "sample": Entry("a file", "required", "sample file of all measurements, from the folder of the plan"),
    "work": Entry(
        quoted(WORK),
        f'`"{WORK[0]}"`',
        "what is done for each measurement; `both`: a fit, and a diagnosis that begins with it",
    ),
    "figures": Entry("`true` or `false`", "`false`", "whether figures are drawn for each measurement"),
    "check_input": Entry(
        "`true` or `false`",
        "`true`",
        "whether a fit that misses the noise is tested for mistakes in the input, as `jaxink fit` does",
    ),
    "measurements": Entry("a table", "required", "which measurements, see below"),
    "reading": Entry("a table", "empty", "what the files do not state, see below"),
    "fit": Entry("a table", "empty", "options of the fits, see below"),
    "diagnosis": Entry("a table", "empty", "options of the diagnoses, see below"),
    "limits": Entry("a table", "empty", "limits of one measurement, see below"),
}
MEASUREMENTS = {
    "files": Entry(
        "a pattern such as `sheets/*.csv`, or a list of patterns",
        "this or `table`",
        "one measurement for each file, in the order of their names",
    ),
    "table": Entry("a CSV file", "this or `files`", "one measurement for each row, see below"),
}
READING = {
    "wavelength_nm": Entry("a number", "-", "wavelength of every row, if the files have no column for it"),
    "side": Entry(
        quoted(("R", "T")) + ", or a list",
        "-",
        "side of every row; a list with one entry for each file of a measurement",
    ),
    "sample": Entry("text", "-", "sample to read, if the column `sample` of the files has several"),
    "sheet": Entry(
        "text", "-", "sheet of a workbook, if several are not empty; `R,T` or `A=R,B=T` joins several"
    ),
    "matrix": Entry("text", "-", "edges of a matrix that does not name them: `theta_o_deg,theta_i_deg`"),
    "phi_deg": Entry("a number", "-", "relative azimuth of every row, if the files do not state it"),
    "phi_o_deg": Entry("a number", "-", "azimuth of view of every row, with one of incidence in the files"),
    "signed_angles": Entry(
        "`true` or `false`", "`false`", "a negative `theta_o_deg` means the other half-plane"
    ),
    "face": Entry(quoted(("front", "back")), "-", "face that the light meets, if the file has both"),
    "channel": Entry("text", "-", "colour channel, if the values are colours"),
    "rotation_deg": Entry("a number", "-", "rotation of the sample, if the file has several"),
    "angle_unit": Entry(quoted(("deg", "rad")), "-", "unit of the angles"),
    "theta_i_deg": Entry("a number, or a list", "-", "angle of incidence, if the files do not state it"),
    "specular_phi_deg": Entry("a number", "-", "azimuth of the specular direction"),
    "cosine_weighted": Entry("`true` or `false`", "-", "the values are the BSDF times cos(theta_o)"),
    "scale": Entry("a number", "-", "factor that makes the values BSDFs, if the files state none"),
    "every": Entry("an integer", "-", "every n-th angle of each axis only"),
    "columns": Entry("a table", "-", 'headers of columns that have other names: `{ theta_o_deg = "arm" }`'),
}
LIMITS = {
    "seconds": Quantity(
        "s",
        1.0,
        1e7,
        3600.0,
        meaning="longest time of one measurement, with all compilation; its process is ended then",
    ),
    "memory_gib": Quantity(
        "GiB",
        0.1,
        1e5,
        otherwise="90 % of the machine's, divided by the workers; unlimited with a scheduler of your own",
        meaning="most memory of the process of a worker; it is ended above it",
    ),
}


# Given by objects of Python only.
_NOT_IN_FILES = ("config", "fit", "catalogue", "policy")


@dataclasses.dataclass(frozen=True)
class Plan:
    """Measurements, the sample that they have in common, and what is done with each.

    Parameters
    ----------
    title
        Heading of the report.
    measurements
        In the order of the report.
    sample
        Of all measurements, apart from the values that each states.
    work
        ``fit``, ``diagnose`` or ``both``.
    fit, diagnosis
        Fields of `FitOptions` and of `DiagnosisOptions`.
    reading
        Keywords of `jaxink.read`.
    with_figures, checks_input
        Whether to draw figures, and to test a misfit for mistakes in the input.
    seconds
        Longest time of one measurement.
    memory_gib
        Most memory of a worker's process; None: see `jaxink.batch`.
    own_files
        The plan file, and the sample file and the table that it names.
    """

    title: str
    measurements: tuple[ListedMeasurement, ...]
    sample: Sample
    work: str = WORK[0]
    fit: dict[str, Any] = dataclasses.field(default_factory=dict)
    diagnosis: dict[str, Any] = dataclasses.field(default_factory=dict)
    reading: dict[str, Any] = dataclasses.field(default_factory=dict)
    with_figures: bool = False
    checks_input: bool = True
    seconds: float = LIMITS["seconds"].default or 0.0
    memory_gib: float | None = None
    own_files: tuple[Path, ...] = ()

    @cached_property
    def files(self) -> frozenset[Path]:
        """All files that the plan uses."""
        return frozenset(self.own_files).union(*(one.files for one in self.measurements))


def load_plan(path: str | Path) -> Plan:
    """Read a plan file and the sample file and the table of measurements that it names.

    Parameters
    ----------
    path
        TOML file as described in `docs/manual/batch.md`.

    Raises
    ------
    InputRefusedError
        If one of these files is invalid; the message names the file and the key, or the row and column.
    """
    path = Path(path)
    document = document_of(text_of(path, "plan"), str(path))
    try:
        refuse_sample(document, 'a plan names it with sample = "...", and lists the measurements.')
        only(document, TOP, "the file")
        require_version(document, PLAN_VERSION, "plans")
        tables = {name: table_of(document, name) for name in ("measurements", "reading", "fit", "limits")}
        tables["diagnosis"] = table_of(document, "diagnosis")
        work = choice({"work": WORK[0]} | document, "work", WORK, "the file")
        fit = _options(tables["fit"], FitOptions, "[fit]")
        diagnosis = _options(tables["diagnosis"], DiagnosisOptions, "[diagnosis]")
        if work == "fit" and diagnosis:
            raise InputRefusedError(
                '[diagnosis] has no effect with work = "fit"; write "diagnose" or "both".'
            )
        limits = _limits(tables["limits"])
        reading = _reading(tables["reading"])
        named = _file_named(document, "sample", path.parent, "sample")
        flags = {
            key: true_or_false(document, key, key == "check_input", key) for key in ("figures", "check_input")
        }
        only(tables["measurements"], MEASUREMENTS, "[measurements]")
        if len(tables["measurements"]) != 1:
            raise InputRefusedError(
                '[measurements] must have one key: files = "sheets/*.csv", or table = "sheets.csv".'
            )
    except InputRefusedError as problem:
        raise InputRefusedError(f"{path}: {problem}") from None
    sample = load_sample(named)
    sample.parameters.require_ranges()
    return Plan(
        title=str(document.get("title", path.stem)),
        measurements=_measurements(tables["measurements"], path, sample),
        sample=sample,
        work=work,
        fit=fit,
        diagnosis=diagnosis,
        reading=reading,
        with_figures=flags["figures"],
        checks_input=flags["check_input"],
        own_files=(path, named, *_tables_named(tables["measurements"], path)),
        **limits,
    )


def _file_named(table: dict[str, Any], key: str, folder: Path, what: str) -> Path:
    value = table.get(key)
    if not isinstance(value, str) or not value.strip():
        raise InputRefusedError(f'{key} is {value!r}; write {key} = "{what}.toml", the name of a file.')
    return folder / value


def _options(table: dict[str, Any], kind: type, where: str) -> dict[str, Any]:
    """Fields of a class of options; the class checks their values."""
    known = [field.name for field in dataclasses.fields(kind) if field.name not in _NOT_IN_FILES]
    only(table, known, where)
    try:
        kind(**table)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{where}: {problem}") from None
    return table


def _limits(table: dict[str, Any]) -> dict[str, float]:
    only(table, LIMITS, "[limits]")
    return {key: bounded(value, LIMITS[key], f"limits.{key}") for key, value in table.items()}


def _reading(table: dict[str, Any]) -> dict[str, Any]:
    only(table, READING, "[reading]")
    true_or_false(table, "signed_angles", False, "reading.signed_angles")
    for key in ("sample", "sheet", "matrix"):
        if not isinstance(table.get(key, ""), str):
            raise InputRefusedError(f"reading.{key} is {table[key]!r}; it must be text.")
    headers = table.get("columns", {})
    if not (isinstance(headers, dict) and all(isinstance(header, str) for header in headers.values())):
        raise InputRefusedError('reading.columns must be a table of text, such as { theta_o_deg = "arm" }.')
    sides = table.get("side", "R")
    for side in sides if isinstance(sides, list) and sides else [sides]:
        choice({"side": side}, "side", ("R", "T"), "[reading]")
    for key, unit in (("wavelength_nm", "nm"), ("phi_deg", "degrees"), ("phi_o_deg", "degrees")):
        value = table.get(key, 1.0)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputRefusedError(f"reading.{key} is {value!r}; it must be a number in {unit}.")
    return {key: value for key, value in table.items() if value is not False}


def _tables_named(table: dict[str, Any], path: Path) -> tuple[Path, ...]:
    return (_file_named(table, "table", path.parent, "sheets"),) if "table" in table else ()


def _measurements(table: dict[str, Any], path: Path, sample: Sample) -> tuple[ListedMeasurement, ...]:
    if "table" in table:
        try:
            (named,) = _tables_named(table, path)
        except InputRefusedError as problem:
            raise InputRefusedError(f"{path}: measurements.{problem}") from None
        return listed_rows(named, sample)
    try:
        return listed_files(table["files"], path.parent)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{path}: {problem}") from None
