"""Diagnose simulated fluorescent inks that are declared without fluorescence, and write fluorescence.md.

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
    rows = [
        row(ink, quantum_yield, kept[name])
        for ink in INKS
        for quantum_yield in YIELDS
        if (name := f"{ink}-{quantum_yield:g}") in kept
    ]
    header = ["ink", "reduced chi-square before", "verdict", "found", "exciting, nm", "after"]
    header += [
        "true yield",
        "found yield",
        "distance, s.e.",
        *(f"emitted at {nm:g} nm" for nm in WAVES_NM[1:]),
    ]
    header.append("seconds")
    parts = {"machine": machine(), "table": table(header, rows), "accuracy": ACCURACY}
    write_page("fluorescence.md", filled(PAGE, **parts))


def row(ink: str, quantum_yield: float, found: dict) -> list[str]:
    """One line of the table; shares of emitted photons are given as found (true)."""
    steps = {step["effect"]: step for step in found["steps"]}
    line = [
        f"`{ink}`",
        f"{found['before']:.3g}",
        found["verdict"],
        "; ".join(" / ".join(step["members"]) for step in found["steps"]) or "none",
    ]
    if "fluorescence" not in steps:
        return [*line, "-", f"{found['after']:.3g}", f"{quantum_yield:g}", *["-"] * 6, str(found["seconds"])]
    step, values = steps["fluorescence"], found["corrected"]
    mean, error = (step[key]["fluorescence.quantum_yield"] for key in ("terms", "errors"))
    exciting = [f"{nm:g}" for nm in WAVES_NM if values[f"fluorescence.excitation@{nm:g}"][0] > 0]
    left, shares = 1.0, []
    for nm in WAVES_NM:
        here = left * values[f"fluorescence.emission@{nm:g}"][0]
        left -= here
        shares.append(here)
    pairs = zip(shares[1:], INKS[ink][2][1:], strict=True)
    return [
        *line,
        ", ".join(exciting),
        f"{found['after']:.3g}",
        f"{quantum_yield:g}",
        f"{mean:.3f}" + (f" +- {error:.3f}" if error else " (bound)"),
        f"{(mean - quantum_yield) / error:+.1f}" if error else "-",
        *(f"{share:.2f} ({true:g})" for share, true in pairs),
        str(found["seconds"]),
    ]


if __name__ == "__main__":
    main()
