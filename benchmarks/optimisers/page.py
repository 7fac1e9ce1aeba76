"""docs/validation/optimisers.md from the kept searches."""

import dataclasses
import statistics
from collections.abc import Callable, Mapping
from pathlib import Path

from benchmarks.optimisers import agreement, at_once, bounds, scans
from benchmarks.optimisers.course import of_course
from benchmarks.optimisers.figures import draw
from benchmarks.optimisers.judgement import WITHIN, Judged, Variant, effort_at, share_words
from benchmarks.optimisers.problems import PRINTED, Posed
from benchmarks.optimisers.searches import BUDGET, N_STARTS
from benchmarks.optimisers.times import kept_times
from benchmarks.pages import filled, machine, page_path, table, write_page
from jaxink.fitting.comparison_methods import METHODS

_FOLDER = Path(__file__).parent
# Share of starts, and speed-up over the simplex, that the default method should reach.
_ENOUGH, _FASTER = 0.95, 10.0


def write(kept: Mapping[str, list[dict]], pose: Mapping[str, Callable[[], Posed]]) -> None:
    """Write the page and its figures from the lines of each problem."""
    judged = []
    for name, lines in kept.items():
        if any(line["method"] != "scan" for line in lines):
            objective = pose[name]().objective
            rows, n = len(objective.measured), len(objective.free)
            judged.append(Judged.of(name, objective.kind, rows, n, lines, kept_times()[name]))
    missing = [name for name in kept if name not in {one.name for one in judged}]
    text = filled(
        _FOLDER / "page.md.in",
        machine=machine(),
        n_starts=N_STARTS,
        starts=starts_sentence(kept),
        evaluations=BUDGET.evaluations,
        seconds=BUDGET.seconds,
        ended_by_time=ended_by_time(kept),
        overview=overview(judged),
        verdict=verdict(judged),
        course=of_course(judged),
        missing=f"Without kept searches: {', '.join(f'`{name}`' for name in missing)}." if missing else "",
        figures=figures(judged),
        within=100 * WITHIN,
        jacobians=jacobians_to_best(judged),
        scans=scans.of_kept(),
        bounds=bounds.of_kept(),
        at_once=at_once.of_kept(),
        agreement=agreement.of_kept(),
        sensitive=agreement.sensitive(),
        sections="\n\n".join(section(one) for one in judged),
    )
    write_page("optimisers.md", text)


def starts_sentence(kept: Mapping[str, list[dict]]) -> str:
    """From how many starts the methods have searched.

    Parameters
    ----------
    kept
        Lines of each problem.
    """
    starts: dict[str, dict[tuple[str, bool], set[int]]] = {}
    for name, lines in kept.items():
        for line in lines:
            if line["method"] != "scan":
                variants = starts.setdefault(name, {})
                variants.setdefault((line["method"], line["scan"]), set()).add(line["start"])
    complete = [name for name, made in starts.items() if min(map(len, made.values())) >= N_STARTS]
    rest = [name for name in starts if name not in complete]
    every = sum(len(numbers) for made in starts.values() for numbers in made.values())
    words = f"{every} searches are kept: from all {N_STARTS} starts by all methods on {len(complete)} of "
    words += f"{len(starts)} problems ({', '.join(f'`{name}`' for name in complete)})"
    if not rest:
        return f"{words}."

    def fewest(mine: bool) -> int:
        return min(
            len(numbers)
            for name in rest
            for (method, _), numbers in starts[name].items()
            if (method in ("gradient", "simplex")) is mine
        )

    return (
        f"{words}; on the others from at least {fewest(True)} by the gradient method and the simplex, and "
        f"from at least {fewest(False)} by the other methods. Each share is of the searches that there are."
    )


def ended_by_time(kept: Mapping[str, list[dict]]) -> str:
    """How many searches of all ended at the limit of time."""
    outcomes = [line["outcome"] for lines in kept.values() for line in lines if line["method"] != "scan"]
    return f"{outcomes.count('max_seconds')} of {len(outcomes)}"


def overview(judged: list[Judged]) -> str:
    """The default method and the simplex on every problem."""
    header = ["problem", "residuals", "parameters", "starts", "best rms residual", "published", "its steps"]
    header += ["default: reached", "Jacobians", "seconds", "simplex alone: reached", "evaluations", "seconds"]
    header += ["default faster by the time", "by evaluations"]
    rows = []
    for one in judged:
        default, simplex = one.default, Variant("simplex", False)
        printed = PRINTED.get(one.name, ("", ""))
        row = [f"`{one.name}`", str(one.rows), str(one.n), str(one.share(default)[1])]
        row += [one.rms_words(one.best["loss"]), *printed, _share(one, default)]
        row += [_median(one, default, "jacobians", 0), f"{one.median(default, one.seconds):.2f}"]
        if simplex in one.searches:
            row += [_share(one, simplex), _median(one, simplex, "evaluations", 0)]
            faster = (statistics.median(one.speed_up(measure)) for measure in (one.time_ms, one.cost))
            row += [f"{one.median(simplex, one.seconds):.2f}", *(f"{times:.2g}" for times in faster)]
        else:
            row += [""] * 5
        rows.append(row)
    return table(header, rows)


def jacobians_to_best(judged: list[Judged]) -> str:
    """Jacobians up to the best minimum, where these methods have searched from all starts."""
    methods = ("gradient", "optimistix_levenberg_marquardt", "optimistix_dogleg", "trf", "dogbox")
    variants = [Variant(method, False) for method in methods]
    rows = []
    for one in judged:
        if any(len(one.searches.get(variant, {})) < N_STARTS for variant in variants):
            continue
        row = [f"`{one.name}`"]
        for variant in variants:
            lines = one.searches[variant].values()
            efforts = (effort_at(line, one.target, lambda entry: entry[1]) for line in lines)
            reached = [effort for effort in efforts if effort is not None]
            median = f"{statistics.median(reached):g}" if reached else "never"
            row.append(f"{median}, {share_words(len(reached), len(lines))}")
        rows.append(row)
    return table(["problem", *methods], rows)


def verdict(judged: list[Judged]) -> str:
    """Where the default method reaches its target, and where it does not."""
    lines = []
    rare = [one for one in judged if _ratio(one, one.default) < _ENOUGH]
    compared = [one for one in judged if one.speed_up(one.time_ms)]
    slow = [one for one in compared if statistics.median(one.speed_up(one.time_ms)) < _FASTER]
    lines.append(
        f"The default reaches the best known minimum from at least {100 * _ENOUGH:.0f} % of the starts on "
        f"{len(judged) - len(rare)} of {len(judged)} problems" + _except(rare) + "."
    )
    lines.append(
        f"At the median over the starts it is at least {_FASTER:.0f} times faster to the simplex's own final "
        f"loss on {len(compared) - len(slow)} of {len(compared)}" + _except(slow) + "."
    )
    return "\n".join(lines)


def _except(problems: list[Judged]) -> str:
    return f" (not on {', '.join(f'`{one.name}`' for one in problems)})" if problems else ""


def figures(judged: list[Judged]) -> str:
    """Profiles of all methods alone, and after the scan, on the problems where all were run."""
    parts = []
    for scan, file, what in (
        (False, "optimisers-alone.png", "each method alone"),
        (True, "optimisers-after-scan.png", "each method after the same scan"),
    ):
        variants = [Variant(method, scan) for method in METHODS]
        common = [_common(one, variants) for one in judged if set(variants) <= one.searches.keys()]
        if not common:
            continue
        draw(common, variants, page_path(file))
        names = ", ".join(f"`{one.name}` ({len(one.searches[variants[0]])} starts)" for one in common)
        parts.append(f"![Profiles of {what}]({file})\n\nProfiles of {what}, on {names}.")
    return "\n\n".join(parts) or "No problem has been searched by all methods yet."


def _common(one: Judged, variants: list[Variant]) -> Judged:
    """A problem with the starts that all variants have searched from."""
    starts = set.intersection(*(set(one.searches[variant]) for variant in variants))
    searches = {v: {k: one.searches[v][k] for k in sorted(starts)} for v in variants}
    return dataclasses.replace(one, searches=searches)


def section(one: Judged) -> str:
    """All methods on one problem."""
    header = ["method", "reached", "converged", "evaluations", "Jacobians", "seconds", "rms residual"]
    header += ["parameter error, s.e."]
    rows = []
    for variant in one.searches:
        lines = one.searches[variant].values()
        converged = sum(line["outcome"] in ("converged", "settled") for line in lines)
        loss = one.median(variant, lambda line: line["loss"])
        error = one.median(variant, one.parameter_error)
        rows.append(
            [
                f"**{variant.title}**" if variant == one.default else variant.title,
                _share(one, variant),
                share_words(converged, len(lines)),
                _median(one, variant, "evaluations", 0),
                _median(one, variant, "jacobians", 0),
                _median(one, variant, "seconds", 2),
                "" if loss is None else one.rms_words(loss),
                "" if error is None else f"{error:.2g}",
            ]
        )
    return f"## `{one.name}`\n\n{table(header, rows)}"


def _ratio(one: Judged, variant: Variant) -> float:
    reached, of = one.share(variant)
    return reached / of


def _share(one: Judged, variant: Variant) -> str:
    return share_words(*one.share(variant))


def _median(one: Judged, variant: Variant, key: str, digits: int) -> str:
    value = one.median(variant, lambda line: line[key])
    return "" if value is None else f"{value:.{digits}f}"
