"""Write docs/validation/noise.md from the results kept beside this file.

python -m benchmarks.validation.noise
"""

import json
from pathlib import Path

from benchmarks.pages import filled, table, write_page
from benchmarks.validation.noise.coverage import RESULTS as COVERAGE
from benchmarks.validation.noise.false_alarms import RESULTS as ALARMS
from benchmarks.validation.noise.own_reading import RESULTS as OWN_READING
from benchmarks.validation.noise.unstated import RESULTS as UNSTATED
from benchmarks.validation.noise.unstated import stated
from jaxink.data import SIMULATED_TRUTH

_PERCENT = 100


def coverage_table(kept: dict) -> str:
    """One row for each design."""

    def within(found, sigmas):
        return " / ".join(f"{_PERCENT * found[f'{name}_within_{sigmas}']:.1f}" for name in SIMULATED_TRUTH)

    rows = [
        [
            design,
            f"{found['reduced_mean']:.3f} ({found['reduced_std']:.3f})",
            f"{_PERCENT * found['probability_below_0.5']:.1f}",
            f"{_PERCENT * found['probability_below_0.05']:.1f}",
            f"{_PERCENT * found['probability_below_0.001']:.1f}",
            within(found, 1),
            within(found, 2),
        ]
        for design, found in kept.items()
    ]
    header = ["measurement", "reduced chi-square (deviation)", *(f"p < {p}, %" for p in (0.5, 0.05, 0.001))]
    return table([*header, "within one standard error, %", "within two, %"], rows)


def own_table(kept: dict) -> str:
    """Bias of the absorption coefficient by what the noise is relative to."""
    kinds, rows = ("itself", "neighbours", "truth"), []
    for level in dict.fromkeys(key.split()[0] for key in kept["found"]):
        each = [kept["found"][f"{level} {kind}"]["ink.absorption_per_mm"] for kind in kinds]
        rows.append(
            [f"{100 * float(level):g} %"]
            + [
                f"{100 * one['error']:+.2f}({100 * one['of_error']:.2f}) %, {one['pull']:+.2f}"
                for one in each
            ]
        )
    return table(["noise", "share of the reading itself", "of its neighbours", "of the truth"], rows)


def alarms_table(kept: dict) -> str:
    """One row for each design."""
    rows = [
        [
            design,
            *(str(found[key]) for key in ("draws", "effects")),
            str(len(found["named"])),
            str(found["misfits"]),
        ]
        for design, found in kept.items()
    ]
    return table(["measurement", "draws", "effects", "an effect is named", "called a misfit"], rows)


def told(found: dict | None) -> str:
    """Verdict and names."""
    if found is None:
        return ""
    names = "; ".join(" / ".join(step) for step in found["classes"])
    return f"{found['code']}{': ' * bool(names)}{names}"


def files_table(kept: dict) -> str:
    """One row for each measurement."""
    rows = [
        [
            f"`{name}`",
            told(found["stated"]),
            told(found["unstated"]),
            f"{found['unstated']['before']:.4g} -> {found['unstated']['after']:.4g}",
        ]
        for name, found in kept.items()
    ]
    return table(["measurement", "stated noise", "not stated", "reduced chi-square, not stated"], rows)


def is_false(found: dict) -> bool:
    """Whether an effect is named that is not there: no member of its class is."""
    return any(not set(step) & set(found["true"]) for step in found["unstated"]["classes"])


def main() -> None:
    """Write the page."""
    results = (json.loads(path.read_text()) for path in (COVERAGE, UNSTATED, ALARMS, OWN_READING))
    coverage, files, alarms, own = results
    files = {name: found | {"stated": stated(name)} for name, found in files.items()}
    compared = {name: found for name, found in files.items() if found["stated"]}
    alike = sum(told(found["stated"]) == told(found["unstated"]) for found in compared.values())
    page = filled(
        Path(__file__).with_name("noise.md.in"),
        draws=round(next(iter(coverage.values()))["draws"]),
        coverage=coverage_table(coverage),
        alarms=alarms_table(alarms),
        own_draws=own["draws"],
        own_table=own_table(own),
        files=len(compared),
        alike=alike,
        alike_names=sum(
            sorted(found["stated"]["classes"]) == sorted(found["unstated"]["classes"])
            for found in compared.values()
        ),
        false_names=sum(map(is_false, compared.values())),
        files_table=files_table(files),
    )
    write_page("noise.md", page)


if __name__ == "__main__":
    main()
