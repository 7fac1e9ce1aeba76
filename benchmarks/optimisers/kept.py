"""The kept searches: a line of results/PROBLEM.jsonl each."""

import json
from pathlib import Path

RESULTS = Path(__file__).parent / "results"


def kept(name: str) -> list[dict]:
    """Lines of a problem."""
    file = RESULTS / f"{name}.jsonl"
    if not file.exists():
        return []
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


def keep(name: str, line: dict) -> None:
    """Add a line to a problem."""
    RESULTS.mkdir(exist_ok=True)
    with (RESULTS / f"{name}.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps(line, allow_nan=False) + "\n")
