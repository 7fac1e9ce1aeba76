"""Mitsuba's own look-ups, samples and pictures are those of the table."""

import dataclasses
import importlib.util

import numpy as np
import pytest

from jaxink.export import ExportOptions, write
from jaxink.ink import COMPONENTS
from jaxink.ink.hemispherical_totals import diffuse_totals
from tests.ink.analytic_tables import CRITICAL_DEG, INDEX_INSIDE, smooth_table, vector

mi = pytest.importorskip("mitsuba")


def regular_part():
    """More than Fresnel's, so that mistakes show."""
    theta = smooth_table().theta_deg
    beyond = theta > CRITICAL_DEG + 1e-9
    return np.stack(
        [
            np.where(beyond, 0.3, 0.1),
            np.where(beyond, 0.0, 0.2),
            0 * theta + 0.15,
            0.05 + 0.2 * (theta / 90) ** 4,
        ]
    )[:, None]


@pytest.fixture(scope="module")
def table():
    return smooth_table(regular=regular_part())


@pytest.fixture(scope="module")
def folder(tmp_path_factory, table):
    folder = tmp_path_factory.mktemp("mitsuba")
    every_angle = ExportOptions(interpolation_error=0)
    write(table, "mitsuba", folder, every_angle)
    colour = dataclasses.replace(every_angle, name="colour")
    write(smooth_table((450.0, 550.0, 650.0)), "mitsuba", folder, colour)
    return folder


def program(folder, name, variant):
    """The written module; its classes are of the variant that is set when it is loaded."""
    mi.set_variant(variant)
    spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def bsdf(folder):
    program(folder, "jaxink_table", "scalar_rgb")
    return mi.load_dict({"type": "jaxink_table", "filename": str(folder / "ink.nc")})


IMPORTANCE, RADIANCE = "Importance", "Radiance"


def context(mode):
    return mi.BSDFContext(getattr(mi.TransportMode, mode))


def hit(towards_source):
    """In Mitsuba the normal points from the inside of the plate to the other side, as ours."""
    interaction = mi.SurfaceInteraction3f()
    interaction.wi = mi.Vector3f(*map(float, towards_source))
    return interaction


def share(table, component, quantity, theta_i=31.0):
    return np.interp(theta_i, table.theta_deg, quantity[COMPONENTS.index(component), 0])


@pytest.mark.parametrize("component", COMPONENTS)
def test_eval_is_the_table_times_the_cosine(component, bsdf, table):
    into, out = (index[0] for index in table.index_of_sides(component))
    for theta_i, theta_o, phi in ((0.0, 20.0, 180.0), (31.0, 52.0, 37.0), (61.0, 88.0, 251.0)):
        # Along the normal the plane of incidence is anywhere, and the table the same all round.
        source, outgoing = vector(component[2], theta_i, 201.0), vector(component[3], theta_o, 201.0 + phi)
        expected = table.interpolated(component, theta_i, theta_o, phi) * np.cos(np.deg2rad(theta_o))
        value = bsdf.eval(context(IMPORTANCE), hit(source), mi.Vector3f(*map(float, outgoing)))
        np.testing.assert_allclose(list(value), expected, rtol=1e-5)
        # Light that arrives from the other end, the one with the camera's path: n^2 of radiance.
        value = bsdf.eval(context(RADIANCE), hit(source), mi.Vector3f(*map(float, outgoing)))
        np.testing.assert_allclose(list(value), expected * (into / out) ** 2, rtol=1e-5)
        back = component if component[0] == "R" else {"T_IA": "T_AI", "T_AI": "T_IA"}[component]
        physical = table.interpolated(back, theta_o, theta_i, phi) * np.cos(np.deg2rad(theta_o))
        np.testing.assert_allclose(list(value), physical, rtol=2e-3)


@pytest.mark.parametrize("side", ["I", "A"])
def test_samples_add_up_to_the_albedo_and_follow_their_density(side, bsdf, table):
    # Beyond the critical angle too, where nothing is refracted.
    theta_i = {"I": 61.0, "A": 31.0}[side]
    interaction, ctx = hit(vector(side, theta_i, 201.0)), context(IMPORTANCE)
    random = np.random.default_rng(7)
    components = [c for c in COMPONENTS if c[2] == side]
    weights = {kind: [] for kind in (8, 16, 32, 64)}
    for number, (first, second, third) in enumerate(random.random((4000, 3))):
        bs, weight = bsdf.sample(ctx, interaction, float(first), mi.Point2f(float(second), float(third)))
        kind = {
            int(mi.BSDFFlags.GlossyReflection): 8,
            int(mi.BSDFFlags.GlossyTransmission): 16,
            int(mi.BSDFFlags.DeltaReflection): 32,
            int(mi.BSDFFlags.DeltaTransmission): 64,
        }[int(bs.sampled_type)]
        weights[kind].append(float(weight[0]))
        if number < 100 and kind in (8, 16):
            assert bsdf.pdf(ctx, interaction, bs.wo) == pytest.approx(bs.pdf, rel=1e-4)
            value = bsdf.eval(ctx, interaction, bs.wo)
            assert float(weight[0]) * bs.pdf == pytest.approx(float(value[0]), rel=1e-4)
            assert (bs.wo.z > 0) == ((side == "A") == (kind == 8))
    diffuse, regular = diffuse_totals(table), table.regular
    for kind, quantity in ((8, diffuse), (16, diffuse), (32, regular), (64, regular)):
        component = next(c for c in components if (c[0] == "R") == (kind in (8, 32)))
        expected = share(table, component, quantity, theta_i)
        found = np.sum(weights[kind]) / 4000
        noise = np.sqrt(np.sum(np.square(weights[kind])) / 4000 - found**2) / np.sqrt(4000)
        assert found == pytest.approx(expected, abs=4 * noise + 1e-6), kind


def test_density_integrates_to_the_chance_of_diffuse_light(bsdf, table):
    interaction, ctx = hit(vector("A", 31.0, 201.0)), context(IMPORTANCE)
    # Uniform in the cosine of the polar angle.
    cosines, azimuths = (np.arange(-40, 40) + 0.5) / 40, (np.arange(36) + 0.5) * 10
    total = 0.0
    for cosine in cosines:
        for azimuth in azimuths:
            wo = vector("A" if cosine > 0 else "I", np.degrees(np.arccos(abs(cosine))), azimuth)
            total += bsdf.pdf(ctx, interaction, mi.Vector3f(*map(float, wo)))
    diffuse = sum(share(table, c, diffuse_totals(table)) for c in ("R_AA", "T_AI"))
    regular = sum(share(table, c, table.regular) for c in ("R_AA", "T_AI"))
    expected = diffuse / (diffuse + regular)
    assert total * 4 * np.pi / (80 * 36) == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(("side", "theta_i"), [("I", 31.0), ("A", 61.0)])
def test_regular_light_is_refracted(side, theta_i, bsdf, table):
    source = vector(side, theta_i, 201.0)
    component = next(c for c in COMPONENTS if c[0] == "T" and c[2] == side)
    into, out = (float(index[0]) for index in table.index_of_sides(component))
    found = []
    for draw in np.linspace(0, 1, 200, endpoint=False):
        bs, weight = bsdf.sample(context(RADIANCE), hit(source), float(draw), mi.Point2f(0.3, 0.6))
        if int(bs.sampled_type) == int(mi.BSDFFlags.DeltaTransmission):
            found.append(float(weight[0]) * bs.pdf)
            wo = np.array([bs.wo.x, bs.wo.y, bs.wo.z])
            np.testing.assert_allclose(wo[:2], -source[:2] * into / out, atol=1e-6)
            assert np.sign(wo[2]) == -np.sign(source[2])
            assert np.linalg.norm(wo) == pytest.approx(1, abs=1e-6)
            assert bs.eta == pytest.approx(out / into)
    assert len(found) > 10
    np.testing.assert_allclose(
        found, share(table, component, table.regular, theta_i) * (into / out) ** 2, rtol=1e-5
    )


def test_picture_in_uniform_light_has_the_radiance_of_the_table(folder, bsdf, table):
    to = mi.ScalarTransform4f()
    origin = [float(x) for x in 5 * vector("A", 31.0, 201.0)]
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 3},
        "sensor": {
            "type": "orthographic",
            "to_world": to.look_at(origin=origin, target=[0, 0, 0], up=[0, 0, 1]) @ to.scale([0.1, 0.1, 1]),
            "film": {
                "type": "hdrfilm",
                "width": 1,
                "height": 1,
                "rfilter": {"type": "box"},
                "pixel_format": "luminance",
            },
            "sampler": {"type": "independent", "sample_count": 2000},
        },
        "light": {"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}},
        "sheet": {"type": "rectangle", "to_world": to.scale([50, 50, 1]), "bsdf": bsdf},
    }
    pixel = float(np.array(mi.render(mi.load_dict(scene), seed=3)).ravel()[0])
    # Radiance from the other side arrives smaller by the square of the index.
    expected = sum(
        (share(table, c, diffuse_totals(table)) + share(table, c, table.regular))
        / (INDEX_INSIDE**2 if c[0] == "T" else 1)
        for c in ("R_AA", "T_AI")
    )
    assert pixel == pytest.approx(expected, rel=0.02)


def test_spectral_variants_interpolate_between_wavelengths(folder):
    program(folder, "jaxink_table", "scalar_spectral")
    bsdf = mi.load_dict({"type": "jaxink_table", "filename": str(folder / "colour.nc")})
    interaction = hit(vector("A", 31.0, 201.0))
    interaction.wavelengths = [400.0, 500.0, 575.0, 700.0]
    value = bsdf.eval(context(IMPORTANCE), interaction, mi.Vector3f(*map(float, vector("A", 52.0, 238.0))))
    colour = smooth_table((450.0, 550.0, 650.0))
    each = [float(colour.interpolated("R_AA", 31.0, 52.0, 37.0, w)) for w in range(3)]
    expected = np.interp([400, 500, 575, 700], colour.wavelength_nm, each) * np.cos(np.deg2rad(52))
    np.testing.assert_allclose(list(value), expected, rtol=1e-5)


def test_a_variant_of_three_colours_needs_one_wavelength(folder):
    program(folder, "jaxink_table", "scalar_rgb")
    asked = {"type": "jaxink_table", "filename": str(folder / "colour.nc")}
    with pytest.raises(RuntimeError, match="450, 550, 650 nm.*wavelength_nm"):
        mi.load_dict(asked)
    bsdf = mi.load_dict({**asked, "wavelength_nm": 650.0})
    value = bsdf.eval(context(IMPORTANCE), hit([0, 0, 1]), mi.Vector3f(0, 0, 1))
    assert list(value)[1] == pytest.approx(
        float(smooth_table((650.0,)).interpolated("R_AA", 0, 0, 0)), rel=1e-5
    )


def test_example_scene_shows_light(folder):
    program(folder, "jaxink_table", "scalar_rgb")
    example = program(folder, "example_scene", "scalar_rgb")
    scene = example.plate_with_ink(str(folder / "ink.nc"), size=(8, 6), samples=8)
    # The plate has the indices of the table.
    assert scene["upper"]["bsdf"]["int_ior"] == pytest.approx(INDEX_INSIDE, rel=1e-12)
    assert scene["upper"]["bsdf"]["ext_ior"] == 1
    picture = np.array(mi.render(mi.load_dict(scene), seed=3))
    assert picture.shape == (6, 8, 3)
    assert np.all(np.isfinite(picture))
    assert picture.min() >= 0
    assert picture.max() > 0
