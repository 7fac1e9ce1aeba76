"""Writes the tables of these pages anew, from schemas and the catalogue of effects.

python docs/manual/tables.py
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from jaxink.batches import plan
from jaxink.effects import CATALOGUE, Effect
from jaxink.measurement import readings as reading_kinds
from jaxink.projects import schema as project_schema
from jaxink.sample import measurement_schema, schema
from jaxink.sample.effect_schema import EFFECTS, ELSEWHERE, EffectKeys
from jaxink.sample.schema import Entry, Quantity

HERE = Path(__file__).parent
_TABLE = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end of table -->\n)", re.DOTALL)


def parameters(table: Mapping[str, Quantity]) -> str:
    """Numbers that are parameters."""
    rows = [[*_number(key, q), q.scale, q.meaning] for key, q in table.items()]
    return _markdown(["key", "unit", "range", "default", "scale", "meaning"], rows)


def settings(numbers: Mapping[str, Quantity], entries: Mapping[str, Entry]) -> str:
    """Numbers that are no parameters, and what is no number."""
    rows = [[*_number(key, q), q.meaning] for key, q in numbers.items()]
    rows += [[f"`{key}`", "", e.values, e.default, e.meaning] for key, e in entries.items()]
    return _markdown(["key", "unit", "range", "default", "meaning"], rows)


def entries(table: Mapping[str, Entry]) -> str:
    """What is no number."""
    rows = [[f"`{key}`", e.values, e.default, e.meaning] for key, e in table.items()]
    return _markdown(["key", "type", "default", "meaning"], rows)


def effects(catalogue: Iterable[type[Effect]]) -> str:
    """The catalogue of effects."""
    strength = {True: "either", False: "0 or more"}
    rows = [
        [f"`{e.name}`", e.group, strength[e.may_be_negative], f"{e.usual:g}".replace("inf", "-"), e.statement]
        for e in catalogue
    ]
    return _markdown(["effect", "group", "strength", "usual strength", "meaning"], rows)


def effect_keys(table: Mapping[str, EffectKeys]) -> str:
    """Keys of the effects that have tables of their own, the parameters of each first."""
    rows = []
    for name, keys in table.items():
        rows += [[f"`{name}`", *_number(key, q), q.scale, q.meaning] for key, q in keys.numbers.items()]
        for key, q in keys.form.items():
            entry = [f"`{key}`", "", q.values, q.default] if isinstance(q, Entry) else _number(key, q)
            rows.append([f"`{name}`", *entry, "-", q.meaning])
    return _markdown(["effect", "key", "unit", "range", "default", "scale", "meaning"], rows)


def elsewhere(table: Mapping[str, str]) -> str:
    """Effects that other keys of the file declare."""
    return _markdown(["effect", "declared by"], ([f"`{name}`", place] for name, place in table.items()))


def readings(table: Mapping[str, reading_kinds.ReadingKind]) -> str:
    """Quantities of readings, with the angles that are taken unless others are stated."""
    rows = []
    for name, q in table.items():
        other = "regular direction" if q.is_regular else "hemisphere"
        ends = (other if angle is None else f"{angle:g} deg" for angle in (q.theta_i_deg, q.theta_o_deg))
        rows.append([f"`{name}`", q.meaning, *ends])
    return _markdown(["quantity", "meaning", "illumination", "detection"], rows)


def _number(key: str, q: Quantity) -> list[str]:
    default = q.otherwise if q.default is None else f"{q.default:g}"
    return [f"`{key}`", q.unit, f"{q.lowest:g} ... {q.highest:g}", default]


def _markdown(heads: list[str], rows: Iterable[list[str]]) -> str:
    body = [f"| {' | '.join(row)} |\n" for row in rows]
    return "".join([f"| {' | '.join(heads)} |\n", "|---" * len(heads) + "|\n", *body])


_PARAMETERS = ("SURROUNDINGS", "BACKING", "CLEAR_LAYER", "SCATTERING_LAYER", "COEFFICIENTS", "ALBEDO", "INKS")
_PARAMETERS += ("SIZE_DISTRIBUTION", "MIE_LAYER", "ROUGHNESS", "SECOND_ROUGHNESS", "HEIGHT_MAP")
_ENTRIES = (
    "LAYER_ENTRIES",
    "BACKING_ENTRIES",
    "RADIUS_TABLE",
    "POPULATIONS",
    "MIXTURE",
    "PHASE_TABLE",
    "DISPERSION_TABLE",
)
_ENTRIES += ("FACETS_ENTRIES", "WAVES_ENTRIES", "HEIGHT_MAP_ENTRIES")
_OF_CHOICES = schema.PHASE_FUNCTIONS | schema.SPECTRA | schema.DISPERSIONS | schema.LAWS
# Text of each table by the name in its marker, for each page.
PAGES = {
    "sample-file.md": {
        **{name: parameters(getattr(schema, name)) for name in _PARAMETERS},
        **{name: parameters(table) for name, table in _OF_CHOICES.items() if table},
        **{name: entries(getattr(schema, name)) for name in _ENTRIES},
        "TOP": entries(measurement_schema.TOP),
        "NUMBER": entries(measurement_schema.NUMBER),
        "INSTRUMENT": settings(measurement_schema.INSTRUMENT, measurement_schema.LIGHT_ENTRIES),
        "NOISE": settings(measurement_schema.NOISE, measurement_schema.NOISE_ENTRIES),
        "MASKS": settings(measurement_schema.MASKS, {}),
        "EFFECTS": effect_keys(EFFECTS),
        "ELSEWHERE": elsewhere(ELSEWHERE),
        "WEIGHTS": settings(measurement_schema.WEIGHTS, measurement_schema.WEIGHTS_ENTRIES),
    },
    "diagnosis.md": {"CATALOGUE": effects(CATALOGUE)},
    "readings.md": {"QUANTITIES": readings(reading_kinds.QUANTITIES)},
    "batch.md": {
        **{name: entries(getattr(plan, name)) for name in ("TOP", "MEASUREMENTS", "READING")},
        "LIMITS": settings(plan.LIMITS, {}),
    },
    "projects.md": {
        name: entries(getattr(project_schema, name)) for name in ("TOP", "MEASUREMENT", "INSTRUMENT")
    },
}


def with_tables(page: str, text: str) -> str:
    """Text of a page with its tables as they are now, each of them once."""
    tables = PAGES[page]
    names = [name for _, name, _ in _TABLE.findall(text)]
    assert len(set(names)) == len(names), f"{page} has a table twice: {names}"
    missing, unknown = set(tables) - set(names), set(names) - set(tables)
    assert not missing | unknown, (
        f"{page} lacks the tables {missing} and has {unknown}, which are not known; each stands between "
        "<!-- table: NAME --> and <!-- end of table -->"
    )
    return _TABLE.sub(lambda found: found[1] + tables[found[2]] + found[3], text)


if __name__ == "__main__":
    for name in PAGES:
        path = HERE / name
        path.write_text(with_tables(name, path.read_text(encoding="utf-8")), encoding="utf-8")
