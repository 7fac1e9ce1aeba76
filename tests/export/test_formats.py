"""Every file, read by a reader of its own, gives back the table in world directions."""

import re

import numpy as np
import pytest

from jaxink.export import ExportOptions, write
from jaxink.ink import COMPONENTS
from jaxink.ink.hemispherical_totals import diffuse_totals
from tests.export import tracer_files
from tests.ink.analytic_tables import (
    CRITICAL_DEG,
    INDEX_INSIDE,
    LAMBERTIAN,
    LOBE_PHI_DEG,
    LOBE_THETA_DEG,
    lambertian,
    lobe,
    smooth,
    smooth_table,
    table_of,
    tilted_lobe,
    vector,
)

EVERYTHING = ("regular", "beyond_critical", "standard_errors", "index_step")
# Format, options, reader.
FILES = {
    "zemax": ("zemax", {}, tracer_files.zemax),
    "integra": ("integra", {}, tracer_files.integra),
    "lighttools": ("lighttools", {}, tracer_files.lighttools),
    "speos": ("speos", {}, tracer_files.speos),
    "klems": ("radiance", {"basis": "klems"}, tracer_files.radiance),
    "tree": ("radiance", {"basis": "tensor_tree"}, tracer_files.radiance),
    "csv": ("csv", {}, tracer_files.flat_csv),
}
INCIDENCE_AZIMUTH = 200.0


def written(table, kind, folder, **more):
    name, options, reader = FILES[kind]
    files = write(table, name, folder, ExportOptions(drop=EVERYTHING, **options, **more))
    assert sorted(folder.iterdir()) == files
    return reader(folder)


def ray(component, theta_i, theta_o, phi):
    """Towards the source, and outgoing, with the source at an azimuth of its own."""
    source = vector(component[2], theta_i, INCIDENCE_AZIMUTH)
    return source, vector(component[3], theta_o, INCIDENCE_AZIMUTH + np.asarray(phi))


def held_incidences(component, kind):
    """Angles of incidence that a format can hold."""
    most = CRITICAL_DEG - 0.5 if kind == "zemax" and component == "T_IA" else 80
    return np.array([angle for angle in (0.0, 12, 30, 60, 80) if angle <= most])


def hemisphere(n_theta=24, n_phi=36):
    """Polar angles, azimuths and weights of an integral over the projected hemisphere."""
    sine2 = (np.arange(n_theta) + 0.5) / n_theta
    phi = (np.arange(n_phi) + 0.5) * 360 / n_phi
    theta = np.degrees(np.arcsin(np.sqrt(sine2)))
    return *np.meshgrid(theta, phi, indexing="ij"), np.pi / (n_theta * n_phi)


@pytest.fixture(scope="module")
def lambertian_files(tmp_path_factory):
    return {kind: written(lambertian(), kind, tmp_path_factory.mktemp(kind)) for kind in FILES}


@pytest.fixture(scope="module")
def smooth_files(tmp_path_factory):
    return {kind: written(smooth_table(), kind, tmp_path_factory.mktemp(kind)) for kind in FILES}


@pytest.fixture(scope="module")
def lobe_files(tmp_path_factory):
    return {kind: written(tilted_lobe(), kind, tmp_path_factory.mktemp(kind)) for kind in FILES}


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("component", COMPONENTS)
def test_lambertian_comes_back(kind, component, lambertian_files):
    # Clear of the horizon, where files centred on the specular direction interpolate towards zero.
    theta, phi = np.meshgrid([0.0, 15, 40, 60], [0.0, 45, 90, 170, 250, 359], indexing="ij")
    for theta_i in held_incidences(component, kind):
        values = lambertian_files[kind](component, *ray(component, theta_i, theta, phi))
        np.testing.assert_allclose(values * np.pi, LAMBERTIAN[component], rtol=1e-6)


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("component", COMPONENTS)
def test_hemispherical_sum_is_that_of_the_table(kind, component, smooth_files):
    theta, phi, weight = hemisphere()
    table = smooth_table()
    totals = diffuse_totals(table)[COMPONENTS.index(component), 0]
    for theta_i in held_incidences(component, kind):
        values = smooth_files[kind](component, *ray(component, theta_i, theta, phi))
        expected = np.interp(theta_i, table.theta_deg, totals)
        assert np.sum(values) * weight == pytest.approx(
            expected, rel=0.02 if kind in ("klems", "tree") else 4e-3
        )
        assert np.sum(values) * weight <= 1


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("component", COMPONENTS)
def test_lobe_off_the_plane_of_incidence_stays_where_it_is(kind, component, lobe_files):
    theta, phi = np.meshgrid(np.arange(0, 90, 3.0), np.arange(0, 360, 4.0), indexing="ij")
    # Light along the normal has no plane of incidence.
    for theta_i in held_incidences(component, kind)[1:]:
        source, outgoing = ray(component, theta_i, theta, phi)
        values = lobe_files[kind](component, source, outgoing)
        # The lobe and its mirror image: the azimuth of the source plus and minus 37 degrees.
        for sign in (1, -1):
            centre = vector(component[3], LOBE_THETA_DEG, INCIDENCE_AZIMUTH + sign * LOBE_PHI_DEG)
            near = outgoing @ centre > np.cos(np.deg2rad(25))
            weights = np.where(near, values * np.sin(np.deg2rad(theta)), 0)
            found = np.sum(weights[..., None] * outgoing, axis=(0, 1))
            found /= np.linalg.norm(found)
            off = np.degrees(np.arccos(np.clip(found @ centre, -1, 1)))
            # A Klems patch of incidence at 80 degrees is 30 degrees wide in azimuth.
            assert off < (9.0 if kind == "klems" else 1.0)
        if kind != "klems":
            # Linear interpolation of a Gaussian over 2.5 and 5 degrees; in a tree, cells of 3 degrees.
            expected = lobe(component, 550.0, theta_i, theta, np.abs((phi + 180) % 360 - 180))
            clear = theta < 84
            tolerance = {"tree": 0.2, "zemax": 0.06, "integra": 0.06}.get(kind, 0.02)
            np.testing.assert_allclose(values[clear], expected[clear], rtol=0, atol=tolerance)


@pytest.mark.parametrize("kind", FILES)
def test_total_internal_reflection_survives(kind, smooth_files):
    theta, phi, weight = hemisphere()
    values = smooth_files[kind]("R_II", *ray("R_II", 60.0, theta, phi))
    expected = smooth("R_II", 550.0, 60.0, theta, phi)
    assert np.sum(values) * weight == pytest.approx(np.sum(expected) * weight, rel=0.02)
    # Grazing entries of the file: not the nearest incidence below the critical angle.
    below = smooth_files[kind]("R_II", *ray("R_II", 40.0, theta, phi))
    assert np.abs(np.sum(values - below)) * weight > 0.01


@pytest.mark.parametrize("kind", FILES)
def test_transmissions_keep_the_square_of_the_index(kind, smooth_files):
    bsdf = smooth_files[kind]
    tolerance = 0.12 if kind == "klems" else 0.04 if kind == "tree" else 0.01
    for inside, outside, phi in ((10.0, 30.0, 20.0), (25.0, 60.0, 120.0), (33.0, 15.0, 170.0)):
        forward = bsdf("T_IA", vector("I", inside, 10), vector("A", outside, 10 + phi))
        back = bsdf("T_AI", vector("A", outside, 10 + phi), vector("I", inside, 10))
        assert back / forward == pytest.approx(INDEX_INSIDE**2, rel=tolerance)


def test_zemax_states_refracted_angles_and_exact_totals(smooth_files, lambertian_files):
    files = smooth_files["zemax"].files
    assert files["R_II"]["angleofincidence"][-1] == 90
    out, into = files["T_IA"]["angleofincidence"], files["T_AI"]["angleofincidence"]
    # Nothing beyond the critical angle: one row for each incidence up to it, refracted.
    theta = smooth_table().theta_deg
    inside = theta[theta <= CRITICAL_DEG + 1e-9]
    np.testing.assert_allclose(np.sin(np.deg2rad(out)), INDEX_INSIDE * np.sin(np.deg2rad(inside)), atol=1e-9)
    np.testing.assert_allclose(np.sin(np.deg2rad(into)), np.sin(np.deg2rad(theta)) / INDEX_INSIDE, atol=1e-9)
    assert into[-1] == pytest.approx(CRITICAL_DEG, abs=1e-6)
    for component, total in LAMBERTIAN.items():
        np.testing.assert_allclose(lambertian_files["zemax"].files[component]["tis"], total, rtol=1e-8)


def test_lighttools_holds_transmission_beyond_the_critical_angle(smooth_files, lambertian_files):
    rows = {row["aoi"]: row for row in smooth_files["lighttools"].blocks["back", "btdf"]}
    assert rows[60.0]["tis"] == pytest.approx(
        np.interp(60, smooth_table().theta_deg, diffuse_totals(smooth_table())[1, 0]), rel=1e-8
    )
    for (side, kind), component in (
        (("back", "brdf"), "R_II"),
        (("back", "btdf"), "T_IA"),
        (("front", "btdf"), "T_AI"),
        (("front", "brdf"), "R_AA"),
    ):
        for row in lambertian_files["lighttools"].blocks[side, kind]:
            assert row["tis"] == pytest.approx(LAMBERTIAN[component], rel=1e-8)
            assert row["wavelength"] == 550


def test_speos_states_the_total_of_its_reference(smooth_files):
    table = smooth_table()
    for side, parts in smooth_files["speos"].files.items():
        for kind, part in parts.items():
            component = next(c for c in COMPONENTS if (c[0], c[2]) == (kind, side))
            total = diffuse_totals(table)[COMPONENTS.index(component), 0]
            assert part["reference"] == pytest.approx(table.theta_deg[np.argmax(total)])
            np.testing.assert_allclose(part["spectrum"][:, 1], 100 * total.max(), rtol=1e-8)
            # Intensities integrate to the percentage, as the software would find.
            row = part["intensity"][np.argmax(total)] * np.sin(np.deg2rad(part["theta"]))[:, None]
            sum_of = np.trapezoid(np.trapezoid(row, np.deg2rad(part["phi"])), np.deg2rad(part["theta"]))
            assert sum_of == pytest.approx(total.max(), rel=3e-3)


def test_speos_leaves_out_what_is_zero_throughout(tmp_path):
    table = smooth_table()
    table.bsdf_per_sr[1:3] = 0
    write(table, "speos", tmp_path)
    assert list(tracer_files.read_speos(tmp_path / "ink_550nm_inside.anisotropicbsdf")) == ["R"]


def test_csv_is_exact_and_states_the_totals(tmp_path):
    table = table_of(smooth, np.linspace(0, 90, 8), np.linspace(0, 180, 7), (450.0, 550.0))
    table.regular[:] = 0.0123
    _, bsdf, totals = write(table, "csv", tmp_path)
    columns, sums = tracer_files.read_csv(bsdf), tracer_files.read_csv(totals)
    np.testing.assert_array_equal(columns["bsdf_per_sr"].reshape(table.bsdf_per_sr.shape), table.bsdf_per_sr)
    assert columns["component"][:: 2 * 8 * 8 * 7] == list(COMPONENTS)
    np.testing.assert_array_equal(sums["diffuse_total"].reshape(4, 2, 8), diffuse_totals(table))
    np.testing.assert_array_equal(sums["regular"], 0.0123)
    inside = [component[2] == "I" for component in sums["component"]]
    np.testing.assert_array_equal(sums["index_in"], np.where(inside, INDEX_INSIDE, 1.0))


def test_csv_holds_no_formula_of_the_users(tmp_path):
    table = smooth_table()
    table.attrs["title"] = "ink,=HYPERLINK(1); @SUM(1)\t+1, and -1"
    for path in write(table, "csv", tmp_path)[1:]:
        lines = path.read_text().splitlines()
        assert "# title: ink,'=HYPERLINK(1);' @SUM(1) +1, and -1" in lines
        cells = [c.strip() for line in lines if line.startswith("#") for c in re.split("[,;\t]", line)]
        assert not [c for c in cells if c[:1] in ("=", "+", "-", "@")]


@pytest.mark.parametrize("kind", ["zemax", "integra", "lighttools", "speos", "klems"])
def test_each_wavelength_has_files_of_its_own(kind, tmp_path):
    name, options, reader = FILES[kind]
    files = write(smooth_table((450.0, 632.8)), name, tmp_path, ExportOptions(drop=EVERYTHING, **options))
    per_wavelength = {"zemax": 4, "integra": 4, "lighttools": 1, "speos": 2, "klems": 1}[kind]
    assert [sum(f"ink_{w}nm" in path.name for path in files) for w in ("450", "632.8")] == [
        per_wavelength
    ] * 2
    short, long = (reader(tmp_path, f"ink_{w}nm") for w in ("450", "632.8"))
    source, outgoing = ray("R_AA", 30.0, np.array([20.0, 50]), np.array([40.0, 150]))
    ratio = short("R_AA", source, outgoing) / long("R_AA", source, outgoing)
    np.testing.assert_allclose(ratio, 632.8 / 450, rtol=1e-7)


@pytest.mark.parametrize("kind", ["zemax", "lighttools"])
def test_readers_take_any_white_space_case_and_comments(kind, tmp_path, lambertian_files):
    name, options, reader = FILES[kind]
    for path in write(lambertian(), name, tmp_path, ExportOptions(drop=EVERYTHING))[:-1]:
        lines = path.read_text().upper().replace(" ", "\t").splitlines()
        path.write_bytes("".join(f"{line} \t\r\n# AOI 7\r\n" for line in lines).encode())
    again = reader(tmp_path)
    ours = ray("T_AI", 30.0, np.array([10.0, 50]), np.array([40.0, 150]))
    np.testing.assert_array_equal(again("T_AI", *ours), lambertian_files[kind]("T_AI", *ours))
