"""Memory of a process that makes one diagnosis after the other; writes a section of time-to-answer.md.

python -m benchmarks.speed.memory [--before CHECKOUT] [--number N] [fit | diagnose | unlike]

Each has another number of rows, so that no program serves two of them; or, for "unlike", diagnoses another
sample. Another checkout of jaxink does the same in a process of its own.
"""

import argparse
import json
import tempfile
from contextlib import ExitStack
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.checkouts import started
from benchmarks.pages import REPOSITORY, machine, table, write_section
from benchmarks.simulated_data import data_file, declared_text

KEPT = Path(__file__).with_suffix(".json")
PAGE, MARK = "time-to-answer.md", "made by python -m benchmarks.speed.memory"
NAME, STRIDE, ACCURACY = "plain_hg", 9, 1e-2
SHOWN = 1, 2, 3, 5, 10, 15, 20, 30
# Henyey-Greenstein and Mie scattering, rough faces, the other side, one and five wavelengths.
UNLIKE = (
    "plain_hg",
    "free_film_mie",
    "undeclared_rough_surface",
    "lit_from_ink_hg",
    "undeclared_fluorescence",
    "white_ink_mie",
    "undeclared_thin_patches",
    "coloured_ink",
    "undeclared_polydispersity",
    "undeclared_air_gap",
    "undeclared_second_lobe",
    "undeclared_lateral_loss",
)
# Of several wavelengths.
LONG, LONG_STRIDE = 1000, 45
SHOWN_UNLIKE = 1, 2, 4, 6, 8, 10, 11, 12


def used() -> dict[str, float]:
    """Resident memory in GiB and the number of memory mappings of this process."""
    status = Path("/proc/self/status").read_text(encoding="ascii").split()
    resident = float(status[status.index("VmRSS:") + 1])
    mappings = Path("/proc/self/maps").read_bytes().count(b"\n")
    return {"GiB": resident / 2**20, "mappings": mappings}


def work(kind: str, number: int) -> None:
    """Print what is used after each answer."""
    options = jaxink.FitOptions(accuracy=ACCURACY, profile="none")
    for row in range(min(number, len(UNLIKE)) if kind == "unlike" else number):
        name = UNLIKE[row] if kind == "unlike" else NAME
        data, sample = jaxink.read(data_file(name)), jaxink.parse_sample(declared_text(name))
        chosen = np.arange(len(data)) % (STRIDE if len(data) < LONG else LONG_STRIDE) == 0
        if kind != "unlike":
            chosen[: STRIDE * row] = False
        few = data.with_masks(user=~chosen)
        if kind == "fit":
            jaxink.fit(few, sample, options)
        else:
            jaxink.diagnose(few, sample, jaxink.DiagnosisOptions(fit=options))
        print(json.dumps(used()), flush=True)


def main() -> None:
    """Run both versions, one after the other, keep what they used, and write the section."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--before", type=Path)
    parser.add_argument("--number", type=int, default=30)
    parser.add_argument("--work", action="store_true")
    parser.add_argument("kind", nargs="?", choices=("fit", "diagnose", "unlike"), default="diagnose")
    asked = parser.parse_args()
    if asked.work:
        work(asked.kind, asked.number)
        return
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    checkouts = ({"before": asked.before} if asked.before else {}) | {"now": REPOSITORY}
    for version, checkout in checkouts.items():
        words, variables = ("--work", asked.kind, "--number", asked.number), dict[str, str]()
        rows: list[dict[str, float]] = []
        with ExitStack() as closing:
            if asked.kind == "unlike":
                # Nothing stored: what has been traced stays in memory, too.
                variables["JAXINK_CACHE_DIR"] = closing.enter_context(tempfile.TemporaryDirectory())
            made = closing.enter_context(
                started(checkout, "benchmarks.speed.memory", *words, variables=variables)
            )
            assert made.stdout is not None
            for line in made.stdout:
                rows.append(json.loads(line))
                print(asked.kind, version, len(rows), rows[-1], flush=True)
                kept.setdefault(asked.kind, {})[version] = {"machine": machine(), "rows": rows}
                KEPT.write_text(json.dumps(kept, indent=1) + "\n")
    write(kept)


def write(kept: dict) -> None:
    """The section."""
    machines = {run["machine"]: None for versions in kept.values() for run in versions.values()}
    alike = {kind: versions for kind, versions in kept.items() if kind != "unlike"}
    names = ", ".join(f"`{name}`" for name in UNLIKE)
    text = f"""## Memory

One process makes one answer after the other, each with another number of rows, so that no program serves two
(`python -m benchmarks.speed.memory`, {"; ".join(machines)}; `{NAME}`,
every {STRIDE}th row, accuracy {ACCURACY:g}).

{_table(alike, SHOWN)}

The same with diagnoses of unlike samples (`python -m benchmarks.speed.memory unlike`, nothing stored
before): {names}; every {STRIDE}th row, or every
{LONG_STRIDE}th with several wavelengths.

{_table({"diagnose": kept["unlike"]} if "unlike" in kept else {}, SHOWN_UNLIKE)}

Of the programs in memory, those used least recently are dropped first; they are loaded from the store when
they are needed again. Now and then, those of JAX's own functions that are called outside of them are dropped,
too: each shape of their arguments has one, of over a megabyte."""
    write_section(PAGE, MARK, text)


def _table(kept: dict, shown: tuple[int, ...]) -> str:
    """Memory and mappings after as many answers, a row for each kind, version and quantity."""
    titles, lines = {"before": "earlier version", "now": "now"}, []
    for kind, versions in kept.items():
        for version, run in versions.items():
            for quantity in ("GiB", "mappings"):
                at = {n: run["rows"][n - 1][quantity] for n in shown if n <= len(run["rows"])}
                cells = [f"{at[n]:.2f}" if quantity == "GiB" else f"{at[n]:.0f}" for n in at]
                cells += [""] * (len(shown) - len(at))
                what = "memory, GiB" if quantity == "GiB" else "memory mappings"
                lines.append([f"`{kind}`, {titles[version]}", what, *cells])
    return table(["", "after as many", *map(str, shown)], lines)


if __name__ == "__main__":
    main()
