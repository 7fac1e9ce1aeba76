"""Reading and checking project files; anything unknown is rejected."""

import copy
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeGuard

import jaxink.measurement
from jaxink.errors import InputRefusedError, no_such_name
from jaxink.measurement import GonioData, Readings
from jaxink.projects.conditions import KnownWords, Part
from jaxink.projects.project import OF, Measurement, Project
from jaxink.projects.schema import INSTRUMENT, MEASUREMENT, PROJECT_VERSION, READING, TOP
from jaxink.projects.splitting import Combinations, conditions_in, several_of, split
from jaxink.sample import (
    MIXED,
    Sample,
    document_of,
    layer_tables,
    only,
    opposite_medium,
    require_no_unused,
    require_version,
    sample_of_document,
    table_of,
    text_of,
    turned_over,
)
from jaxink.sample import TOP as SAMPLE_TOP

# What measurements have in common by name: the tables of the file, and the key of a measurement.
_SHARED = {"instruments": "instrument", "specimens": "specimen"}
_NO_SPECIMENS = "but there is no table [specimens.NAME]; add one with what differs, or use changes."
# What a mixture changes in its layer.
_OF_MIXTURE = {"mixture": MIXED}
# Tables whose parameters are named without them.
_NAMED_APART = ("effects", "inks")
# Tables of a sample file that a measurement may change; layers are changed by their names.
_CHANGED = tuple(key for key in SAMPLE_TOP if key not in ("schema_version", "layers", "lit_side"))


def load_project(path: str | Path, effects: Collection[Any] = ()) -> Project:
    """Read a project file, and the sample and the measurements that it names.

    Parameters
    ----------
    path
        TOML file as described in `docs/manual/projects.md`.
    effects
        Classes of effects of your own that the sample declares.

    Raises
    ------
    InputRefusedError
        One of these files is invalid; the message names the file and the key.
    """
    path = Path(path)
    return parse_project(text_of(path, "project"), str(path), path.parent, effects)


def parse_project(
    text: str,
    source: str = "project",
    folder: str | Path | None = None,
    effects: Collection[Any] = (),
) -> Project:
    """Parse the text of a project file; see `load_project`.

    Parameters
    ----------
    text
        TOML.
    source
        Name for messages.
    folder
        Folder of the files that the text names; None: the working folder.
    effects
        Classes of effects of your own that the sample declares.
    """
    document = document_of(text, source)
    at = Path(folder or ".")
    try:
        return _project(document, at, effects)
    except InputRefusedError as problem:
        sentence = str(problem)
        if sentence.startswith(source):
            raise
        raise InputRefusedError(f"{source}: {sentence}") from None


def _project(document: dict[str, Any], folder: Path, effects: Collection[Any]) -> Project:
    if "layers" in document and "measurements" not in document:
        raise InputRefusedError(
            "this is a sample file; give the measurement first, and the sample file as --sample, or write a "
            "project file with [[measurements]]."
        )
    only(document, TOP, "the project file")
    require_version(document, PROJECT_VERSION, "projects")
    common, home = _common_sample(document, folder)
    shared = {kind: _named_changes(document, kind) for kind in _SHARED}
    tables = document.get("measurements")
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise InputRefusedError(
            "there are no measurements; write a [[measurements]] table for each, with name and data."
        )
    conditions = []
    for i, table in enumerate(tables):
        with _named_in_messages(_called(table, i)):
            conditions.append(_conditions(table, folder))
    known = KnownWords(common, shared["specimens"], _backings(document), several_of(conditions))
    parts, measurements = [], []
    for i, table in enumerate(tables):
        with _named_in_messages(_called(table, i)):
            divided = split(table, conditions[i], known)
        for part in divided:
            with _named_in_messages(_called(part.table, i)):
                measurements.append(_measurement(part, common, shared, (folder, home), effects))
        parts += divided
    require_no_unused(table_of(common, "inks"), (one.sample for one in measurements))
    for kind, key in _SHARED.items():
        unused = set(shared[kind]) - {part.table.get(key) for part in parts}
        if unused:
            name = min(unused)
            raise InputRefusedError(
                f'[{kind}.{name}] belongs to no measurement; write {key} = "{name}" in those that it is of, '
                "or remove it."
            )
    return Project(tuple(measurements), str(document.get("title", "")))


def _called(table: Mapping[str, Any], position: int) -> str:
    """What messages call a measurement: its name, or its number if it has none."""
    name = table.get("name")
    return f"'{name}'" if isinstance(name, str) and name else f"{position + 1}"


@contextmanager
def _named_in_messages(which: str) -> Iterator[None]:
    """Begin a refusal with the measurement that it is about."""
    where = f"measurement {which}"
    try:
        yield
    except InputRefusedError as problem:
        is_named = str(problem).startswith(where)
        raise InputRefusedError(str(problem) if is_named else f"{where}: {problem}") from None


def _common_sample(document: dict[str, Any], folder: Path) -> tuple[dict[str, Any], Path]:
    """The tables of the common sample, and the folder of the files that they name."""
    given = document.get("sample")
    if isinstance(given, dict):
        return {"schema_version": 1} | given, folder
    if not isinstance(given, str) or not given.strip():
        raise InputRefusedError(
            f'sample is {given!r}; write sample = "sample.toml", the name of a sample file, or a table '
            "[sample] with the content of one."
        )
    path = folder / given
    return document_of(text_of(path, "sample"), str(path)), path.parent


def _named_changes(document: dict[str, Any], kind: str) -> dict[str, dict[str, Any]]:
    """Changes that several measurements share, by the name of their instrument or specimen."""
    found = table_of(document, kind)
    for name, table in found.items():
        _as_table(table, f"{kind}.{name}")
        if kind == "instruments":
            only(table, INSTRUMENT, f"[instruments.{name}]")
    return found


def _backings(document: dict[str, Any]) -> dict[str, Any]:
    """What the words for cards mean."""
    found = table_of(document, "backings")
    for word, given in found.items():
        if given is True or not isinstance(given, int | float | dict):
            raise InputRefusedError(
                f"backings.{word} is {given!r}; it must be a reflectance from 0 to 1, a table as [backing], "
                "or false for no backing."
            )
    return found


def _conditions(table: dict[str, Any], folder: Path) -> Combinations:
    """The conditions that the files of a measurement state."""
    files, name = table.get("data"), table.get("name")
    files = [files] if isinstance(files, str) else files
    is_complete = isinstance(name, str) and name and _are_files(files)
    if "readings" in table or not is_complete:
        # What is wrong with these is said where they are read.
        return []
    only(table_of(table, "reading"), READING, "reading")
    for column, cell in _as_table(table.get("rows", {}), "rows").items():
        if isinstance(cell, bool) or not isinstance(cell, str | int | float):
            raise InputRefusedError(
                f"rows.{column} is {cell!r}; it must be the text or the number of a cell of that column."
            )
    return conditions_in(table, folder)


def _measurement(
    part: Part,
    common: dict[str, Any],
    shared: Mapping[str, dict[str, dict[str, Any]]],
    folders: tuple[Path, Path],
    effects: Collection[Any],
) -> Measurement:
    table = part.table
    only(table, MEASUREMENT, "its table")
    folder, home = folders
    name = table.get("name")
    if not isinstance(name, str) or not name:
        raise InputRefusedError('has no name; write name = "thin", or another short word.')
    changed, owners = copy.deepcopy(common), dict[str, str]()
    for kind, key in _SHARED.items():
        owner = _owner(table, key, shared[kind], kind)
        if owner and owner in shared[kind]:
            owners |= dict.fromkeys(_apply(changed, shared[kind][owner], f"{kind}.{owner}"), owner)
    for owner, changes in part.stated.items():
        owners |= dict.fromkeys(_apply(changed, changes, owner), owner)
    owners |= dict.fromkeys(_apply(changed, table_of(table, "changes"), "changes"), name)
    sample = sample_of_document(changed, home, effects)
    names = {parameter: _named(parameter, owners) for parameter in sample.parameters}
    sample, names = _lit_from(table.get("lit_side"), sample, names)
    sample.parameters.require_ranges()
    return Measurement(name, _data(table, folder), sample, names, table.get("instrument", ""))


def _owner(table: dict[str, Any], key: str, known: Mapping[str, Any], kind: str) -> str:
    """Name of the instrument or specimen of a measurement; empty if it has none."""
    owner = table.get(key, "")
    if not isinstance(owner, str):
        raise InputRefusedError(f"{key} is {owner!r}; it must be a name.")
    if owner and owner == table["name"] and table.get("changes"):
        raise InputRefusedError(
            f"{key} is '{owner}', the name of the measurement, which has changes of its own; their "
            "parameters could not be told apart, so give one of them another name."
        )
    # An instrument may be a word for people only; a specimen without a table would say nothing.
    if owner and owner not in known and (kind == "specimens" or known):
        raise InputRefusedError(f"{key} is '{owner}', {no_such_name(known) if known else _NO_SPECIMENS}")
    return owner


def _apply(document: dict[str, Any], changes: Mapping[str, Any], where: str) -> list[str]:
    """Change the tables of a sample file in place; the beginnings of the names of what has changed."""
    layers = {layer.get("name"): layer for layer in layer_tables(document)}
    stems = []
    for key, value in changes.items():
        if key in layers:
            layers[key].update(_as_table(value, f"{where}.{key}"))
            stems += [f"{key}.{own}" for inner in value for own in _OF_MIXTURE.get(inner, (inner,))]
        elif key not in _CHANGED:
            known = ", ".join((*map(str, layers), *_CHANGED))
            raise InputRefusedError(
                f"{where}.{key} is neither a layer nor a table of a sample file; it may be one of: {known}."
            )
        elif value is False:
            document.pop(key, None)
        elif isinstance(value, dict):
            document[key] = _without_false({**_as_table(document.get(key, {}), key), **value})
            stems += [inner if key in _NAMED_APART else f"{key}.{inner}" for inner in value]
        else:
            document[key] = value
    return stems


def _without_false(table: dict[str, Any]) -> dict[str, Any]:
    """A table without the tables that a change has removed."""
    return {key: value for key, value in table.items() if value is not False or key == "contact"}


def _named(parameter: str, owners: Mapping[str, str]) -> str:
    """Name of a parameter in the project: with its owner if a measurement or an instrument changed it."""
    plain = parameter.partition("@")[0]
    for stem, owner in owners.items():
        if plain == stem or plain.startswith(f"{stem}."):
            return f"{owner}{OF}{parameter}"
    return parameter


def _lit_from(lit: Any, sample: Sample, names: dict[str, str]) -> tuple[Sample, dict[str, str]]:
    """The sample with the layer in front that is lit, and the names of its parameters."""
    ends = [layer.name for layer in (sample.layers[0], sample.layers[-1])]
    if lit is None or (lit == ends[0] and ends[0] != ends[1]) or lit == "front":
        return sample, names
    if lit not in (ends[1], "back"):
        raise InputRefusedError(
            f"lit_side is {lit!r}; it must be '{ends[0]}' or '{ends[1]}', the layer that is lit, or 'front' "
            "or 'back' in the order of the sample file."
        )
    if sample.layers[-1].opaque:
        raise InputRefusedError(
            f"lit_side is {lit!r}, but that layer is opaque: no light would pass it; give it a thickness."
        )
    turned = turned_over(sample)
    if turned is None:
        raise InputRefusedError(
            f"lit_side is {lit!r}, but a tie uses an index of [surroundings], which is not defined for the "
            "sample turned over; replace the tie by a number."
        )
    return turned, {opposite_medium(parameter): name for parameter, name in names.items()}


def _data(table: dict[str, Any], folder: Path) -> GonioData | Readings:
    """The measurement, of one file or several."""
    if "readings" in table:
        return _readings(table, folder)
    given = table.get("data")
    if given is None and isinstance(table.get("reading"), str):
        raise InputRefusedError(
            f"reading is {table['reading']!r}; it is a table of keywords. A file of readings is named by "
            "readings, one of a BSDF by data."
        )
    files = [given] if isinstance(given, str) else given
    if not _are_files(files):
        raise InputRefusedError(f'data is {given!r}; write data = "thin.csv", or a list of files.')
    reading = table_of(table, "reading")
    only(reading, READING, "reading")
    rows = {"rows": table["rows"]} if table.get("rows") else {}
    paths = [folder / file for file in files]
    return jaxink.measurement.read(paths if len(paths) > 1 else paths[0], **reading, **rows)


def _are_files(files: Any) -> TypeGuard[list[str]]:
    return isinstance(files, list) and bool(files) and all(isinstance(f, str) and f.strip() for f in files)


def _readings(table: dict[str, Any], folder: Path) -> Readings:
    """Readings of instruments other than a goniometer."""
    given = table["readings"]
    if "data" in table:
        raise InputRefusedError(
            "has both data and readings; write a measurement for each, as each has a noise of its own."
        )
    if "rows" in table:
        raise InputRefusedError("has rows, which choose among the rows of data; readings are read whole.")
    if not isinstance(given, str) or not given.strip():
        raise InputRefusedError(f'readings is {given!r}; write readings = "totals.csv", the name of a file.')
    reading = table_of(table, "reading")
    only(reading, ("wavelength_nm", "quantity", "sample"), "reading")
    return jaxink.measurement.read_readings(folder / given, **reading)


def _as_table(value: Any, name: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputRefusedError(f"{name} is {value!r}; it must be a table.")
    return value
