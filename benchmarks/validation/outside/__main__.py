"""Diagnose simulated patterns that are in no catalogue, and write docs/validation/outside-catalogue.md.

python -m benchmarks.validation.outside [--quick] [PATTERN ...]

Each case, a pattern weak or strong, is one row of results.json; rows that are there are not run again unless
their pattern is named. The page is written from all rows. With --quick, an accuracy of 1 %, every third
direction, and only those effects that need no compiled program of their own; such rows are run again without
it.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.pages import filled, machine, table, write_page
from benchmarks.validation.outside.patterns import PATTERNS, STRENGTHS, simulated
from jaxink.diagnosis import VerdictCode
from jaxink.effects import CATALOGUE, Case, Effect, Scene, effects_for

RESULTS = Path(__file__).with_name("results.json")
QUICK = jaxink.FitOptions(profile="none", accuracy=1e-2)
# Codes that say that a cause was found.
NAMED = (VerdictCode.EXPLAINED, VerdictCode.EXPLAINED_BY_ONE_OF, VerdictCode.INSTRUMENT)


def run(name: str, strength: str, is_quick: bool) -> dict:
    """One row."""
    data, sample, largest = simulated(name, strength, 3 if is_quick else 1)
    options = jaxink.DiagnosisOptions()
    if is_quick:
        options = jaxink.DiagnosisOptions(catalogue=_shared(data, sample), fit=QUICK)
    started = time.process_time()
    found = jaxink.diagnose(data, sample, options)
    shape = found.shape
    return {
        "pattern": name,
        "strength": strength,
        "is_quick": is_quick,
        "largest_relative_change": largest,
        "points": len(data),
        "code": found.verdict.code,
        "effects": [step.effect for step in found.steps],
        "class": list(found.verdict.effects),
        "imitations": found.imitations,
        "reduced_chi_square": [s.fitted.reduced_chi_square for s in (found.before, found.after)],
        "sentence": found.verdict.sentence,
        "shape": None if shape is None else shape.sentence,
        "overlaps": dict(list(found.overlaps.items())[:3]),
        "processor_s": round(time.process_time() - started),
    }


def _shared(data: jaxink.GonioData, sample: jaxink.Sample) -> tuple[type[Effect], ...]:
    """Effects that need no compiled program of their own."""
    scene = Scene.of_used(data)
    relative = float(np.min(data.sigma_per_sr / data.bsdf_per_sr))
    forms = effects_for(Case(sample, scene, relative, QUICK.accuracy), CATALOGUE).forms
    return tuple(dict.fromkeys(type(form) for form in forms if not form.own_program))


def page(rows: list[dict]) -> str:
    """The page from all rows."""
    cells = [
        [
            r["pattern"].replace("_", " "),
            r["strength"] + (" (quick)" if r["is_quick"] else ""),
            f"{100 * r['largest_relative_change']:.2g} %",
            f"`{r['code']}`",
            ", ".join(r["effects"]) or "-",
            " -> ".join(f"{x:.3g}" for x in r["reduced_chi_square"]),
        ]
        for r in rows
    ]
    header = ["pattern", "strength", "largest change", "verdict", "effects added", "reduced chi-square"]
    false = [r for r in rows if r["code"] in NAMED]
    explained = [r for r in false if r["code"] == VerdictCode.EXPLAINED]
    statements = "\n".join(f"- **{n.replace('_', ' ')}**: {p.__doc__}" for n, p in PATTERNS.items())
    shapes = "\n".join(
        f"- {r['pattern'].replace('_', ' ')}, {r['strength']}: {r['shape']}" for r in rows if r["shape"]
    )
    return filled(
        Path(__file__).with_name("outside.md.in"),
        machine=machine(),
        cases=len(rows),
        statements=statements,
        weak=STRENGTHS["weak"],
        strong=STRENGTHS["strong"],
        table=table(header, cells),
        named=len(false),
        explained=len(explained),
        which="\n- none"
        if not false
        else "".join(
            f"\n- {r['pattern'].replace('_', ' ')}, {r['strength']}: `{r['code']}` by "
            + ", ".join(r["effects"])
            for r in false
        ),
        shapes=shapes or "- none",
    )


def main() -> None:
    """Run what is missing, and write the page."""
    asked = sys.argv[1:]
    rows = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
    is_quick = "--quick" in asked
    rows = [row for row in rows if row["pattern"] not in asked and (is_quick or not row["is_quick"])]
    for strength in STRENGTHS:
        for name in PATTERNS:
            if any((r["pattern"], r["strength"]) == (name, strength) for r in rows):
                continue
            rows.append(run(name, strength, is_quick))
            order = [(n, s) for n in PATTERNS for s in STRENGTHS]
            rows.sort(key=lambda r: order.index((r["pattern"], r["strength"])))
            RESULTS.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
            print(name, strength, rows_of(rows, name, strength), flush=True)
    write_page("outside-catalogue.md", page(rows))


def rows_of(rows: list[dict], name: str, strength: str) -> str:
    """What was found, for the terminal."""
    row = next(r for r in rows if (r["pattern"], r["strength"]) == (name, strength))
    return f"{row['code']} {row['effects']} {row['reduced_chi_square']} {row['processor_s']} s"


if __name__ == "__main__":
    main()
