"""The inks of samples 1 and 3 put back on their plates as thin sheets; inside.md does so for sample 2.

python -m benchmarks.validation.published.one_sheet
"""

import json
import time

import jaxink
from benchmarks.pages import page_path, table
from benchmarks.validation.ink.figure import draw, lines
from benchmarks.validation.published.fits import KEPT, kept_sample
from benchmarks.validation.published.problems import COLOURED, EVERYTHING, WHITE, measured
from jaxink.ink import verify_sheet
from jaxink.ink.sheet import sheets
from jaxink.numerics.precision import computing

FILE = KEPT / "one_sheet.json"
INCIDENCES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0)
# Of the coloured ink, where it absorbs most; it was measured in reflection only.
SHOWN = {WHITE: (550.0, "RT"), COLOURED: (600.0, "R")}


def make() -> dict:
    """Differences of the sheet from the full model, kept; draws the figures when it computes them."""
    if not FILE.exists():
        found = {}
        for ink, (wavelength_nm, sides) in SHOWN.items():
            began = time.perf_counter()
            sample = kept_sample(f"{ink}-mie", EVERYTHING)
            with computing():
                of_ink = jaxink.ink_table(sample, wavelengths_nm=[wavelength_nm])
                checks = verify_sheet(of_ink, sample, INCIDENCES_DEG).checks
                drawn = lines(sample, sheets(of_ink, sample)[1][0], INCIDENCES_DEG)
            for side in sides:
                draw(measured(ink)[0], drawn, side, f"{ink}, {wavelength_nm:g} nm", _figure(ink, side))
            found[ink] = {
                f"{side}, lit from the {words}": max(
                    c.largest_difference for c in checks if (c.side, c.lit_from) == (side, lit)
                )
                for side in "RT"
                for lit, words in (("inside", "plate"), ("outside", "ink"))
            } | {"seconds": time.perf_counter() - began}
        FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return json.loads(FILE.read_text(encoding="utf-8"))


def _figure(ink: str, side: str):
    return page_path(f"sheet-{ink}-{side}.png")


def text() -> str:
    """Table and figures for the page."""
    found = make()
    heads = list(next(iter(found.values())))
    rows = [
        [f"`{ink}`", *(f"{one[h]:.0f}" if h == "seconds" else f"{100 * one[h]:.2f}" for h in heads)]
        for ink, one in found.items()
    ]
    words = {"R": "reflection", "T": "transmission"}
    pictures = [
        f"![{ink}, {words[side]}: measurement, full model and sheet]({_figure(ink, side).name})"
        for ink, (_, sides) in SHOWN.items()
        for side in sides
    ]
    heads = ["largest difference, % of the largest BSDF of the incidence", *heads]
    return "\n\n".join([table(heads, rows), *pictures])


if __name__ == "__main__":
    print(text())
