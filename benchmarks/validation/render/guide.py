"""The light guide of `jaxink render`: sheets against volumes, and what an undeclared air gap costs.

`declared.toml` and `corrected.toml` are what `jaxink fit` and `jaxink diagnose` write for the simulated
measurement `undeclared_air_gap`.
"""

import json
import tempfile
from pathlib import Path

from benchmarks.pages import REPOSITORY
from benchmarks.validation.render.one_dot import by_mitsuba, by_paths
from jaxink.render import Effort, GuideRendering, RenderedInk, render_guide
from jaxink.render.guide_figure import save_guide_figure

HERE = Path(__file__).parent
FILE = HERE / "guide.json"
PICTURE = REPOSITORY / "docs" / "lightguide.png"
# The comparison with the volume is the precise one.
_EFFORT, _PRECISE = Effort(), Effort(batches=16)
CASES = "thin", "contact", "gap", "white"


def rendered(case: str) -> GuideRendering:
    """Of the thin ink; of the corrected one in contact with its plate, or with its gap; of a white print."""
    with tempfile.TemporaryDirectory() as out:
        if case == "thin":
            return render_guide(RenderedInk.of(HERE / "thin_ink.toml"), out, effort=_PRECISE)
        if case == "gap":
            return render_guide(
                RenderedInk.of(HERE / "corrected.toml"), out, effort=_EFFORT, with_volume=False
            )
        if case == "white":
            return render_guide(
                RenderedInk.of(HERE / "white_print.toml"), out, effort=_EFFORT, with_volume=False
            )
        ink = RenderedInk.of(HERE / "corrected.toml", alone=True)
        uncorrected = RenderedInk.of(HERE / "declared.toml")
        return render_guide(ink, out, uncorrected=uncorrected, effort=_EFFORT)


def numbers() -> dict:
    """Numbers of all cases, kept as they are made; the picture is that of the corrected ink."""
    found = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    for case in CASES:
        if case not in found:
            rendering = rendered(case)
            found[case] = rendering.to_dict()
            if case == "contact":
                save_guide_figure(rendering, PICTURE)
            _keep(found)
    if "dots" not in found:
        found["dots"] = dots()
        _keep(found)
    return found


def _keep(found: dict) -> None:
    """Write the numbers; inks are named by their files in the repository, wherever that is."""
    text = json.dumps(found, indent=1).replace(f"{REPOSITORY}/", "")
    FILE.write_text(text + "\n", encoding="utf-8")


def dots() -> dict:
    """Share of diffuse light that returns from one dot, by our paths and by Mitsuba, with standard errors."""
    found = {}
    for name, file, alone in (("thin", "thin_ink.toml", False), ("contact", "corrected.toml", True)):
        medium = RenderedInk.of(HERE / file, alone=alone).medium
        for radius in (0.5, 1.5):
            found[f"{name} {radius:g}"] = {
                "thickness_um": medium.thickness_um,
                "radius_mm": radius,
                "paths": by_paths(medium, radius, 200_000, 1),
                "mitsuba": by_mitsuba(medium, radius, 40_000, 1),
            }
    return found


if __name__ == "__main__":
    numbers()
