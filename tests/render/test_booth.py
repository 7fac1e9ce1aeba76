"""The booth, what can be put into it, and numbers of its pictures; none of this needs Mitsuba."""

import sys

import numpy as np
import pytest

from jaxink.render import (
    Booth,
    BoothEffort,
    BoothRendering,
    FlatPlate,
    PrintedPlate,
    Sphere,
    Torus,
    require_mitsuba,
)
from jaxink.render.bodies import PER_MM
from jaxink.render.booth_figure import block_differences, save_booth_figure
from jaxink.render.booth_rendering import BoothLight
from jaxink.sample import load_sample
from tests.render import inks

WAYS = {"sheet": 0.1, "solid": 0.102, "volume": 0.1}
COLOURS = 450.0, 500.0, 550.0, 600.0, 650.0


def light(name, spectrum, wavelengths=(550.0,), seed=1, noise=1e-3, pixels=16):
    """The same radiance everywhere, with batches that scatter."""
    random, n = np.random.default_rng(seed), len(wavelengths)

    def scattered(*shape):
        return np.asarray(spectrum) * (1 + noise * random.normal(size=(6, *shape, n)))

    return BoothLight(name, np.array(wavelengths), scattered(), scattered(pixels, pixels))


def rendering(*lights, white=0.25):
    return BoothRendering(Booth(), BoothEffort(), {}, np.full(6, white), lights)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"plate_mm": 0.0}, "plate_mm"),
        ({"wall": 1.0}, "wall"),
        ({"body": Sphere(radius_mm=250.0)}, "500 mm wide"),
        ({"tubes": 30}, "30 tubes"),
    ],
)
def test_impossible_booths_are_refused(change, named, refused):
    with refused(named):
        Booth(**change)


@pytest.mark.parametrize(
    ("sizes", "named"),
    [
        ({"tube_radius_mm": 20.0}, "tube_radius_mm"),
        ({"tilt_deg": 90.0}, "tilt_deg"),
        ({"tilt_deg": 0}, "tilt_deg"),
    ],
)
def test_impossible_tori_are_refused(sizes, named, refused):
    with refused(named):
        Torus(**sizes)


def test_a_torus_is_a_closed_mesh_that_encloses_its_volume():
    torus = Torus()
    mesh = torus.surface(0.0)
    corners = mesh.points[mesh.faces] / PER_MM
    volume = np.sum(corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])) / 6
    expected = 2 * np.pi**2 * torus.ring_radius_mm * torus.tube_radius_mm**2
    # Positive, so that faces look outwards.
    assert volume == pytest.approx(expected, rel=2e-4)
    edges = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert np.all(counts == 2)
    # The origin is on it, and an inner one is a shell of even thickness away.
    assert np.linalg.norm(mesh.points, axis=1).min() < 1e-9
    inner = torus.surface(0.05)
    apart = np.linalg.norm(mesh.points - inner.points, axis=1) / PER_MM
    np.testing.assert_allclose(apart, 0.05, rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, rtol=1e-12)


def test_bodies_cover_what_is_seen_of_them():
    x, y = np.array([0.0, 0.0, 19.0, 13.0]), np.array([0.0, 19.0, 0.0, 0.0])
    for body in (Sphere(), FlatPlate()):
        assert body.covers(x, y, 0.0).tolist() == [True, True, True, True]
        assert body.covers(x, y, 1.5).tolist() == [True, False, False, True]
    # The hole is in the middle; the far side of the ring is foreshortened.
    assert Torus().covers(x, y, 0.0).tolist() == [False, False, True, True]


def test_luminance_is_that_over_the_white_body():
    found = rendering(light("sheet", [0.1]))
    factor = found.luminance_factor(found.light("sheet"))
    assert factor.value == pytest.approx(0.4, abs=4 * factor.error)
    assert factor.error == pytest.approx(0.4 * 1e-3 / 6**0.5, rel=0.7)
    assert found.light("volume") is None
    assert found.pairs == ()


def test_ways_that_differ_are_told_apart():
    grey, yellow = np.full(5, 0.1), np.array([0.05, 0.08, 0.1, 0.1, 0.1])
    found = rendering(
        light("sheet", yellow, COLOURS, 1),
        light("solid", 1.01 * grey, COLOURS, 2),
        light("volume", grey, COLOURS, 3),
    )
    compared = {(a.name, b.name): found.compared(a, b) for a, b in found.pairs}
    ratio, xy = compared["solid", "volume"]
    assert ratio.value == pytest.approx(0.01, abs=4 * ratio.error)
    assert ratio.value > 5 * ratio.error
    assert np.all(np.abs(xy.value) < 4 * xy.error)
    ratio, xy = compared["sheet", "volume"]
    assert ratio.value < -5 * ratio.error
    assert np.all(xy.value > 10 * xy.error)


def test_differences_of_pictures_are_those_within_the_sphere(tmp_path):
    found = rendering(*(light(name, [value], seed=k) for k, (name, value) in enumerate(WAYS.items())))
    difference = block_differences(found.booth.body, found.light("solid"), found.light("sheet"))
    inside = np.isfinite(difference.value)
    assert not inside[0, 0]
    assert inside[3:5, 3:5].all()
    assert difference.value[inside] == pytest.approx(0.02, abs=5e-3)
    # A block of 4 pixels, 6 batches.
    assert np.median(difference.error[inside]) == pytest.approx(1e-3 * (2 / 4 / 6) ** 0.5, rel=0.4)
    save_booth_figure(found, tmp_path / "sphere.png")
    assert (tmp_path / "sphere.png").stat().st_size < 150_000


# By what is told: the sample file of such a sample.
PLATE = inks.PRINTED[inks.PRINTED.index("[[layers]]") : inks.PRINTED.rindex("[[layers]]")]
ROUGH = 'thickness_mm = 1.0\n[layers.front_roughness]\ndensity = "cauchy"\nsigma_deg = 5'
OTHERS = {
    "absorbs": inks.PRINTED.replace("thickness_mm = 1.0", "thickness_mm = 1.0\nabsorption_per_mm = 0.01"),
    "rough": inks.PRINTED.replace("thickness_mm = 1.0", ROUGH),
    "backing": inks.PRINTED + "[backing]\nreflectance = 0.5\n",
    "cover": inks.PRINTED.replace(PLATE, PLATE + PLATE.replace('"plate"', '"cover"')),
}


@pytest.mark.parametrize("named", OTHERS)
def test_other_samples_are_refused(named, tmp_path, refused):
    (tmp_path / "other.toml").write_text(OTHERS[named], encoding="utf-8")
    with refused(named):
        PrintedPlate.of(load_sample(tmp_path / "other.toml"))


def test_without_mitsuba_the_command_that_installs_it_is_named(monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with refused("jaxink[render]"):
        require_mitsuba()
