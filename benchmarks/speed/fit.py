"""Gradient against simplex on one simulated measurement: same objective, scaling and start.

python -m benchmarks.speed.fit [--name plain_hg] [--repeats 7]
"""

import argparse
import statistics

from benchmarks.pages import machine, table, write_page
from benchmarks.validation.simulated.fits import fit_declared
from jaxink.fitting import FitResult


def main() -> None:
    """Write docs/validation/gradient-and-simplex.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--name", default="plain_hg")
    parser.add_argument("--repeats", type=int, default=7)
    arguments = parser.parse_args()
    rows = []
    seconds = {}
    for method in ("gradient", "simplex"):
        runs = [fit_declared(arguments.name, method) for _ in range(arguments.repeats)]
        first, searches = runs[0], [search for search in runs[0].searches if search.method != "profile"]
        seconds[method] = statistics.median(search_seconds(r) for r in runs)
        profiles = statistics.median(r.run_seconds - search_seconds(r) for r in runs)
        rows.append(
            [
                method,
                str(sum(search.jacobians for search in searches)),
                str(sum(search.evaluations for search in searches)),
                f"{seconds[method]:.3f}",
                f"{profiles:.3f}" if profiles else "",
                f"{first.compile_seconds:.1f}",
                f"{searches[0].loss_start:.4g}",
                f"{searches[0].loss:.4f}",
                ", ".join(f"{p.name.split('.')[1]} {p.value:.5g}" for p in first.parameters.free),
            ]
        )
    header = [
        "method",
        "Jacobians",
        "evaluations",
        "search, s (median)",
        "profiles, s (median)",
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
long and gives no standard errors. The time of the search contains everything up to the minimum, scans of a
radius included (there is none here); profile likelihoods, which only the gradient method follows, stand
beside it.

{table(header, rows)}

A linearisation at a trial point that is then rejected counts as a Jacobian. [More methods, problems and
starts](optimisers.md). This page is made by `python -m benchmarks.speed.fit`.
"""
    write_page("gradient-and-simplex.md", text)


def search_seconds(result: FitResult) -> float:
    """Run time of everything but profile likelihoods."""
    return sum(search.run_seconds for search in result.searches if search.method != "profile")


if __name__ == "__main__":
    main()
