"""Diagnose simulated fluorescent inks that are declared without fluorescence, and write docs/fluorescence.md.

python -m benchmarks.validation.fluorescence [INK-YIELD ...]

Results are kept in results.json; with names, such as green-0.1, only these are diagnosed anew.
"""

import json
import sys
import time
from pathlib import Path

import jaxink
from benchmarks.pages import filled, machine, table, write_page
from benchmarks.validation.fluorescence.inks import INKS, WAVES_NM, YIELDS, declared, measured
from jaxink.sample import sample_text

KEPT, PAGE = (Path(__file__).with_name(name) for name in ("results.json", "page.md"))
ACCURACY = 1e-2


def diagnosed(ink: str, quantum_yield: float) -> dict:
    """What a diagnosis finds, from the measurement and the declared sample alone."""
    options = jaxink.DiagnosisOptions(fit=jaxink.FitOptions(accuracy=ACCURACY, profile="none"))
    begin = time.monotonic()
    found = jaxink.diagnose(measured(ink, quantum_yield), declared(), options)
    row = {
        "seconds": round(time.monotonic() - begin),
        "verdict": found.verdict.code,
        "sentence": found.verdict.sentence,
        "steps": [
            {"effect": s.effect, "members": list(s.members), "terms": s.terms, "errors": s.term_errors}
            for s in found.steps
        ],
        "before": found.declared.merit.reduced_chi_square,
        "after": found.corrected.merit.reduced_chi_square if found.corrected else None,
    }
    if found.corrected is not None:
        row["sample"] = sample_text(found.corrected.sample)
        row["corrected"] = {
            p.name: [p.value, p.standard_error]
            for p in found.corrected.parameters.values()
            if p.name.startswith("fluorescence.")
        }
    return row


def main() -> None:
    """Diagnose what is asked for or missing, and write the page from all that is kept."""
    asked, kept = sys.argv[1:], json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    for ink in INKS:
        for quantum_yield in YIELDS:
            name = f"{ink}-{quantum_yield:g}"
            if name in asked or (not asked and name not in kept):
                kept[name] = diagnosed(ink, quantum_yield)
                KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
                print(name, kept[name]["verdict"], kept[name]["steps"], flush=True)
    print(kept, table, filled, machine, write_page, WAVES_NM, PAGE)


if __name__ == "__main__":
    main()
