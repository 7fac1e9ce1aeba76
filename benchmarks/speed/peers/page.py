"""Text of docs/validation/peers.md, and which targets are met."""

from pathlib import Path

from benchmarks.pages import filled, table
from benchmarks.speed.peers.rounds import SHORT_SECONDS, SLOW_ROUNDS, SLOW_SECONDS
from benchmarks.speed.peers.units import TITLES, TOLERANCE


def best_peer(rows: list[dict]) -> float | None:
    """Median of the fastest peer that passes."""
    times = [
        row["median_ms"]
        for row in rows
        if row["is_peer"] and row.get("passes") and row["median_ms"] is not None
    ]
    return min(times, default=None)


def median_of(units: dict, unit: str, name: str) -> float | None:
    """Median of a contender that passes, by the start of its name."""
    for row in units.get(unit, ()):
        if row["contender"].startswith(name) and row.get("passes"):
            return row["median_ms"]
    return None


def verdicts(units: dict) -> list[dict]:
    """Targets, what was reached, and whether each is met."""
    best = {unit: best_peer(rows) for unit, rows in units.items()}
    jacobian = "jaxink, value and Jacobian"
    spheres = median_of(units, "W5", "sasktran2")
    wanted = [
        ("W1", "of the best peer", 2.0, median_of(units, "W1", "jaxink"), best.get("W1")),
        ("W1 x 64", "of W1's best peer, each", 0.5, median_of(units, "W1 x 64", "jaxink"), best.get("W1")),
        ("W2", "of the best peer", 0.25, median_of(units, "W2", "jaxink"), best.get("W2")),
        ("W3b", "ms", 25.0, median_of(units, "W3b", "jaxink"), 1.0),
        ("W4", "of the best peer", 0.12, median_of(units, "W4", jacobian), best.get("W4")),
        (
            "W4",
            "of jaxink's value alone",
            4.0,
            median_of(units, "W4", jacobian),
            median_of(units, "W4", "jaxink, value only"),
        ),
        ("W5", "of sasktran2", 1.0, median_of(units, "W5", "jaxink"), spheres),
        (
            "W5",
            "of sasktran2, with derivatives",
            4.0,
            median_of(units, "W5", "jaxink, with derivatives"),
            spheres,
        ),
        ("W6", "of the best peer, per spectrum", 0.15, median_of(units, "W6", "jaxink"), best.get("W6")),
        ("whole sample", "ms", 40.0, median_of(units, "whole sample", "jaxink, default sizes"), 1.0),
    ]
    found = []
    for unit, kind, limit, ours, theirs in wanted:
        if unit not in units:
            continue
        reached = None if ours is None or theirs is None else ours / theirs
        met = None if reached is None else bool(reached <= limit)
        found.append({"unit": unit, "kind": kind, "target": limit, "reached": reached, "met": met})
    return found


def size_text(row: dict) -> str:
    """Streams, or the sizes of jaxink."""
    size = row.get("size")
    return " x ".join(map(str, size)) if isinstance(size, list | tuple) else str(size or "-")


def row_cells(row: dict, best: float | None) -> list[str]:
    """Cells of one contender."""
    notes = [row["note"]] if row["note"] else []
    if 0 < len(row["times_ms"]) < row["most_rounds"]:
        notes.append(f"{len(row['times_ms'])} rounds")
    if "failed" in row:
        notes.append(f"then {row['failed']}" if "error" in row else row["failed"])
    if "error" not in row:
        return [row["contender"], "-", "-", "-", "-", "; ".join(notes)]
    error = f"{row['error']:.1e}" if row["passes"] else f"MISS ({row['error']:.1e})"
    error = "reference" if row["is_reference"] else error
    if row["derivative_error"] is not None:
        error += f", derivatives {row['derivative_error']:.1e}"
    median = row["median_ms"]
    time_text = "-" if median is None else f"{median:.3g}"
    ratio = "-" if best is None or median is None else f"{median / best:.2g}"
    return [row["contender"], size_text(row), error, time_text, ratio, "; ".join(notes)]


def page(report: dict) -> str:
    """Text of docs/validation/peers.md."""
    header = ["contender", "streams or sizes", "error", "median, ms", "to the best peer", "remarks"]
    parts = []
    for unit, rows in report["units"].items():
        best = best_peer(rows)
        cells = [row_cells(row, best) for row in rows]
        parts.append(f"## {unit}\n\n{unit}: {TITLES[unit]}.\n\n{table(header, cells)}")
    targets = []
    for found in report["targets"]:
        reached = "-" if found["reached"] is None else f"{found['reached']:.2g}"
        met = {None: "not measured", True: "met", False: "missed"}[found["met"]]
        targets.append([found["unit"], f"{found['target']:g} {found['kind']}", reached, met])
    return filled(
        Path(__file__).with_name("peers.md.in"),
        machine=report["machine"],
        peers_python=report["peers_python"],
        versions=", ".join(f"{name} {number}" for name, number in sorted(report["versions"].items())),
        rounds=report["rounds"],
        short_ms=1e3 * SHORT_SECONDS,
        slow_s=SLOW_SECONDS,
        slow_rounds=SLOW_ROUNDS,
        tolerance=TOLERANCE,
        targets=table(["work unit", "at most", "reached", ""], targets),
        units="\n".join(part + "\n" for part in parts),
    )
