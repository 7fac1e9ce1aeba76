"""The sphere of `jaxink render` for three inks, other bodies for one, and the sphere in uniform light."""

import dataclasses
import json
import tempfile
from pathlib import Path

from benchmarks.pages import REPOSITORY
from benchmarks.validation.published.judgement import true_sample
from benchmarks.validation.render.uniform_light import checks
from jaxink.render import (
    Body,
    Booth,
    BoothEffort,
    FlatPlate,
    PrintedPlate,
    Sphere,
    Torus,
    render_booth,
    save_booth_figure,
)

FILE = Path(__file__).with_name("booth.json")
PICTURE = REPOSITORY / "docs" / "sphere.png"
SHOWN = "coloured_ink"
# The picture of one ink is shown; of the others only the centre counts, most for the one that reflects least.
_EFFORTS = {
    "white_ink_mie": BoothEffort(pixel_paths=1),
    "white_ink_rough": BoothEffort(batches=16, pixel_paths=1),
    SHOWN: BoothEffort(),
}
CHECKED = "white_ink_mie"
# Further bodies, of this ink; the picture of one is shown.
BODIES = {"plate": FlatPlate(), "torus": Torus()}
BODIES_PICTURE = REPOSITORY / "docs" / "torus.png"


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

    def rendered(name: str, body: Body, effort: BoothEffort, picture: Path | None) -> dict:
        folder = Path(tempfile.gettempdir()) / f"jaxink-booth-{name}-{body.name}"
        folder.mkdir(exist_ok=True)
        rendering = render_booth(plate_of(name), folder, Booth(body), effort)
        if picture is not None:
            save_booth_figure(rendering, picture)
        return rendering.to_dict()

    for name, effort in _EFFORTS.items():
        picture = PICTURE if name == SHOWN else None
        keep(name, lambda name=name, e=effort, p=picture: rendered(name, Sphere(), e, p))
    for key, body in BODIES.items():
        picture = BODIES_PICTURE if key == "torus" else None
        keep(key, lambda body=body, p=picture: rendered(CHECKED, body, BoothEffort(), p))
    keep("uniform light", lambda: checks(plate_of(CHECKED)))
    return found


if __name__ == "__main__":
    numbers()
