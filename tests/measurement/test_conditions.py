"""Rows of equal directions that differ in another column: repeats of one condition, or several conditions."""

import numpy as np
import pytest

from jaxink.measurement import estimate_noise, read

HEADER = "theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr"
VIEWS = range(5, 65, 5)
RNG = np.random.default_rng(7)


def file(folder, column, values, per_direction=2):
    """Every direction so many times in a row, with a further column."""
    path = folder / "gonio.csv"
    rows = [f"30,{view},90,550,R,{0.2 + 0.01 * (i % 3)}" for view in VIEWS for i in range(per_direction)]
    path.write_text(
        "\n".join([f"{HEADER},{column}", *(f"{r},{v}" for r, v in zip(rows, values, strict=True))])
    )
    return path


def twice(first, second):
    return [first, second] * len(VIEWS)


CONDITIONS = {
    "lit_side": (twice("front", "back"), "front", 2, "back"),
    "lit side": (["front"] * 23 + ["back"], "front", 24, "back"),
    "polarisation_deg": (twice(0, 90), 0, 2, 90),
    "Polarizer": (twice(1, 2), 1, 2, 2),
    "temperature_c": (twice(20.0, 40.0), 20, 2, 40),
    "plate": (["a", "a", *twice("a", "b")[2:]], "a", 4, "b"),
    "is_wet": (twice(0, 1), 0, 2, 1),
}
RECORDS = {
    "repeat": twice("first", "second"),
    "scan_number": twice(7, 8),
    "run": twice("a", "b"),
    "position": twice(1, 2),
    "timestamp": [f"2024-05-01T10:{minute:02d}" for minute in range(24)],
    "date": twice("2024-05-01", "2024-05-02"),
    "comment": ["", "", "lamp replaced", *[""] * 21],
    "weather": ["", "", "cloudy", *[""] * 21],
    "dark_current_na": RNG.uniform(1, 2, 24).round(3).tolist(),
    "room_temperature_c": RNG.choice([20.1, 20.2, 20.3, 20.4, 20.5, 20.6], 24).tolist(),
    "counts": (1000 + RNG.permutation(24)).tolist(),
    "plate": [value for view in VIEWS for value in [f"at {view}"] * 2],
}


@pytest.mark.parametrize("name", CONDITIONS)
def test_several_conditions_are_refused(name, tmp_path, refused):
    values, first, row, second = CONDITIONS[name]
    path = file(tmp_path, name, values)
    with refused(path, f"row {row + 1}", name, f"row {row}", first, second):
        read(path)


@pytest.mark.parametrize("name", RECORDS)
def test_repeats_of_one_condition_are_read(name, tmp_path):
    data = read(file(tmp_path, name, RECORDS[name]))
    assert estimate_noise(data).source("repeats").pairs == len(VIEWS)


def test_conditions_at_different_directions_are_read(tmp_path):
    path = tmp_path / "gonio.csv"
    rows = [
        f"30,{view},{phi},550,R,0.2,{plane}"
        for plane, phi in (("in", 180), ("across", 90))
        for view in (0, 20, 40)
    ]
    path.write_text("\n".join([f"{HEADER},plane", *rows]))
    # Along the normal both planes hold the same direction, and say so by an azimuth.
    assert len(read(path)) == 6
