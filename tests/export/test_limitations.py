"""What a format cannot hold is refused by name, and files are written whole or not at all."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from jaxink.export import FORMATS, LOSSES, ExportOptions, write
from jaxink.export.formats import _FORMATS
from jaxink.export.preparation import regular_in_bins
from jaxink.ink.hemispherical_totals import diffuse_totals
from tests.export.tracer_files import lighttools, read_zemax, zemax
from tests.ink.analytic_tables import lambertian, smooth_table, table_of

TITLES = {
    "zemax": "Zemax .bsdf",
    "lighttools": "LightTools .bsdf",
    "speos": "Speos .anisotropicbsdf",
    "radiance": "Radiance XML",
}
WITHOUT_ERRORS = TITLES | {"mitsuba": "Mitsuba 3", "integra": "Integra .ddr, .ddt, .sdr, .sdt"}


DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "manual" / "export.md"


def with_regular(share=0.25):
    table = smooth_table()
    beyond = table.theta_deg > np.degrees(np.arcsin(1 / 1.5)) + 1e-6
    regular = np.full(table.regular.shape, share)
    regular[0, 0, beyond], regular[1, 0, beyond] = 2 * share, 0
    return dataclasses.replace(table, regular=regular)


@pytest.fixture
def refused_table(refused, tmp_path):
    """Refuses to write a table by a sentence with all of these, and writes nothing; gives the sentence."""

    def refuse(table, format, *named, **options):
        with refused(*named) as caught:
            write(table, format, tmp_path, ExportOptions(**options))
        assert list(tmp_path.iterdir()) == []
        return str(caught.value)

    return refuse


@pytest.mark.parametrize("format", TITLES)
def test_regular_part_is_refused_where_it_cannot_be_kept_apart(format, tmp_path, refused_table):
    # Index 1 on both sides, so that nothing else is lost.
    table = table_of(lambda *_: 0.1, [0.0, 45, 90], [0.0, 90, 180], index_inside=1.0)
    table.regular[3, 0, 1] = 0.0321
    largest = ("3.21 %", "R_AA at 45 degrees, 550 nm")
    refused_table(table, format, TITLES[format], *largest, "--allow-loss regular)", "--regular-bin-deg")
    assert write(table, format, tmp_path, ExportOptions(drop=("regular",)))


def test_zemax_refuses_diffuse_transmission_beyond_the_critical_angle(tmp_path, refused_table):
    most = diffuse_totals(smooth_table())[1, 0, -1]
    sentence = refused_table(smooth_table(), "zemax", "beyond_critical", "T_IA", "41.81 degrees, 550 nm")
    assert any(most < float(number) / 100 <= 1 for number in re.findall(r"([\d.]+) %", sentence))
    write(smooth_table(), "zemax", tmp_path, ExportOptions(drop=("beyond_critical",)))


def test_zemax_takes_an_ink_that_sends_nothing_beyond_the_critical_angle(tmp_path):
    table = smooth_table()
    table.bsdf_per_sr[1, :, table.theta_deg > 41.9] = 0
    assert [path.suffix for path in write(table, "zemax", tmp_path)] == 4 * [".bsdf"] + [".txt"]


def test_radiance_refuses_media(refused_table):
    refused_table(smooth_table(), "radiance", "index_step", "1.5 inside, 1 outside")


@pytest.mark.parametrize("format", WITHOUT_ERRORS)
def test_standard_errors_are_refused(format, tmp_path, refused_table):
    table = lambertian()
    table = dataclasses.replace(table, bsdf_standard_error_per_sr=0.01 * table.bsdf_per_sr)
    allowed = ("beyond_critical", "index_step")
    refused_table(table, format, WITHOUT_ERRORS[format], "standard_errors", drop=allowed)
    assert write(table, format, tmp_path, ExportOptions(drop=(*allowed, "standard_errors")))


def test_all_losses_are_named_at_once(refused_table):
    table = dataclasses.replace(with_regular(), regular_standard_error=0.01 * with_regular().regular)
    refused_table(table, "zemax", "--allow-loss regular,beyond_critical,standard_errors)")


def test_regular_part_in_bins_keeps_the_sum_and_the_direction(tmp_path):
    table = table_of(lambda *_: 0.0, np.linspace(0, 90, 37), np.linspace(0, 180, 73))
    table.regular[0] = 0.4
    table.regular[1, 0, table.theta_deg < 41.8] = 0.3
    folded = regular_in_bins(table, 6.0)
    np.testing.assert_allclose(diffuse_totals(folded), table.regular, atol=1e-12)
    assert not folded.regular.any()
    i = int(np.flatnonzero(table.theta_deg == 30)[0])
    for component, leaving in ((0, 30.0), (1, np.degrees(np.arcsin(0.75)))):
        o, p = np.unravel_index(np.argmax(folded.bsdf_per_sr[component, 0, i]), (37, 73))
        assert table.theta_deg[o] == pytest.approx(leaving, abs=1.3)
        assert table.phi_deg[p] == 180
    # In the file the bin is at the specular direction, half as high at half the stated width.
    drop = ("beyond_critical",)
    write(table, "zemax", tmp_path, ExportOptions(drop=drop, regular_bin_deg=6.0))
    file = read_zemax(tmp_path / "ink_550nm_R_II.bsdf")
    peak = file["values"][i, 18]
    assert np.argmax(peak) == 0
    assert np.interp(3.0, file["scatterradial"], peak) / peak[0] == pytest.approx(0.5, abs=0.05)
    assert (
        "in cones of 6 degrees full width at half maximum" in (tmp_path / "ink_550nm_R_II.bsdf").read_text()
    )
    assert zemax(tmp_path).files["T_IA"]["tis"][i] == pytest.approx(0.3, rel=1e-8)


def test_bins_narrower_than_the_table_are_refused(refused_table):
    refused_table(with_regular(), "lighttools", "regular_bin_deg", "5 degrees", regular_bin_deg=2.0)
    refused_table(with_regular(), "lighttools", "regular_bin_deg", "30 degrees", regular_bin_deg=-1.0)
    refused_table(with_regular(), "csv", regular_bin_deg=6.0)


def test_energy_from_nothing_is_refused(refused_table):
    table = lambertian(regular=np.full((4, 1, 10), 0.45))
    refused_table(table, "csv", "1.5 times", "side I")


@pytest.mark.parametrize(
    ("value", "named"), [(np.nan, "bsdf_per_sr"), (-0.1, "-0.1")], ids=["not finite", "negative"]
)
def test_values_that_are_no_bsdf_are_refused(value, named, refused_table):
    table = lambertian()
    table.bsdf_per_sr[2, 0, 3, 4, 5] = value
    refused_table(table, "csv", named)


def test_rounding_below_zero_is_written_as_zero(tmp_path):
    table = lambertian()
    table.bsdf_per_sr[1, 0, 1, 1] = -1e-12
    write(table, "lighttools", tmp_path)
    assert lighttools(tmp_path).blocks["back", "btdf"][1]["values"].min() == 0


def test_zemax_axes_that_are_not_given_are_as_fine_as_the_table_needs(tmp_path):
    width = np.deg2rad(2.0)

    def lobe(component, wavelength_nm, theta_i, theta_o, phi):
        t, o, p = np.deg2rad(50.0), np.deg2rad(theta_o), np.deg2rad(phi)
        cosine = np.cos(t) * np.cos(o) - np.sin(t) * np.sin(o) * np.cos(p)
        angle = np.arccos(np.clip(cosine, -1, 1))
        return (component == "R_AA") * np.exp(-0.5 * (angle / width) ** 2) / (2 * np.pi * width**2)

    table = table_of(lobe, np.linspace(0, 90, 61), np.linspace(0, 180, 73), index_inside=1.0)
    paths = write(table, "zemax", tmp_path)
    azimuths = {
        path.name: read_zemax(path)["scatterazimuth"].size for path in paths if path.suffix == ".bsdf"
    }
    assert azimuths["ink_550nm_R_II.bsdf"] == 37
    assert azimuths["ink_550nm_R_AA.bsdf"] in (73, 145)
    total = read_zemax(tmp_path / "ink_550nm_R_AA.bsdf")["tis"]
    np.testing.assert_allclose(total, np.cos(np.deg2rad(50)), rtol=0.1)


def test_coarse_zemax_axes_are_refused(refused_table):
    table = table_of(
        lambda c, w, i, o, p: np.exp(-0.5 * (np.hypot(o - 40, p - 60) / 8) ** 2),
        range(0, 91, 3),
        range(0, 181, 5),
    )
    axes = {"radial_deg": (0.0, 90, 180), "azimuth_deg": (0.0, 90, 180)}
    named = ("Zemax", "R_II", "550 nm", "radial_deg", "azimuth_deg")
    refused_table(table, "zemax", *named, drop=("beyond_critical",), **axes)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"drop": ("colour",)}, "colour"),
        ({"basis": "klems_half"}, "klems_half"),
        ({"name": "my ink"}, "my ink"),
        ({"radial_deg": (0.0, 90.0)}, "radial_deg"),
    ],
)
def test_bad_options_are_refused(options, named, refused):
    with refused(named):
        ExportOptions(**options)


def test_an_unknown_format_is_refused(refused_table):
    refused_table(lambertian(), "merl", "merl", *FORMATS)


def test_the_folder_is_created_but_replaces_no_file(tmp_path, refused):
    files = write(lambertian(), "csv", tmp_path / "new" / "folder")
    assert all(file.parent == tmp_path / "new" / "folder" and file.is_file() for file in files)
    (tmp_path / "taken").touch()
    with refused("taken"):
        write(lambertian(), "csv", tmp_path / "taken")


def test_failed_writing_leaves_the_folder_as_it_was(tmp_path, monkeypatch, refused):
    write(lambertian(), "csv", tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("jaxink.export.flat_csv._write_totals", full)
    with refused("No space left on device"):
        write(smooth_table(), "csv", tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_the_document_names_every_format_and_its_losses():
    lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
    # Not those of a file, whose name has a suffix.
    rows = [re.findall(r"`(\w+)`", line) for line in lines if re.match(r"\| `\w+`", line)]
    assert [row[0] for row in rows if row[0] in LOSSES] == list(LOSSES)
    # A later table says what programs do with the power that a row lacks.
    formats = {row[0]: row[1:] for row in reversed(rows)}
    for name in FORMATS:
        assert [loss for loss in formats[name] if loss in LOSSES] == list(_FORMATS[name].lost)
