"""The sphere of `jaxink render --scene sphere` for three inks, and the same sphere in uniform light."""

import dataclasses
import json
import tempfile
from pathlib import Path

from benchmarks.pages import REPOSITORY
from benchmarks.validation.published.judgement import true_sample
from benchmarks.validation.render.uniform_light import checks
from jaxink.render import PrintedPlate, SphereEffort, render_sphere, save_sphere_figure

FILE = Path(__file__).with_name("booth.json")
PICTURE = REPOSITORY / "docs" / "sphere.png"
SHOWN = "coloured_ink"
# The picture of one ink is shown; of the others only the centre counts, most for the one that reflects least.
_EFFORTS = {
    "white_ink_mie": SphereEffort(pixel_paths=1),
    "white_ink_rough": SphereEffort(batches=16, pixel_paths=1),
    SHOWN: SphereEffort(),
}
CHECKED = "white_ink_mie"


def plate_of(name: str) -> PrintedPlate:
    """The plate as it was simulated, with smooth faces."""
    sample = true_sample(f"{name}-mie")
    smooth = tuple(dataclasses.replace(layer, roughness=()) for layer in sample.layers)
    return PrintedPlate.of(dataclasses.replace(sample, layers=smooth))


def numbers() -> dict:
    """Numbers of all inks, kept as they are made; batches are kept in a temporary folder."""
    found = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}

    def keep(key: str, make):
        if key not in found:
            found[key] = make()
            FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")

    for name, effort in _EFFORTS.items():

        def rendered(name=name, effort=effort):
            folder = Path(tempfile.gettempdir()) / f"jaxink-booth-{name}"
            folder.mkdir(exist_ok=True)
            rendering = render_sphere(plate_of(name), folder, effort=effort)
            if name == SHOWN:
                save_sphere_figure(rendering, PICTURE)
            return rendering.to_dict()

        keep(name, rendered)
    keep("uniform light", lambda: checks(plate_of(CHECKED)))
    return found


if __name__ == "__main__":
    numbers()
