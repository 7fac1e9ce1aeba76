"""Headers as people write them are read as what they mean, or refused with what would be read."""

import numpy as np
import pytest

import jaxink
from jaxink.measurement.columns import KNOWN
from jaxink.measurement.names import NAMES, meaning
from tests.measurement.bad_inputs import GOOD

ROWS = [row.split(",") for row in GOOD[1:]]


@pytest.fixture
def read(tmp_path):
    def read(header, rows=ROWS, **overrides):
        path = tmp_path / "gonio.csv"
        lines = [";".join(header), *(";".join(row) for row in rows)]
        path.write_text("\n".join(lines), encoding="utf-8")
        return jaxink.read(path, **overrides)

    return read


HEADERS = {
    "units in brackets": "theta_i [°];theta_o [°];phi [°];wavelength [nm];side;BSDF [1/sr];sigma [1/sr]",
    "units behind": "Theta_in (deg);Theta_out (deg);Phi, deg;lambda_nm;Side;BSDF 1/sr;u(BSDF) / sr^-1",
    "Greek": "θi;θr / °;Δφ (°);λ (nm);side;f_r [sr⁻¹];σ (sr-1)",
    "camel case": "thetaIn;thetaOut;relativeAzimuth;wavelength;side;bsdf;bsdfStd [1/sr]",
    "English": "Angle of incidence;Viewing angle;Relative azimuth;Wavelength;Side;BSDF;"
    "Standard uncertainty [1/sr]",
    "German": "Einfallswinkel [Grad];Ausfallswinkel in °;Azimut;Wellenlänge [nm];Seite;BSDF [1/sr];"
    "Standardabweichung [1/sr]",
    "French": "angle d’incidence (degrés);angle d'observation (degrés);azimut relatif;"
    "longueur d’onde (nm);côté;BSDF (sr-1);incertitude (sr-1)",
    "words with degrees": "Incidence [°];Viewing (deg);phi [°];Wavelength;Side;BSDF [1/sr];sigma [1/sr]",
    "Japanese": "入射角（度）;受光角[度];相対方位角;波長（nm）;side;BSDF値;標準偏差 [1/sr]",
}


@pytest.mark.parametrize("name", HEADERS)
def test_a_header_is_read_as_it_is_meant(name, read):
    plain, data = read(GOOD[0].split(",")), read(HEADERS[name].split(";"))
    for column in (
        "theta_i_deg",
        "theta_o_deg",
        "phi_deg",
        "wavelength_nm",
        "side",
        "bsdf_per_sr",
        "sigma_per_sr",
    ):
        np.testing.assert_array_equal(getattr(data, column), getattr(plain, column))
    assert not data.extra
    assert all(
        any(f"'{given}'" in note for note in data.notes)
        for given in HEADERS[name].split(";")
        if given != "side" and given.lower() != "side"
    )


def test_every_name_has_one_meaning():
    assert set(NAMES) == set(KNOWN)
    listed = [(target, name.strip()) for target, text in NAMES.items() for name in text.split(",")]
    assert {(target, meaning(name)[0]) for target, name in listed} == {(target, target) for target in NAMES}


@pytest.mark.parametrize(("name", "side"), [("BRDF [1/sr]", "R"), ("BTDF", "T")])
def test_the_name_of_the_values_says_the_side(name, side, read, told):
    header = ["theta_i", "theta_o", "phi", "wavelength", name]
    rows = [[*row[:4], row[5]] for row in ROWS]
    data = read(header, rows)
    assert set(data.side) == {side}
    told(data.notes[-1], name)
    with pytest.raises(jaxink.InputRefusedError, match=side):
        read(header, rows, side="TR"[side == "T"])


@pytest.mark.parametrize(
    ("position", "name", "remedy"),
    [
        (0, "theta_i [rad]", "180/pi"),
        (0, "Einfallswinkel (mrad)", "0.18/pi"),
        (2, "Azimut / gon", "0.9"),
        (3, "Wellenlänge [µm]", "1000"),
        (3, "lambda_um", "1000"),
        (5, "BRDF [%]", "0.01"),
        (5, "BSDF [a.u.]", "1/sr"),
    ],
)
def test_other_units_are_refused_with_their_factor(position, name, remedy, read, refused):
    header = GOOD[0].split(",")
    header[position] = name
    with refused("gonio.csv", name, remedy):
        read(header)


def test_columns_of_equal_meaning_are_not_guessed(read, refused):
    with refused("theta_s", "theta_v", "theta_o_deg=theta_s"):
        read(["theta_i", "theta_s", "theta_v", "wavelength", "side", "bsdf", "x"])


def test_a_refusal_shows_the_header_and_the_command(read, refused):
    with refused("arm", "theta_o_deg", "--columns"):
        read(["theta_i_deg", "arm", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr", "sigma_per_sr"])


def test_many_columns_get_one_sentence(read, refused):
    header = ["theta_i_deg", *(f"channel_{n}" for n in range(37))]
    with refused("gonio.csv", "37 columns", "channel_0 to channel_36") as caught:
        read(header, [["0"] * 38])
    assert len(str(caught.value)) < 450
    with refused("gonio.csv", "15 more") as caught:
        read(["theta_i_deg", *(2 * chr(97 + n) for n in range(26))], [["0"] * 27])
    assert len(str(caught.value)) < 450
    with refused("gonio.csv", "400", "760"):
        read(
            ["theta_i_deg", "theta_o_deg", "phi_deg", *(f"{nm}" for nm in range(400, 770, 10))], [["1"] * 40]
        )


@pytest.mark.parametrize(
    "names", [("beta_x", "beta_y"), ("|beta-beta0|", "x"), ("cos_alpha", "cos_beta"), ("ux", "uy")]
)
def test_direction_cosines_are_known_by_name(names, read, refused):
    with refused("gonio.csv", names[0], "asin", numbers=False):
        read(["theta_i_deg", *names, "wavelength_nm", "side", "bsdf_per_sr", "sigma_per_sr"])


# Azimuths of incidence and of view.
AZIMUTHS = {
    "plain": "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg",
    "short": "theta-in,phi-in,theta-out,phi-out",
    "goniometer": "EntranceAngle,AzimuthEntranceAngle,ExitAngle,AzimuthExitAngle",
    "ASTM": "theta_i [°],phi_i [°],theta_s [°],phi_s [°]",
    "German": "Einfallswinkel,Einfallsazimut,Ausfallswinkel,Ausfallsazimut",
    "Japanese": "入射角,入射方位角,出射角,出射方位角",
}


def four_angles(turned, relative=(180, 0, 90, -90, 150)):
    return [
        ["30", f"{turn}", f"{10 * n + 5}", f"{(phi + turn) % 360:g}", "550", "R", f"{0.1 + n / 100:g}"]
        for n, (turn, phi) in enumerate(zip(turned, relative, strict=True))
    ]


@pytest.mark.parametrize("name", AZIMUTHS)
@pytest.mark.parametrize("turned", [(180,) * 5, (0, 25, 50, 75, 100)], ids=["constant", "varying"])
def test_the_azimuth_is_measured_from_the_source(name, turned, read):
    header = [*AZIMUTHS[name].split(","), "wavelength_nm", "side", "bsdf_per_sr"]
    data = read(header, four_angles(turned))
    np.testing.assert_array_equal(data.phi_deg, [180, 0, 90, -90, 150])
    assert any("minus" in note for note in data.notes)
    assert not data.extra


def test_a_turned_sample_repeats_directions(read, told):
    rows = four_angles((0, 25, 50, 75, 100), (180,) * 5)
    for row in rows:
        row[2] = "20"
    data = read(
        ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", "wavelength_nm", "side", "bsdf_per_sr"], rows
    )
    assert len(data) == 5
    told(*[note for note in data.notes if "minus" in note])


@pytest.mark.parametrize("azimuth", ["phi_deg", "phi", "Azimut"])
def test_an_azimuth_beside_that_of_the_source_is_open(azimuth, read, refused):
    header = ["theta_i_deg", "phi_in", "theta_o_deg", azimuth, "wavelength_nm", "side", "bsdf_per_sr"]
    with refused("row 2", "phi_deg", "phi_o_deg - phi_i_deg", "'phi_in'"):
        read(header, four_angles((30,) * 5))
    # From the source at 0 both are equal.
    assert read(header, four_angles((0,) * 5)).phi_deg[0] == 180


def test_an_azimuth_of_view_needs_that_of_the_source(read, refused):
    rows = [row[:1] + row[2:] for row in four_angles((0,) * 5)]
    header = ["theta_i_deg", "theta_o_deg", "phi_out", "wavelength_nm", "side", "bsdf_per_sr"]
    with refused("phi_out", "phi_i_deg", "phi_deg=phi_out"):
        read(header, rows)
    assert read(header, rows, columns={"phi_deg": "phi_out"}).phi_deg[0] == 180


@pytest.mark.parametrize("header", ["face", "Mode", "Sens"])
def test_a_column_of_words_for_the_sides_is_proposed_as_the_side(header, read, refused):
    names = [header if name == "side" else name for name in GOOD[0].split(",")]
    place = GOOD[0].split(",").index("side")
    words = ("réflexion", "transmission")
    rows = [[*row[:place], words[k % 2], *row[place + 1 :]] for k, row in enumerate(ROWS)]
    with refused(f'--columns "side={header}"') as problem:
        read(names, rows)
    assert "--side" not in str(problem.value)
    assert read(names, rows, columns={"side": header}).side.tolist()[:2] == ["R", "T"]


def test_a_header_that_is_assigned_is_not_proposed_again(read, refused):
    names = GOOD[0].replace("theta_i_deg", "alpha").split(",")
    rows = [[*row[:1], *row[2:]] for row in ROWS]
    with refused("theta_o_deg") as problem:
        read([names[0], *names[2:]], rows, columns={"theta_i_deg": "alpha"})
    assert "=alpha" not in str(problem.value)
