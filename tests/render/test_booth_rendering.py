"""The sphere by Mitsuba where the answer is known, and renderings that go on where they were."""

import dataclasses

import numpy as np
import pytest

from benchmarks.validation.render.uniform_light import known, seen
from jaxink.render import Booth, BoothEffort, FlatPlate, PrintedPlate, Torus, render_booth
from jaxink.render.batches import FOLDER
from jaxink.sample import load_sample
from tests.render import inks

pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'jaxink[render]'")

WAYS = "sheet", "solid", "volume"


@pytest.fixture(scope="module")
def clear_plate(tmp_path_factory):
    """Nothing absorbs."""
    path = tmp_path_factory.mktemp("clear") / "clear.toml"
    path.write_text(inks.PRINTED.replace("absorption_per_mm = 4", "absorption_per_mm = 0"), encoding="utf-8")
    return PrintedPlate.of(load_sample(path))


@pytest.mark.parametrize("way", WAYS)
def test_without_absorption_a_hollow_sphere_in_uniform_light_cannot_be_seen(way, clear_plate):
    value, error = seen(clear_plate, way, 1_600, core=False)
    # The tables are interpolated.
    assert value == pytest.approx(1.0, abs=3.5 * error + 0.01)
    assert error < 0.02


@pytest.mark.parametrize("way", WAYS)
def test_in_uniform_light_the_reflectance_is_seen(way, plate):
    value, error = seen(plate, way, 4_000)
    assert value == pytest.approx(known(plate), abs=3.5 * error + 0.005)
    assert error < 0.04


@pytest.mark.parametrize("body", [FlatPlate(), Torus(tilt_deg=0.001)], ids=lambda body: body.name)
@pytest.mark.parametrize("way", WAYS)
def test_other_bodies_look_alike_in_uniform_light(body, way, plate):
    value, error = seen(plate, way, 2_000, Booth(body))
    assert value == pytest.approx(known(plate), abs=3.5 * error + 0.005)
    assert error < 0.05


def test_a_rendering_goes_on_where_it_was(plate, tmp_path):
    effort = BoothEffort(batches=3, paths=160, pixels=8, pixel_paths=1)
    found = render_booth(plate, tmp_path, effort=effort, with_volume=False)
    for light in found.lights:
        assert found.luminance_factor(light).value == pytest.approx(
            known(plate), abs=5 * found.luminance_factor(light).error + 0.1
        )
    batches = {p.name: p.stat().st_mtime_ns for p in (tmp_path / FOLDER).iterdir()}
    (tmp_path / FOLDER / "solid-0-001.npy").unlink()
    again = render_booth(plate, tmp_path, effort=effort, with_volume=False)
    assert again.to_dict() == found.to_dict()
    after = {p.name: p.stat().st_mtime_ns for p in (tmp_path / FOLDER).iterdir()}
    assert {name for name in after if after[name] != batches[name]} == {"solid-0-001.npy"}
    more = dataclasses.replace(effort, batches=4)
    assert len(render_booth(plate, tmp_path, effort=more, with_volume=False).white) == 4
    assert not np.array_equal(found.lights[0].centre[0], found.lights[0].centre[1])
