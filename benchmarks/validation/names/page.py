"""docs/validation/names.md: what diagnoses named, of the cases that were seen and of those that were not."""

import json
from pathlib import Path

from benchmarks.pages import filled, machine, table, write_page
from benchmarks.validation.names.cases import SIZES, Case
from benchmarks.validation.names.determined import RESULTS as DETERMINED
from jaxink.diagnosis import VerdictCode
from jaxink.numerics.digits import with_uncertainty


def is_right(case: Case, found: dict) -> bool:
    """Whether the true effects were named and no other; one of a class that cannot be told apart counts."""
    if not case.effects:
        return not found["effects"]
    return (
        len(found["effects"]) == len(case.effects)
        and set(case.effects) <= set(found["class"])
        and not found["imitations"]
    )


def is_wrong(case: Case, found: dict) -> bool:
    """Whether a cause is stated that is none, and not offered as one of several with the true one."""
    if not (found["effects"] and VerdictCode(found["code"]).fits_noise):
        return False
    # Each step names one effect; its class may hold the true one.
    return len(found["effects"]) > len(case.effects) or not set(case.effects) & set(found["class"])


def write(every: dict[str, Case], results: dict[str, dict]) -> None:
    """Write the page."""
    write_page("names.md", _page(every, results))


def _determined() -> str:
    """Effects of open cases that are declared and free, with their standard errors."""
    rows = []
    for name, one in json.loads(DETERMINED.read_text(encoding="utf-8")).items():
        found = with_uncertainty(one["value"], one["standard_error"])
        off = (one["value"] - one["true"]) / one["standard_error"]
        rows.append([name, f"{one['true']:.3g}", found, f"{off:+.1f}", f"{one['delta_chi_square']:.1f}"])
    return table(["case", "true", "fitted", "off, s.e.", "decrease in chi-square"], rows)


def _page(every: dict[str, Case], results: dict[str, dict]) -> str:
    overview, rows = [], []
    for kind in SIZES:
        line = [kind.replace("_", " ")]
        for is_unseen in (False, True):
            here = [n for n in results if n.startswith(f"{kind}-") and every[n].is_unseen == is_unseen]
            right = sum(is_right(every[n], results[n]) for n in here)
            wrong = sum(is_wrong(every[n], results[n]) for n in here)
            line += [f"{right} of {len(here)}" if here else "-", str(wrong) if here else "-"]
        overview.append(line)
    for name, found in results.items():
        case = every[name]
        before, after = found["reduced_chi_square"]
        mark = "right" if is_right(case, found) else "wrong" if is_wrong(case, found) else "open"
        rows.append(
            [
                name + (" (unseen)" if case.is_unseen else ""),
                ", ".join(case.effects) or "none",
                f"`{found['code']}`",
                ", ".join(found["effects"]) or "none",
                ", ".join(n for n in found["class"] if n not in found["effects"]) or "-",
                f"{before:.3g} -> {after:.3g}",
                mark,
                str(found["processor_s"]),
            ]
        )
    return filled(
        Path(__file__).with_name("names.md.in"),
        machine=machine(),
        overview=table(["kind", "seen: right", "wrong", "unseen: right", "wrong"], overview),
        rows=table(
            [
                "case",
                "true effects",
                "verdict",
                "added",
                "or instead",
                "reduced chi-square",
                "judged",
                "processor, s",
            ],
            rows,
        ),
        determined=_determined(),
        done=len(results),
        total=len(every),
    )
