"""Section of accuracy.md on second derivatives and random stacks, from the results kept beside it.

python -m benchmarks.validation.accuracy.edges
"""

import json
from pathlib import Path

from benchmarks.pages import filled, table, write_section

HERE = Path(__file__).parent
SECOND, RANDOM = HERE / "second_derivatives.json", HERE / "random_stacks.json"
MARK = "edges"


def _second_derivatives() -> str:
    kept = json.loads(SECOND.read_text(encoding="utf-8"))
    modes = list(next(iter(kept.values())))
    rows = [[kind, *(f"{found[mode]:.0e}" for mode in modes)] for kind, found in kept.items()]
    return table(["layer or face", *modes], rows)


def _random_stacks() -> str:
    kept = json.loads(RANDOM.read_text(encoding="utf-8"))
    faults = [name for name in next(iter(kept.values())) if name != "stacks"]
    rows = [
        [f"`{structure}`", f"{found['stacks']}", *(f"{found[name]:.1g}" for name in faults)]
        for structure, found in kept.items()
    ]
    return table(["layers", "stacks", *faults], rows)


def main() -> None:
    """Write the section."""
    parts = {"second_derivatives": _second_derivatives(), "random_stacks": _random_stacks()}
    write_section("accuracy.md", MARK, filled(HERE / "edges.md.in", **parts))


if __name__ == "__main__":
    main()
