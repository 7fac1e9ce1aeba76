"""Files written from the formats' descriptions give their BSDF in the canonical directions."""

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from tests.formats import files
from tests.formats.files import bsdf

# Text of a file, what has to be stated, sides, and the factor by which each value is that of `bsdf`.
READ = {
    "zemax reflection": (files.zemax("R"), {"wavelength_nm": 550}, "R"),
    "zemax transmission": (files.zemax("T"), {"wavelength_nm": 550}, "T"),
    "zemax full circle": (files.zemax("R", symmetry="Asymmetrical"), {"wavelength_nm": 550}, "R"),
    "zemax rotated": (
        files.zemax("R", rotations=(0, 90), symmetry="Asymmetrical4D"),
        {"wavelength_nm": 550, "rotation_deg": 0},
        "R",
    ),
    "zemax tristimuli": (
        files.zemax("R", channels={"TristimulusX": 3.0, "TristimulusY": 1.0, "TristimulusZ": 2.0}),
        {"wavelength_nm": 550, "channel": "Y"},
        "R",
    ),
    "lighttools": (files.lighttools(), {}, "RT"),
    "lighttools face": (files.lighttools(faces=("Back", "Front")), {"face": "front"}, "RT"),
    "lighttools rotated": (files.lighttools(pois=(0, 30)), {"rotation_deg": 0}, "RT"),
    "lighttools side": (files.lighttools(), {"side": "T"}, "T"),
    "speos": (files.speos_anisotropic(), {}, "RT"),
    "speos relative": (files.speos_anisotropic(scale=7.0), {}, "RT"),
    "speos bsdf": (files.speos_anisotropic("T", is_intensity=False), {}, "T"),
    "speos spectrum": (files.speos_anisotropic("R", spectrum=(400, 700)), {"wavelength_nm": 550}, "R"),
    "speos rotated": (files.speos_anisotropic("R", rotations=(0, 90)), {"rotation_deg": 90}, "R"),
    "astm degrees": (files.astm(["550nm"], is_radian=False), {"side": "R"}, "R"),
    "astm radians": (files.astm(["550nm"]), {"side": "R", "angle_unit": "rad"}, "R"),
    "astm both sides": (files.astm(["550nm"], is_radian=False, through=True), {}, "RT"),
}
# The totals of tables in steps of 5 and 30 degrees.
WITHIN = 5e-3


def written(folder, text, name="measured.dat"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize("kind", READ)
def test_directions_and_values(kind, tmp_path):
    text, stated, sides = READ[kind]
    # The Lambertian part alone would not show a wrong direction.
    data = jaxink.read(written(tmp_path, text), **stated)
    assert set(data.side.tolist()) == set(sides)
    for side in sides:
        here = data.side == side
        angles = (data.theta_i_deg[here], data.theta_o_deg[here], data.phi_deg[here])
        true = bsdf(*angles, side) * (0.5 if kind.startswith("astm") else 1)
        np.testing.assert_allclose(data.bsdf_per_sr[here], true, rtol=WITHIN)
        # Both half-planes, and directions out of the plane of incidence.
        assert (np.abs(angles[2]) < 80).any()
        assert (np.abs(angles[2]) > 100).any()
        assert np.unique(angles[0]).size >= 2
    # Every direction once.
    directions = np.column_stack([*data.directions[:3], data.is_transmission])
    assert len(np.unique(np.round(directions, 6), axis=0)) == len(data)


def test_values_of_zemax_are_exact(tmp_path):
    data = jaxink.read(written(tmp_path, files.zemax()), wavelength_nm=550)
    true = bsdf(data.theta_i_deg, data.theta_o_deg, data.phi_deg)
    np.testing.assert_allclose(data.bsdf_per_sr, true, rtol=1e-9)
    # The direction that the pole of the file stands for.
    pole = (data.theta_i_deg == 30) & (data.theta_o_deg == 30) & (data.phi_deg == 180)
    assert pole.sum() == 1


def test_a_spectrum_of_speos_scales_the_values(tmp_path):
    text = files.speos_brdf(scale=3.0)
    data = jaxink.read(written(tmp_path, text))
    assert np.unique(data.wavelength_nm).tolist() == [450, 650]
    for side in "RT":
        here = data.side == side
        angles = (data.theta_i_deg[here], data.theta_o_deg[here], data.phi_deg[here])
        true = bsdf(*angles, side) * data.wavelength_nm[here] / 650
        np.testing.assert_allclose(data.bsdf_per_sr[here], true, rtol=WITHIN)
    assert any("scaled" in note for note in data.notes)


def test_wavelengths_of_astm_are_columns(tmp_path):
    data = jaxink.read(written(tmp_path, files.astm(is_radian=False)), side="T")
    low, high = (data.select(wavelength_nm=nm).bsdf_per_sr for nm in (450, 650))
    np.testing.assert_allclose(high, 2 * low, rtol=1e-9)
    one = jaxink.read(written(tmp_path, files.astm(is_radian=False)), side="T", wavelength_nm=650)
    np.testing.assert_array_equal(one.bsdf_per_sr, high)


def test_a_cosine_is_divided_out(tmp_path):
    path = written(tmp_path, files.astm(["550nm"], is_radian=False))
    plain = jaxink.read(path, side="R")
    divided = jaxink.read(path, side="R", cosine_weighted=True)
    np.testing.assert_allclose(
        divided.bsdf_per_sr * np.cos(np.deg2rad(plain.theta_o_deg)), plain.bsdf_per_sr, rtol=1e-12
    )


def test_a_cosine_is_divided_out_of_a_table_with_its_sigma(tmp_path):
    rows = ["theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr,sigma_per_sr"]
    rows += [
        f"30,{t},180,550,R,{0.2 * np.cos(np.deg2rad(t))},{0.01 * np.cos(np.deg2rad(t))}" for t in (0, 45, 60)
    ]
    data = jaxink.read(written(tmp_path, "\n".join(rows), "a.csv"), cosine_weighted=True)
    np.testing.assert_allclose(data.bsdf_per_sr, 0.2, rtol=1e-12)
    np.testing.assert_allclose(data.sigma_per_sr, 0.01, rtol=1e-12)
    with pytest.raises(InputRefusedError, match="row 5, column theta_o_deg"):
        jaxink.read(
            written(tmp_path, "\n".join([*rows, "30,90,180,550,R,0,1"]), "a.csv"), cosine_weighted=True
        )


def test_rows_are_those_of_the_file(tmp_path):
    text = files.lighttools(sides=("BRDF",), incidences=(45,))
    data = jaxink.read(written(tmp_path, text))
    of_row = text.split("\n")
    for point in range(0, len(data), 7):
        values = [float(word) for word in of_row[data.row[point] - 1].split()]
        assert np.isclose(values, data.bsdf_per_sr[point], rtol=1e-9).any()


def test_line_ends_case_and_tabs(tmp_path):
    text = files.zemax()
    same = jaxink.read(written(tmp_path, text), wavelength_nm=550)
    other = (
        text.replace(" ", "\t").replace("\n", "  \r\n").replace("PlaneSym", "PLANEsym").replace("TIS", "tis")
    )
    other = jaxink.read(written(tmp_path, other), wavelength_nm=550)
    np.testing.assert_array_equal(other.bsdf_per_sr, same.bsdf_per_sr)


def test_several_files_are_joined(tmp_path):
    first = written(tmp_path, files.astm(["550nm"], is_radian=False), "R.astm")
    second = written(tmp_path, files.astm(["550nm"], is_radian=False), "T.astm")
    data = jaxink.read([first, second], side=["R", "T"])
    assert set(data.side.tolist()) == {"R", "T"}
