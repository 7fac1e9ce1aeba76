"""How far the searches are after as many evaluations as the publications took steps."""

import statistics

from benchmarks.optimisers.judgement import Judged, Variant
from benchmarks.optimisers.problems import PRINTED
from benchmarks.pages import table

# Root mean squares by step, and seconds, that the publication of 2018 prints; that of 2021 prints neither.
_COURSES = {"sheet_2018-mie-protocol": ({1: "37.4 %", 15: "12.7 %", 29: "4.5 %"}, "420, several incidences")}
# The search of 2018 had 34 steps, those of 2021 up to 40.
_AT = (1, 15, 29, 34, 40)


def of_course(judged: list[Judged]) -> str:
    """Table of the root mean square residual after some numbers of evaluations, of the published problems.

    Parameters
    ----------
    judged
        The problems with their searches.
    """
    rows = []
    for one in judged:
        if one.name not in PRINTED:
            continue
        course, seconds = _COURSES.get(one.name, ({}, ""))
        printed = [course.get(steps, "") for steps in _AT]
        rows.append([f"`{one.name}`", "published", *printed, PRINTED[one.name][0], seconds])
        for variant in (Variant("simplex", False), one.default):
            if variant in one.searches:
                rows.append(["", variant.title, *_course(one, variant)])
    header = ["problem", "search", *(f"after {steps}" for steps in _AT), "at its end", "seconds"]
    return table(header, rows)


def _course(one: Judged, variant: Variant) -> list[str]:
    lines = one.searches[variant].values()
    cells = [
        one.rms_words(statistics.median(_loss_after(one, line, steps) for line in lines)) for steps in _AT
    ]
    ends = statistics.median(line["path"][-1][3] for line in lines)
    return [*cells, one.rms_words(ends), f"{one.median(variant, one.seconds):.1f}"]


def _loss_after(one: Judged, line: dict, evaluations: int) -> float:
    """Lowest loss up to a cost in evaluations, at least that of the start."""
    finite = [entry for entry in line["path"] if entry[3] is not None]
    reached = [entry[3] for entry in finite if one.cost(entry) <= evaluations]
    return reached[-1] if reached else finite[0][3]
