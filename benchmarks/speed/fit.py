"""Gradient against simplex on one simulated measurement: same objective, scaling and start.

python -m benchmarks.speed.fit [--name plain_hg] [--repeats 7]
"""

import argparse
import statistics

from benchmarks.pages import machine, table, write_page
from benchmarks.validation.simulated.fits import fit_declared


def main() -> None:
    """Write docs/gradient-and-simplex.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--name", default="plain_hg")
    parser.add_argument("--repeats", type=int, default=7)
    arguments = parser.parse_args()
    rows = []
    seconds = {}
    for method in ("gradient", "simplex"):
        runs = [fit_declared(arguments.name, method) for _ in range(arguments.repeats)]
        first, search = runs[0], runs[0].searches[0]
        seconds[method] = statistics.median(r.searches[0].run_seconds for r in runs)
        rows.append(
            [
                method,
                str(search.jacobians),
                str(search.evaluations),
                f"{seconds[method]:.3f}",
                f"{search.compile_seconds:.1f}",
                f"{search.loss_start:.4g}",
                f"{search.loss:.4f}",
                ", ".join(f"{p.name.split('.')[1]} {p.value:.5g}" for p in first.parameters.free),
            ]
        )
    header = [
        "method",
        "Jacobians",
        "evaluations",
        "run, s (median)",
        "compile, s (first)",
        "chi-square at the start",
        "at the end",
        "found",
    ]
    ratio = seconds["simplex"] / seconds["gradient"]
    text = f"""# Gradient method and simplex compared

The simulated measurement `{arguments.name}` is fitted from the middle of the parameter ranges; times are
medians of {arguments.repeats} runs in one process ({machine()}). The simplex is scipy's Nelder–Mead with
the same objective, the same variables between 0 and 1 and the same start. It takes {ratio:.1f} times as
long and gives no standard errors.

{table(header, rows)}

A linearisation at a trial point that is then rejected counts as a Jacobian. This page is made by
`python -m benchmarks.speed.fit`.
"""
    write_page("gradient-and-simplex.md", text)


if __name__ == "__main__":
    main()
