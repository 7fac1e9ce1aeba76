"""Performance profiles (Dolan, More 2002) and data profiles (More, Wild 2009) of the methods."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.optimisers.judgement import Judged, Variant
from jaxink.plots.figure import PageFigure, blank_figure

_WIDE, _TALL = 4.2, 3.2
# The compared methods, in the order of the legend: own, baseline, others.
_STYLES = ("-", "--")


def draw(problems: Sequence[Judged], variants: Sequence[Variant], path: Path) -> None:
    """Both profiles of some variants on the same problems, side by side."""
    with blank_figure(2 * _WIDE + 4.3, _TALL + 1.1) as page:
        _performance(page, problems, variants)
        _data(page, problems, variants)
        path.write_bytes(page.png())


def _style(number: int, variant: Variant) -> dict:
    if variant.method == "gradient":
        return {"color": "black", "linewidth": 2.2}
    return {"color": f"C{number % 10}", "linestyle": _STYLES[number // 10 % 2], "linewidth": 1.2}


def _performance(page: PageFigure, problems: Sequence[Judged], variants: Sequence[Variant]) -> None:
    axes = page.panel(0.7, 0.6, _WIDE, _TALL)
    ratios = []
    for problem in problems:
        times = np.array([list(problem.efforts(variant, problem.time_ms)) for variant in variants])
        least = np.min(times, axis=0)
        # A case that no method solves counts as unsolved for all.
        ratios.append(np.where(np.isfinite(times), times / np.where(np.isfinite(least), least, 1.0), np.inf))
    factors = np.geomspace(1, 300, 400)
    for number, variant in enumerate(variants):
        share = _mean_of_shares([ratio[number] for ratio in ratios], factors)
        axes.plot(factors, share, label=variant.title, **_style(number, variant))
    _finish(
        axes,
        "time of evaluations relative to the quickest method",
        "share of searches that reach the best minimum",
    )
    axes.set_xscale("log")


def _data(page: PageFigure, problems: Sequence[Judged], variants: Sequence[Variant]) -> None:
    axes = page.panel(_WIDE + 1.3, 0.6, _WIDE, _TALL)
    budgets = np.geomspace(1, 1000, 400)
    for number, variant in enumerate(variants):
        groups = [np.array(list(one.efforts(variant, one.cost))) / (one.n + 1) for one in problems]
        share = _mean_of_shares(groups, budgets)
        axes.plot(budgets, share, label=variant.title, **_style(number, variant))
    _finish(axes, "evaluations / (parameters + 1), a Jacobian counting as parameters + 1", "")
    axes.set_xscale("log")
    axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False, fontsize=8)


def _mean_of_shares(efforts: Sequence[np.ndarray], limits: np.ndarray) -> np.ndarray:
    """Share of the searches of a problem within each limit; every problem counts alike."""
    return np.mean([[np.mean(one <= limit) for limit in limits] for one in efforts], axis=0)


def _finish(axes, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.set_ylim(-0.02, 1.02)
    axes.grid(True, color="0.9", linewidth=0.6)
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)
