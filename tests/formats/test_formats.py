"""Files written from the formats' descriptions give their BSDF in the canonical directions."""

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from tests.formats import files
from tests.formats.files import bsdf

REFLET = {"side": "R", "wavelength_nm": 550, "specular_phi_deg": -90, "scale": 1, "cosine_weighted": False}
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
    "lighttools half": (files.lighttools(half=(90, 270)), {}, "RT"),
    "lighttools turned": (files.lighttools(half=(0, 180), source=0), {"specular_phi_deg": 180}, "RT"),
    "lighttools side": (files.lighttools(), {"side": "T"}, "T"),
    "speos": (files.speos_anisotropic(), {}, "RT"),
    "speos relative": (files.speos_anisotropic(scale=7.0), {}, "RT"),
    "speos bsdf": (files.speos_anisotropic("T", is_intensity=False), {}, "T"),
    "speos spectrum": (files.speos_anisotropic("R", spectrum=(400, 700)), {"wavelength_nm": 550}, "R"),
    "speos rotated": (files.speos_anisotropic("R", rotations=(0, 90)), {"rotation_deg": 90}, "R"),
    "astm degrees": (files.astm(["550nm"], is_radian=False), {"side": "R"}, "R"),
    "astm radians": (files.astm(["550nm"]), {"side": "R", "angle_unit": "rad"}, "R"),
    "astm both sides": (files.astm(["550nm"], is_radian=False, through=True), {}, "RT"),
    "zemax with the cosine": (
        files.zemax("T", weighted=True),
        {"wavelength_nm": 550, "cosine_weighted": True},
        "T",
    ),
    "lighttools with the cosine": (files.lighttools(weighted=True), {"cosine_weighted": True}, "RT"),
    "speos as it states": (files.speos_anisotropic(), {"cosine_weighted": True}, "RT"),
    "pab-opto as it states": (files.mountain(), {"wavelength_nm": 555, "cosine_weighted": True}, "RT"),
    "pab-opto": (files.mountain(), {"wavelength_nm": 555}, "RT"),
    "pab-opto from the back": (
        files.mountain((130.0, 20.0), "BTDF"),
        {"wavelength_nm": 555, "face": "back"},
        "RT",
    ),
    "pab-opto tristimuli": (files.mountain(channels=3), {"wavelength_nm": 600, "channel": "Z"}, "RT"),
    "reflet": (files.reflet(scale=5.0), REFLET | {"scale": 0.2, "theta_i_deg": 20}, "R"),
    "reflet with incidence": (
        files.reflet(specular_phi=0.0, states_incidence=True),
        REFLET | {"specular_phi_deg": 0},
        "R",
    ),
    "rgl": (files.tensor_file(files.rgl()), {"wavelength_nm": 600}, "R"),
    "rgl of one azimuth": (
        files.tensor_file(files.rgl(phi_i_deg=(-180, -60, 60, 180))),
        {"wavelength_nm": 600, "rotation_deg": 60},
        "R",
    ),
}
# Of one incidence each.
ONE_INCIDENCE = ("pab-opto", "reflet")
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
        assert np.unique(angles[0]).size >= (1 if kind.startswith(ONE_INCIDENCE) else 2)
    # Every direction once, but those that the instrument measures twice.
    if kind.startswith("reflet"):
        return
    directions = np.column_stack([*data.directions[:3], data.is_transmission])
    assert len(np.unique(np.round(directions, 6), axis=0)) == len(data)


def test_the_cell_of_merl_is_that_of_half_and_difference_angles(tmp_path):
    def function(channel, theta_h, theta_d, phi_d):
        own = {"R": 0.1, "G": 0.2, "B": 0.3}[channel]
        waves = np.sin(np.deg2rad(theta_d)) ** 2 * np.sin(np.deg2rad(phi_d)) ** 2
        return own * (np.cos(np.deg2rad(theta_h)) + np.cos(np.deg2rad(theta_d)) / 2 + waves)

    path = written(tmp_path, files.merl(function), "paint.binary")
    data = jaxink.read(path, channel="G", wavelength_nm=540, every=20)
    assert np.unique(data.theta_i_deg).tolist() == [0, 20, 40, 60, 80]
    angles = zip(data.theta_i_deg, data.theta_o_deg, data.phi_deg, strict=True)
    true = np.array([function("G", *files.half_and_difference(*each)) for each in angles])
    # Within half a cell: 1 degree, at 90 degrees of theta_h 2 degrees.
    np.testing.assert_allclose(data.bsdf_per_sr, true, atol=0.01 * true.max())


def test_the_example_of_the_manual_page_of_pabopto2bsdf(tmp_path):
    text = """#incident_angle 82.5 180
#format: theta phi DSF
84.968 125.790 0.009744
84.889 125.610 0.007737
84.805 125.427 0.008569
"""
    data = jaxink.read(written(tmp_path, text, "R.txt"), wavelength_nm=555)
    assert data.theta_i_deg.tolist() == [82.5] * 3
    # 54.21 degrees from the source: the light goes back, and to one side.
    np.testing.assert_allclose(data.phi_deg, [-54.21, -54.39, -54.573], atol=1e-9)
    cosine = np.cos(np.deg2rad([84.968, 84.889, 84.805]))
    np.testing.assert_allclose(data.bsdf_per_sr * cosine, [0.009744, 0.007737, 0.008569], rtol=1e-12)
    assert not data.is_transmission.any()


def test_wavelengths_of_rgl_are_interpolated(tmp_path):
    path = written(tmp_path, files.tensor_file(files.rgl()))
    at_500, at_600 = (jaxink.read(path, wavelength_nm=nm).bsdf_per_sr for nm in (500, 600))
    np.testing.assert_allclose(at_500, at_600 * 5 / 6, rtol=1e-5)
    assert len(jaxink.read(path, wavelength_nm=500, every=2)) < len(at_500) / 3


def test_channels_of_rgl(tmp_path):
    fields = files.rgl(wavelengths=(300.0, 450.0, 600.0))
    fields["rgb"] = fields.pop("spectra")
    del fields["wavelengths"]
    path = written(tmp_path, files.tensor_file(fields))
    red, blue = (jaxink.read(path, channel=c, wavelength_nm=600).bsdf_per_sr for c in "RB")
    np.testing.assert_allclose(red, blue / 2, rtol=1e-5)


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
    one = jaxink.read(written(tmp_path, text), wavelength_nm=450)
    np.testing.assert_array_equal(one.bsdf_per_sr, data.select(wavelength_nm=450).bsdf_per_sr)


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


@pytest.mark.parametrize(
    ("text", "stated", "named"),
    [
        (files.speos_anisotropic(), {"cosine_weighted": False}, "row 9"),
        (files.speos_anisotropic(is_intensity=False), {"cosine_weighted": True}, "row 9"),
        (files.speos_brdf(), {"cosine_weighted": True}, "row 7"),
        (files.mountain(), {"cosine_weighted": False, "wavelength_nm": 550}, "row 2"),
        (files.mountain(kind="BSDF"), {"cosine_weighted": True, "wavelength_nm": 550}, "row 2"),
    ],
    ids=["intensities", "bsdfs", "brdf", "DSF", "BSDF"],
)
def test_of_the_cosine_the_file_is_not_contradicted(text, stated, named, tmp_path, told):
    with pytest.raises(InputRefusedError) as problem:
        jaxink.read(written(tmp_path, text), **stated)
    told(str(problem.value), named, "cosine_weighted")


@pytest.mark.parametrize("make", [files.zemax, files.lighttools])
def test_the_stated_total_is_compared_with_the_same_power(make, tmp_path):
    """With the cosine or without, the values scatter the same power."""
    stated = {"wavelength_nm": 550} if make is files.zemax else {}
    plain = jaxink.read(written(tmp_path, make()), **stated)
    weighted = jaxink.read(written(tmp_path, make(weighted=True)), **stated, cosine_weighted=True)

    def totals(data):
        return [note.partition("(")[2] for note in data.notes if "stated TIS" in note]

    assert totals(plain)
    # Linear interpolation between the entries is another one of values times the cosine.
    for mine, theirs in zip(totals(plain), totals(weighted), strict=True):
        numbers = [float(note.split(": ")[1].split(" ")[0]) for note in (mine, theirs)]
        assert numbers[0] == pytest.approx(numbers[1], rel=0.1)


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


def test_each_of_several_files_has_its_incidence(tmp_path):
    names = [written(tmp_path, files.reflet(theta_i), f"{theta_i}.txt") for theta_i in (20.0, 40.0)]
    data = jaxink.read(names, **REFLET | {"theta_i_deg": [20, 40]})
    true = bsdf(data.theta_i_deg, data.theta_o_deg, data.phi_deg)
    np.testing.assert_allclose(data.bsdf_per_sr, true, rtol=1e-9)
    with pytest.raises(InputRefusedError, match="theta_i_deg has 3 entries for 2 files"):
        jaxink.read(names, **REFLET | {"theta_i_deg": [20, 40, 60]})


def test_several_files_are_joined(tmp_path):
    first = written(tmp_path, files.astm(["550nm"], is_radian=False), "R.astm")
    second = written(tmp_path, files.astm(["550nm"], is_radian=False), "T.astm")
    data = jaxink.read([first, second], side=["R", "T"])
    assert set(data.side.tolist()) == {"R", "T"}
