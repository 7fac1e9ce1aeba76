"""No format brings in a value that is physically impossible, nor lets one value scale all the others."""

import re

import numpy as np
import pytest

import jaxink
from jaxink.measurement.formats.polar_tables import lone_values
from tests.formats import files
from tests.formats.test_bad_files import STATED, WHOLE

# Row and column of a value of each text format.
PLACES = {
    "zemax": (19, 3),
    "lighttools": (15, 2),
    "speos": (32, 4),
    "brdf": (16, 5),
    "astm": (12, 5),
    "pab": (14, 3),
    "reflet": (5, 4),
}


@pytest.fixture
def with_word(tmp_path):
    """A file with another word at a place, from 1."""

    def write(text, row, column, word):
        rows = text.split("\n")
        parts = re.split(r"([,\s]+)", rows[row - 1])
        parts[2 * (column - 1)] = word
        rows[row - 1] = "".join(parts)
        path = tmp_path / "measured.bsdf"
        path.write_text("\n".join(rows), newline="")
        return path

    return write


@pytest.mark.parametrize("word", ["2147483648", "-5e9", "1e18"])
@pytest.mark.parametrize("kind", PLACES)
def test_more_than_all_light_in_the_narrowest_cone_is_refused(kind, word, with_word, refused):
    with refused("measured.bsdf", f"row {PLACES[kind][0]}", "column"):
        jaxink.read(with_word(WHOLE[kind], *PLACES[kind], word), **STATED.get(kind, {}))


@pytest.mark.parametrize("kind", sorted(PLACES.keys() - {"speos", "brdf"}))
def test_the_peak_of_a_laser_goniometer_is_read(kind, with_word):
    data = jaxink.read(with_word(WHOLE[kind], *PLACES[kind], "1e6"), **STATED.get(kind, {}))
    # Divided by the cosine where the format says so.
    assert 1e6 <= data.bsdf_per_sr.max() < 2e6


@pytest.mark.parametrize("word", ["5000", "1e6", "-1e6"])
@pytest.mark.parametrize("column", [2, 9])
@pytest.mark.parametrize(("kind", "row"), [("speos", 30), ("speos", 45), ("brdf", 14), ("brdf", 90)])
def test_one_value_of_speos_does_not_scale_the_others(kind, row, column, word, with_word, refused):
    with refused("measured.bsdf", f"row {row}, column {column}", numbers=False):
        jaxink.read(with_word(WHOLE[kind], row, column, word))


def test_two_values_of_speos_do_not_scale_the_others(with_word, refused):
    once = with_word(WHOLE["speos"], 40, 6, "1e6").read_text()
    with refused("row 44, column 7"):
        jaxink.read(with_word(once, 44, 7, "2e6"))


def test_resolved_peaks_and_floors_are_no_lone_values():
    peak = np.exp(-(((np.arange(90) - 40) / 2.0) ** 2))[:, None] * np.ones(36) + 1e-6
    assert not lone_values(peak).size
    floor = np.where(np.arange(200) < 150, 0.3, 1e-9)
    assert not lone_values(floor).size
    assert not lone_values(np.where(np.arange(200) < 1, 1.0, 0.0)).size


@pytest.mark.parametrize(("kind", "row"), [("speos", 21), ("speos", 27), ("brdf", 11), ("brdf", 33)])
@pytest.mark.parametrize("word", ["5000", "-20"])
def test_percentages_beyond_the_incident_light_are_refused(kind, row, word, with_word, refused):
    column = 2 if kind == "speos" else 1
    with refused("measured.bsdf", f"row {row}"):
        jaxink.read(with_word(WHOLE[kind], row, column, word))


@pytest.mark.parametrize(("kind", "row", "column"), [("astm", 9, 4), ("pab", 10, 2), ("speos", 29, 13)])
def test_azimuths_beyond_all_turns_are_refused(kind, row, column, with_word, refused):
    with refused("measured.bsdf", "azimuth", numbers=False):
        jaxink.read(with_word(WHOLE[kind], row, column, "1e7"), **STATED.get(kind, {}))


def test_one_value_of_a_density_does_not_turn_all_directions(tmp_path, refused):
    fields = files.rgl(n=4)
    fields["vndf"] = fields["vndf"].copy()
    fields["vndf"][0, 1, 2, 3] = 1e6
    path = tmp_path / "measured.bsdf"
    path.write_bytes(files.tensor_file(fields))
    with refused("vndf"):
        jaxink.read(path, wavelength_nm=550)


def test_absurd_values_of_binary_files_are_refused(tmp_path, refused):
    fields = files.rgl(n=4)
    fields["spectra"] = fields["spectra"].copy()
    fields["spectra"][0, 1, :, 2, 1] = 1e12
    (tmp_path / "rgl.bsdf").write_bytes(files.tensor_file(fields))
    with refused("rgl.bsdf", "bsdf_per_sr", numbers=False):
        jaxink.read(tmp_path / "rgl.bsdf", wavelength_nm=550)
    merl = files.merl(lambda name, theta_h, theta_d, phi_d: np.where(theta_h < 5, 1e12, 0.1) + 0 * phi_d)
    (tmp_path / "merl.binary").write_bytes(merl)
    with refused("merl.binary", "bsdf_per_sr", numbers=False):
        jaxink.read(tmp_path / "merl.binary", wavelength_nm=550, channel="R")
