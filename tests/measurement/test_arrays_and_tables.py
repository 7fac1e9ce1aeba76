"""Arrays and tables in memory are read by the rules of a file."""

import numpy as np
import pytest

import jaxink
from jaxink.data import simulated_example
from tests.measurement.bad_inputs import GOOD

pandas = pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def data():
    return jaxink.read(simulated_example()[0])


def arrays(data, angle=1.0, wavelength=1.0, value=1.0):
    angles = (angle * getattr(data, name) for name in ("theta_i_deg", "theta_o_deg", "phi_deg"))
    sigma = data.sigma_per_sr * value
    return *angles, data.wavelength_nm * wavelength, data.is_transmission, data.bsdf_per_sr * value, sigma


def test_arrays_in_the_right_units_are_taken(data):
    again = jaxink.GonioData(*arrays(data))
    np.testing.assert_array_equal(again.bsdf_per_sr, data.bsdf_per_sr)


@pytest.mark.parametrize(
    ("wrong", "remedy"),
    [
        ({"angle": np.pi / 180}, "180/pi"),
        ({"wavelength": 1e-3}, "1000"),
        ({"wavelength": 1e-9}, "1e9"),
        ({"value": 100.0}, "100"),
        ({"value": 100 * np.pi}, "pi"),
    ],
    ids=["radians", "micrometres", "metres", "per cent", "reflectance factors in per cent"],
)
def test_arrays_in_other_units_are_refused_as_a_file_is(wrong, remedy, data, refused, tmp_path):
    with refused("GonioData", remedy, numbers=False):
        jaxink.GonioData(*arrays(data, **wrong))
    names = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr", "sigma_per_sr")
    frame = pandas.DataFrame(dict(zip(names, arrays(data, **wrong), strict=True)))
    frame["side"] = data.side
    with pytest.raises(jaxink.InputRefusedError) as of_frame:
        jaxink.read(frame)
    frame.to_csv(tmp_path / "gonio.csv", index=False)
    with pytest.raises(jaxink.InputRefusedError) as of_file:
        jaxink.read(tmp_path / "gonio.csv")
    told_of_file = str(of_file.value).partition("column")[2]
    assert told_of_file
    assert told_of_file == str(of_frame.value).partition("column")[2]


def test_parts_of_a_measurement_are_not_doubted(data):
    near = data.replace(
        theta_o_deg=data.theta_o_deg / 50, theta_i_deg=0 * data.theta_i_deg, phi_deg=0 * data.phi_deg
    )
    assert len(near.select(side="R")) == (data.side == "R").sum()
    prediction = jaxink.GonioData(*arrays(data)[:5], np.ones(len(data)))
    assert len(prediction) == len(data)


def frame_of(lines):
    names, *rows = (line.split(",") for line in lines)
    frame = pandas.DataFrame(rows, columns=names)
    return frame.astype({name: float for name in names if name != "side"})


def test_a_frame_is_read_as_a_file(data):
    again = jaxink.read(data.to_frame())
    for name in (
        "theta_i_deg",
        "theta_o_deg",
        "phi_deg",
        "wavelength_nm",
        "side",
        "bsdf_per_sr",
        "sigma_per_sr",
    ):
        np.testing.assert_array_equal(getattr(again, name), getattr(data, name))
    np.testing.assert_array_equal(again.row, np.arange(len(data)))


def test_a_frame_takes_what_a_table_takes():
    frame = frame_of(GOOD).drop(columns=["side"]).rename(columns={"theta_i_deg": "Einfallswinkel [°]"})
    frame["bsdf_per_sr"] *= np.cos(np.deg2rad(frame["theta_o_deg"]))
    data = jaxink.read(frame, side="T", cosine_weighted=True)
    assert data.is_transmission.all()
    np.testing.assert_allclose(data.bsdf_per_sr, [0.3, 0.29, 0.28, 0.27, 0.21])


def test_frames_are_joined():
    frame = frame_of(GOOD)
    both = jaxink.read([frame, frame.assign(side="T")])
    assert len(both) == 10
    assert both.source == "DataFrame 1 + DataFrame 2"


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda f: f.assign(bsdf_per_sr=[0.3, np.nan, 0.28, 0.27, 0.21]), "row 1"),
        (
            lambda f: f.assign(bsdf_per_sr=pandas.array([0.3, None, 0.28, 0.27, 0.21], dtype="Float64")),
            "row 1",
        ),
        (lambda f: f.iloc[:0], "no rows"),
        (lambda f: f[[]], "no columns"),
        (lambda f: pandas.concat([f, f[["phi_deg"]]], axis=1), "phi_deg"),
        (lambda f: f.drop(columns=["side"]), "side"),
    ],
)
def test_a_bad_frame_is_refused(change, named, refused):
    with refused("DataFrame", named):
        jaxink.read(change(frame_of(GOOD)))


@pytest.mark.parametrize("thing", [7, {30.0}, None, [3]], ids=["number", "set", "None", "list"])
def test_other_things_are_no_measurement(thing, refused):
    with refused("DataFrame"):
        jaxink.read(thing)


def test_options_of_other_formats_have_no_meaning_for_a_frame(refused):
    with refused("DataFrame", "sheet"):
        jaxink.read(frame_of(GOOD), sheet="a")


def test_a_dict_of_columns_is_read_as_a_table(refused):
    frame = frame_of(GOOD)
    columns = {name: frame[name].to_numpy() for name in frame.columns}
    # One entry is that of all rows.
    assert jaxink.read({**columns, "side": "T"}).is_transmission.all()
    assert jaxink.read({**columns, "wavelength_nm": 550.0}).equals(
        jaxink.read({**columns, "wavelength_nm": [550.0] * len(frame)})
    )
    read = jaxink.read(columns)
    np.testing.assert_array_equal(read.bsdf_per_sr, frame["bsdf_per_sr"])
    assert read.source == "dict"
    with refused("dict", "phi_deg", "2"):
        jaxink.read({**columns, "phi_deg": [0.0, 180.0]})


def test_one_number_in_place_of_an_array_is_that_of_all_points(data, refused):
    theta_i, theta_o, phi, wavelength, is_transmission, bsdf = arrays(data)[:6]
    one = jaxink.GonioData(theta_i, theta_o, phi, 550.0, True, bsdf)
    assert one.equals(
        jaxink.GonioData(theta_i, theta_o, phi, np.full(len(data), 550.0), np.ones(len(data), bool), bsdf)
    )
    with refused("shape (648,)"):
        jaxink.GonioData(theta_i, theta_o, phi, wavelength, is_transmission, 0.3)
