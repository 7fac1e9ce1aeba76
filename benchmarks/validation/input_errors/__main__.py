"""Make twelve mistakes with simulated measurements, see which are named, and write input-errors.md.

python -m benchmarks.validation.input_errors [--page]

Results are kept in results.json beside this file; only what is missing there is run. --page runs nothing.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.pages import filled, machine, table, write_page
from benchmarks.simulated_data import data_file, declared_text
from benchmarks.validation.input_errors.faults import FAULTS, READER_WORDS
from benchmarks.validation.simulated.diagnosis import REPORTS
from jaxink import FitOptions, fit
from jaxink.errors import InputRefusedError
from jaxink.fitting import check_input

FAULTY = ("plain_hg", "plain_hg_noisy", "index_step_hg", "lit_from_ink_hg")
# Those of docs/validation/simulated.md.
INTACT = sorted(file.stem for file in REPORTS.glob("*.json"))
RESULTS = Path(__file__).with_name("results.json")
TEMPLATE = Path(__file__).with_name("page.md.in")


def tried(name: str, fault: str | None) -> dict:
    """What is said of one measurement: by the reader, or by the fit and its check of the input."""
    data, sample = data_file(name).read_text(encoding="utf-8"), declared_text(name)
    if fault is not None:
        data, sample = FAULTS[fault](data, sample)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        files = Path(folder, "data.csv"), Path(folder, "sample.toml")
        for file, text in zip(files, (data, sample), strict=True):
            file.write_text(text, encoding="utf-8")
        try:
            result = fit(*files, FitOptions(profile="none"))
        except InputRefusedError as problem:
            return {"reader": str(problem).partition(": ")[2], "named": []}
    fitted = time.perf_counter()
    checked = check_input(result)
    return {
        "verdict": result.verdict.code,
        "reduced": result.verdict.reduced_chi_square,
        "named": [[m.name, m.reduced_chi_square] for m in checked.mistakes if m.is_named],
        "fit_seconds": round(fitted - began, 1),
        "check_seconds": round(time.perf_counter() - fitted, 1),
    }


def cases() -> list[tuple[str, str | None]]:
    """Faulty measurements, then all of them as they are."""
    return [(name, fault) for name in FAULTY for fault in FAULTS] + [(name, None) for name in INTACT]


def key_of(name: str, fault: str | None) -> str:
    """Key of a case in the results."""
    return name if fault is None else f"{name} {fault}"


def run_missing() -> dict[str, dict]:
    """All results; those that are missing are computed and kept."""
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    for name, fault in cases():
        key = key_of(name, fault)
        if key not in results and "--page" not in sys.argv:
            results[key] = tried(name, fault) | {"machine": machine()}
            RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
            print(key, results[key], flush=True)
    return results


def is_named(found: dict, fault: str) -> bool:
    """Whether the mistake that was made is among those named."""
    words = READER_WORDS.get(fault)
    by_reader = words is not None and words in found.get("reader", "")
    return by_reader or fault in [name for name, _ in found["named"]]


def cell(found: dict, fault: str) -> str:
    """Cell of the table of mistakes."""
    if "reader" in found:
        return "by the reader" if is_named(found, fault) else "**rejected with other words**"
    after = dict((name, reduced) for name, reduced in found["named"])
    before = f"{found['reduced']:.4g}"
    others = ", ".join(f"`{name}`" for name in after if name != fault)
    if not is_named(found, fault):
        return f"**not named** ({before})" + (f", but {others}" if others else "")
    number = after[fault]
    change = before if number is None else f"{before} → {number:.3g}"
    return change + (f"; also {others}" if others else "")


def main() -> None:
    """Run what is missing and write the page."""
    results = run_missing()
    faulty = {(name, fault): results.get(key_of(name, fault)) for name in FAULTY for fault in FAULTS}
    rows = [
        [f"`{fault}`", *(cell(found, fault) if (found := faulty[name, fault]) else "" for name in FAULTY)]
        for fault in FAULTS
    ]
    made = [(fault, found) for (_, fault), found in faulty.items() if found]
    intact = [(name, results[name]) for name in INTACT if name in results]
    good = [
        [f"`{name}`", f"{found['reduced']:.4g}", str(found["verdict"]), _names(found)]
        for name, found in intact
    ]
    seconds = sorted(found["check_seconds"] for _, found in made if "check_seconds" in found)
    page = filled(
        TEMPLATE,
        named=sum(is_named(found, fault) for fault, found in made),
        made=len(made),
        beside=f" but in {_beside(made)} cases" if _beside(made) else "",
        mistakes=table(["mistake", *(f"`{name}`" for name in FAULTY)], rows),
        intact=table(["measurement", "reduced chi-square", "verdict of the fit", "mistakes named"], good),
        alarms=sum(bool(found["named"]) for _, found in intact),
        measurements=len(intact),
        median=f"{seconds[len(seconds) // 2]:.0f}",
        longest=f"{seconds[-1]:.0f}",
        machine=machine(),
    )
    write_page("input-errors.md", page)


def _beside(made: list[tuple[str, dict]]) -> int:
    """Number of cases in which the refits name another mistake."""
    return sum(
        any(name != fault and reduced is not None for name, reduced in found["named"])
        for fault, found in made
    )


def _names(found: dict) -> str:
    return ", ".join(f"`{name}`" for name, _ in found["named"]) or "none"


if __name__ == "__main__":
    main()
