"""Files of readings: what is taken for granted, what is noted, and what is refused."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

import jaxink
from jaxink.measurement import Readings, Spheres, read_readings
from jaxink.measurement.readings import QUANTITIES

GOOD = """\
quantity,value,sigma,wavelength_nm,theta_i_deg,theta_o_deg,phi_deg
R_total,0.52,0.004,550,8,,
T_collimated,0.012,0.001,550,,,
R_45_0,0.48,0.005,550,45,0,180
T_di_8,0.1,0.002,550,,8,
"""
RXT = """\
IAD1
# by hand
1.33   # index of the sample
1.5    # of the slides
2 1    # mm, sample and slides
4      # mm, beam
0.98   # standard

1      # sphere
100 20 10 2 0.95
100 20 0 2 0.94

L r t u n # columns
500 0.4 0.3 0.01 1.33
600 0.5 0.2 0.02 1.33
"""


def written(folder, text, name="readings.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_complete_file_is_read_as_it_is(tmp_path):
    path = written(tmp_path, GOOD)
    data = jaxink.read_readings(path)
    assert isinstance(data, jaxink.Readings)
    assert len(data) == 4
    assert data.quantity.tolist() == ["R_total", "T_collimated", "R_45_0", "T_di_8"]
    np.testing.assert_array_equal(data.value, [0.52, 0.012, 0.48, 0.1])
    np.testing.assert_array_equal(data.sigma, [0.004, 0.001, 0.005, 0.002])
    np.testing.assert_array_equal(data.wavelength_nm, 550)
    np.testing.assert_array_equal(data.row, [2, 3, 4, 5])
    np.testing.assert_array_equal(data.theta_i_deg, [8, 0, 45, np.nan])
    np.testing.assert_array_equal(data.theta_o_deg, [np.nan, np.nan, 0, 8])
    np.testing.assert_array_equal(data.phi_deg, [np.nan, np.nan, 180, np.nan])
    np.testing.assert_array_equal(data.is_transmission, [False, True, False, True])
    assert data.source == str(path)
    assert not data.value.flags.writeable
    # Those of one quantity share a scan.
    assert len(set(data.scan_index.tolist())) == 4


def test_the_example_of_the_manual_is_read(tmp_path):
    page = Path(__file__).resolve().parents[2] / "docs" / "manual" / "readings.md"
    (text,) = re.findall(r"```csv\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    data = read_readings(written(tmp_path, text))
    assert data.quantity.tolist() == ["R_total", "T_total", "T_collimated", "R_45_0"]
    np.testing.assert_array_equal(data.spheres.reference_reflectance, [0.97, 0, np.nan, np.nan])


def test_only_quantity_and_value_are_required(tmp_path, told):
    rows = "\n".join(f"{name};5,5" for name in QUANTITIES)
    data = read_readings(written(tmp_path, f"quantity;value_percent\n{rows}\n"), wavelength_nm=633)
    np.testing.assert_allclose(data.value, 0.055)
    assert data.sigma is data.spheres is None
    for k, quantity in enumerate(QUANTITIES.values()):
        for name in ("theta_i_deg", "theta_o_deg"):
            usual, angle = getattr(quantity, name), getattr(data, name)[k]
            assert angle == usual if usual is not None else np.isnan(angle)
    told("\n".join(data.notes), "theta_i_deg", "ideal")
    # Lines break where the name of the folder lets them.
    told(data.summary(), "R_45_0", "633", numbers=False)


def test_wavelengths_are_selected(tmp_path, refused):
    text = GOOD.replace("T_collimated,0.012,0.001,550", "T_collimated,0.012,0.001,600")
    text = f"# sphere_wall_reflectance = 0.97\n# sphere_port_fraction = 0.01\n{text}"
    data = read_readings(written(tmp_path, text))
    assert data.at_wavelengths(()) is data
    one = data.at_wavelengths((600.0,))
    assert (one.quantity.tolist(), one.row.tolist(), one.source) == (["T_collimated"], [5], data.source)
    assert len(data.at_wavelengths((550.0,)).spheres.port_fraction) == 3
    with refused("700", "550, 600"):
        data.at_wavelengths((550.0, 700.0))


class TestSpheres:
    def read(self, tmp_path, comments="", columns="", cells=""):
        rows = f"R_total,0.5,500{cells}\nT_total,0.4,500{cells}\nT_collimated,0.1,500{',' * cells.count(',')}"
        return read_readings(
            written(tmp_path, f"{comments}quantity,value,wavelength_nm{columns}\n{rows}\n")
        ).spheres

    @pytest.mark.parametrize("as_columns", [False, True])
    @pytest.mark.parametrize(
        ("port", "expected"),
        [(None, [0.97, 0]), ("open", [0, 0]), ("closed", [0.97, 0.97]), ("0.99", [0.99, 0.99])],
    )
    def test_comments_and_columns_say_the_same(self, tmp_path, as_columns, port, expected):
        stated = {"wall_reflectance": "0.97", "port_fraction": "0.01"} | ({"reference": port} if port else {})
        if as_columns:
            given = (
                "",
                "".join(f",sphere_{name}" for name in stated),
                "".join(f",{v}" for v in stated.values()),
            )
        else:
            given = ("".join(f"# sphere_{name} = {v}\n" for name, v in stated.items()),)
        spheres = self.read(tmp_path, *given)
        np.testing.assert_array_equal(spheres.wall_reflectance, [0.97, 0.97, np.nan])
        np.testing.assert_array_equal(spheres.port_fraction, [0.01, 0.01, np.nan])
        np.testing.assert_array_equal(spheres.reference_reflectance, [*expected, np.nan])

    def test_empty_cells_are_ideal_spheres(self, tmp_path):
        path = written(
            tmp_path,
            "quantity,value,wavelength_nm,sphere_wall_reflectance,sphere_port_fraction\n"
            "R_total,0.5,500,0.97,0.01\nT_total,0.4,500,,\n",
        )
        data = read_readings(path)
        np.testing.assert_array_equal(np.isnan(data.spheres.wall_reflectance), [False, True])
        assert any("ideal" in note for note in data.notes)


COLUMNS = "L r t u n # columns"
BAD_RXT = {
    "no wavelength": ((COLUMNS, "r t u n n"), ("row 14", "wavelength_nm")),
    "a column of the program alone": ((COLUMNS, "L r t u c"), ("row 13", "column c")),
    "no readings": ((COLUMNS, "L n n n n"), ("row 13", "r, t or u")),
    "a short row": (("0.02 1.33", "0.02"), ("row 15", "4 values")),
    "text": (("0.3 0.01", "x 0.01"), ("row 14", "'x'")),
    "text in the header": (("20 10 2 0.95", "20 10 two 0.95"), ("row 10", "'two'", "detector port")),
    "two spheres": (("1      # sphere", "2"), ("2 spheres",)),
    "per cent": (("0.4 0.3", "40 0.3"), ("row 14", "column value", "40")),
    "half a header": ((RXT[RXT.index("100 20 0") :], ""), ("diameter of the transmission sphere",)),
    "a header alone": ((RXT[RXT.index("L r t") :], ""), ("columns",)),
    "no rows": ((RXT[RXT.index("500 0.4") :], ""), ("no rows",)),
}


class TestAddingDoubling:
    def test_rows_become_three_readings_each(self, tmp_path, told):
        data = read_readings(written(tmp_path, RXT, "ink.rxt"))
        assert data.quantity.tolist() == ["R_total", "T_total", "T_collimated"] * 2
        np.testing.assert_array_equal(data.value, [0.4, 0.3, 0.01, 0.5, 0.2, 0.02])
        np.testing.assert_array_equal(data.wavelength_nm, [500] * 3 + [600] * 3)
        np.testing.assert_array_equal(data.row, [14] * 3 + [15] * 3)
        np.testing.assert_array_equal(data.theta_i_deg, 0)
        sample, other, detector = (np.array([20, 10, 2]) / 200) ** 2
        wall = (1 - sample - other - detector) * 0.95 / (1 - sample)
        behind = (1 - sample - detector) * 0.94 / (1 - sample)
        np.testing.assert_allclose(data.spheres.wall_reflectance, [wall, behind, np.nan] * 2)
        np.testing.assert_allclose(data.spheres.port_fraction, [sample, sample, np.nan] * 2)
        np.testing.assert_allclose(data.spheres.reference_reflectance, [0.98, 0, np.nan] * 2)
        told("\n".join(data.notes), "1.33", "Columns n")

    def test_columns_may_have_no_letters(self, tmp_path):
        text = RXT.replace("L r t u n # columns", "2").replace(" 0.01 1.33", "").replace(" 0.02 1.33", "")
        data = read_readings(
            written(tmp_path, text.replace("600 ", "").replace("500 ", ""), "ink.rxt"), wavelength_nm=633
        )
        np.testing.assert_array_equal(data.value, [0.4, 0.3, 0.5, 0.2])
        np.testing.assert_array_equal(
            read_readings(written(tmp_path, text)).wavelength_nm, [500, 500, 600, 600]
        )

    def test_without_a_sphere_it_is_ideal(self, tmp_path):
        data = read_readings(written(tmp_path, RXT.replace("1      # sphere", "0"), "ink.rxt"))
        assert data.spheres is None
        assert any("ideal" in note for note in data.notes)

    @pytest.mark.parametrize("what", BAD_RXT)
    def test_a_bad_file_is_refused(self, tmp_path, refused, what):
        (old, new), named = BAD_RXT[what]
        assert old in RXT
        path = written(tmp_path, RXT.replace(old, new), "ink.rxt")
        with refused(path, *named):
            read_readings(path)

    def test_a_wavelength_is_stated_once(self, tmp_path, refused):
        path = written(tmp_path, RXT, "ink.rxt")
        with refused(path, "wavelength_nm"):
            read_readings(path, wavelength_nm=500)


WALL = "# sphere_wall_reflectance = 0.97\n"
BAD = {
    "unknown quantity": (("R_total", "R_totl"), ("row 2, column quantity", "R_total")),
    "other quantity": (("R_total", "gloss"), ("row 2, column quantity", "T_collimated")),
    "no quantity": (("quantity", "kind"), ("row 1, column quantity",)),
    "no value": (("value", "reading"), ("row 1, column value", "value_percent")),
    "two values": (("sigma", "value_percent"), ("row 1, column value", "value_percent")),
    "a column twice": (("theta_o_deg", "theta_i_deg"), ("column theta_i_deg", "twice")),
    "a misspelt column": (("sigma", "sigam"), ("row 1, column sigam", "sigma")),
    "no wavelength": (("wavelength_nm", "date"), ("row 1, column wavelength_nm",)),
    "empty value": (("0.012", ""), ("row 3, column value", "empty")),
    "text for a value": (("0.012", "low"), ("row 3, column value", "'low'")),
    "per cent": (("0.52", "52"), ("row 2, column value", "value_percent")),
    "negative": (("0.48", "-0.48"), ("row 4, column value", "-0.48")),
    "no noise": (("0.004", "0"), ("row 2, column sigma", "above 0")),
    "noise in per cent": (("0.004", "4"), ("row 2, column sigma", "at most 1")),
    "micrometres": (("0.52,0.004,550", "0.52,0.004,0.55"), ("row 2, column wavelength_nm", "0.55")),
    "grazing": (("550,8,,", "550,90,,"), ("row 2, column theta_i_deg", "90")),
    "no such angle": (("550,8,,", "550,8,30,"), ("row 2, column theta_o_deg", "R_total")),
    "no incidence": (("550,,8,", "550,8,8,"), ("row 5, column theta_i_deg", "T_di_8")),
    "azimuth of a total": (("550,8,,", "550,8,,0"), ("row 2, column phi_deg",)),
    "azimuth out of range": (("45,0,180", "45,0,270"), ("row 4, column phi_deg", "270")),
    "text for an angle": (("45,0,180", "45,zero,180"), ("row 4, column theta_o_deg", "'zero'")),
    "half a sphere": (("quantity", WALL + "quantity"), ("row 3, column sphere_port_fraction",)),
    "the other half": (
        ("quantity", "# sphere_port_fraction = 0.1\nquantity"),
        ("column sphere_port_fraction", "wall"),
    ),
    "unknown of a sphere": (("quantity", "# sphere_wall = 0.97\nquantity"), ("row 1", "sphere_wall_refl")),
    "a sphere twice": (("quantity", 2 * WALL + "quantity"), ("row 2", "again")),
    "text for a wall": (
        ("quantity", "# sphere_wall_reflectance = white\nquantity"),
        ("row 1", "'white'"),
    ),
    "a wall of 97": (
        ("quantity", WALL.replace("0.97", "97") + "# sphere_port_fraction = 0.01\nquantity"),
        ("column sphere_wall_reflectance", "97"),
    ),
    "a wrong port": (
        ("quantity", WALL + "# sphere_port_fraction = 0.01\n# sphere_reference = ajar\nquantity"),
        ("row 3, column sphere_reference", "'ajar'", "open, closed"),
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_file_is_refused(tmp_path, refused, what):
    (old, new), named = BAD[what]
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new, 1))
    with refused(path, *named):
        read_readings(path)


def test_a_sphere_of_collimated_light_is_refused(tmp_path, refused):
    columns = "quantity,value,wavelength_nm,sphere_wall_reflectance,sphere_port_fraction"
    text = f"{columns}\nT_collimated,0.1,500,0.9,0.1\n"
    with refused("row 2", "T_collimated"):
        read_readings(written(tmp_path, text))


def test_what_a_file_says_is_not_stated_again(tmp_path, refused):
    path = written(tmp_path, GOOD)
    with refused(path, "wavelength_nm"):
        read_readings(path, wavelength_nm=500)
    sphere = "# sphere_port_fraction = 0.1\n" + GOOD.replace("phi_deg", "sphere_port_fraction").replace(
        "180", ""
    )
    with refused("sphere_port_fraction", "comment"):
        read_readings(written(tmp_path, sphere))
    with refused("missing.csv"):
        read_readings(tmp_path / "missing.csv")


def test_readings_are_refused_without_a_file_too(refused):
    def of(values, **changes):
        nowhere, n = np.full(len(values), np.nan), len(values)
        columns = dict(theta_i_deg=np.full(n, 8.0), theta_o_deg=nowhere, phi_deg=nowhere,
                       wavelength_nm=np.full(n, 550.0), value=np.array(values, float))  # fmt: skip
        return Readings(quantity=np.full(n, "R_total"), **columns | changes)

    assert of([0.5, 0.4]).row.tolist() == [2, 3]
    with refused("Readings"):
        of([])
    with refused("Readings, row 2, column theta_i_deg"):
        of([0.5], theta_i_deg=np.array([np.nan]))
    with refused("quantity", "(1,)"):
        dataclass = of([0.5, 0.4])
        Readings(dataclass.quantity[:1], *(getattr(dataclass, name) for name in (
            "theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "value")))  # fmt: skip
    with refused("sphere_reference_reflectance"):
        of([0.5], spheres=Spheres(np.array([0.9]), np.array([0.1]), np.array([np.nan])))


def test_totals_of_measured_inks_are_read(shared_data, tmp_path):
    """The files of Prahl's collection, from the numbers of the copy; see its SOURCE.md."""
    folder = shared_data / "measured" / "sphere_totals_iad"
    with (folder / "header_parameters.csv").open() as file:
        headers = list(csv.DictReader(file))
    with (folder / "totals.csv").open() as file:
        rows = list(csv.DictReader(file))
    keys = [key for key in headers[0] if key not in ("sample", "source_file")]
    letters = {"sphere_M_R": "r", "sphere_M_T": "t", "unscattered_M_U": "u"}
    n_readings = 0
    for header in headers:
        values: dict[str, dict[str, str]] = {}
        for row in rows:
            if row["sample"] == header["sample"] and row["unit"] in letters:
                found = values.setdefault(row["row"], {"L": row["wavelength_nm"]})
                found[letters[row["unit"]]] = row["value"]
        columns = [letter for letter in "Lrtu" if next(iter(values.values())).get(letter)]
        table = [" ".join(of_row[letter] for letter in columns) for of_row in values.values()]
        text = "\n".join(["IAD1", *(header[key] for key in keys), " ".join(columns), *table])
        path = written(tmp_path, text, f"{header['sample']}.rxt")
        data = read_readings(path, wavelength_nm=None if "L" in columns else 632.8)
        n_readings += len(data)
        assert 0 <= data.value.min() <= data.value.max() < 1
        total = {name: data.value[data.quantity == name] for name in ("R_total", "T_total", "T_collimated")}
        assert np.all(total["R_total"] + total["T_total"] < 0.95)
        if total["T_collimated"].size:
            assert np.all(total["T_collimated"] <= total["T_total"] + 0.02)
        walls = data.spheres.wall_reflectance[data.is_of_sphere]
        assert np.all((walls > 0.8) & (walls < 1))
        assert np.all(data.spheres.port_fraction[data.is_of_sphere] < 0.02)
    assert n_readings == sum(row["unit"] in letters for row in rows) > 2000
