"""DDR, DDT, SDR and SDT files of Integra, written from the description of their layout."""

import numpy as np
import pytest

import jaxink
from tests.formats import files
from tests.formats.files import bsdf, integra, integra_regular

NM = {"wavelength_nm": 550}
# Text, suffix, what is stated, side, factor of the values.
READ = {
    "reflection": (integra(), ".ddr", {}, "R"),
    "transmission": (integra("T"), ".ddt", {}, "T"),
    "another suffix": (integra(), ".txt", {"side": "R"}, "R"),
    "full circle": (integra(symmetry="ASymmetrical"), ".ddr", {}, "R"),
    "rotated": (
        integra(symmetry="ASymmetrical 4D", psi=(0, 90)),
        ".ddr",
        {"rotation_deg": 0},
        "R",
    ),
    "intensity": (integra("T", data="Intensity Absolute"), ".ddt", {}, "T"),
    "kbdf": (integra(kbdf=(0.5, 2.0, 4.0)), ".ddr", {}, "R"),
    "one channel": (integra(model="BW"), ".ddr", NM, "R"),
    "colour": (integra(model="RGB", factors=(3.0, 1.0, 2.0)), ".ddr", NM | {"channel": "green"}, "R"),
    "one wavelength of two": (
        integra(model="spectral 2", factors=(3.0, 1.0)),
        ".ddr",
        {"wavelength_nm": 650},
        "R",
    ),
}


def written(folder, text, suffix):
    path = folder / f"measured{suffix}"
    path.write_text(text)
    return path


@pytest.mark.parametrize("kind", READ)
def test_directions_and_values(kind, tmp_path):
    text, suffix, stated, side = READ[kind]
    data = jaxink.read(written(tmp_path, text, suffix), **stated)
    assert set(data.side.tolist()) == {side}
    true = bsdf(data.theta_i_deg, data.theta_o_deg, data.phi_deg, side)
    np.testing.assert_allclose(data.bsdf_per_sr, true, rtol=1e-9)
    assert {0.0, 30.0, 60.0} == set(data.theta_i_deg.tolist())
    assert len(np.unique(np.round(np.column_stack(data.directions[:3]), 6), axis=0)) == len(data)


def test_all_wavelengths_are_read(tmp_path):
    data = jaxink.read(written(tmp_path, integra(model="spectral 2", factors=(3.0, 1.0)), ".ddr"))
    at = [data.bsdf_per_sr[data.wavelength_nm == nm] for nm in (450, 650)]
    np.testing.assert_allclose(at[0], 3 * at[1])


def test_relative_values_have_the_total_of_kbdf(tmp_path):
    # The scale of the values is lost: of any, the same measurement is read, twice that of half the total.
    kbdf = (0.5, 0.2, 0.1)

    def read(factor, kbdf):
        text = integra(data="Luminance Relative", kbdf=kbdf, factors=(factor,))
        return jaxink.read(written(tmp_path, text, ".ddr"))

    once, other = read(1.0, kbdf), read(7.0, kbdf)
    np.testing.assert_allclose(once.bsdf_per_sr, other.bsdf_per_sr, rtol=1e-9)
    half = read(1.0, tuple(0.5 * value for value in kbdf))
    np.testing.assert_allclose(half.bsdf_per_sr, 0.5 * once.bsdf_per_sr, rtol=1e-9)
    # A Lambertian of reflectance kbdf is kbdf / pi, but for the steps of the axes.
    lines = text_of_lambertian(kbdf)
    flat = jaxink.read(written(tmp_path, lines, ".ddr"))
    for angle, total in zip((0, 30, 60), kbdf, strict=True):
        np.testing.assert_allclose(flat.bsdf_per_sr[flat.theta_i_deg == angle], total / np.pi, rtol=0.02)


def text_of_lambertian(kbdf):
    sigma, phi, theta = (0, 30, 60), np.arange(0, 181, 5), np.arange(0, 181, 5)
    parts = ["TypeSym PlaneSymmetrical", "TypeColorModel spectral 1", "TypeData Luminance Relative"]
    for name, axis in (("sigma", sigma), ("phi", phi), ("theta", theta)):
        parts += [f"{name} {len(axis)}", axis]
    return files.lines(*parts, "wl 550", "kbdf", kbdf, "def", np.ones(3 * phi.size * theta.size), "enddef")


@pytest.mark.parametrize(("suffix", "quantity"), [(".sdr", "R_specular"), (".sdt", "T_collimated")])
def test_regular_light_is_read_as_readings(suffix, quantity, tmp_path):
    readings = jaxink.read_readings(written(tmp_path, integra_regular(), suffix))
    assert set(readings.quantity.tolist()) == {quantity}
    np.testing.assert_array_equal(readings.wavelength_nm, [450, 450, 650, 650])
    np.testing.assert_array_equal(readings.theta_i_deg, [0, 60, 0, 60])
    np.testing.assert_allclose(readings.value, [0.05, 0.2, 0.1, 0.4])
    assert readings.row.tolist() == [8, 8, 12, 12]
    assert any("90 degrees" in note for note in readings.notes)


WHOLE = integra(model="spectral 2", factors=(3.0, 1.0), kbdf=(1.0, 1.0, 1.0))
BAD = {
    "another suffix": (WHOLE, ".bsdf", {}, "--side"),
    "the other side": (WHOLE, ".ddr", {"side": "T"}, "only R"),
    "a wavelength it lacks": (WHOLE, ".ddr", NM, "450, 650"),
    "no wavelength": (integra(model="BW"), ".ddr", {}, "--wavelength-nm"),
    "colours": (integra(model="RGB", factors=(1, 1, 1)), ".ddr", NM, "--channel"),
    "an unknown colour": (integra(model="RGB", factors=(1, 1, 1)), ".ddr", NM | {"channel": "X"}, "green"),
    "a channel of wavelengths": (WHOLE, ".ddr", {"channel": "red"}, "not colours"),
    "several rotations": (integra(symmetry="ASymmetrical 4D", psi=(0, 90)), ".ddr", {}, "--rotation-deg"),
    "a rotation it lacks": (integra(), ".ddr", {"rotation_deg": 45}, "the file has 0"),
    "an unknown keyword": (WHOLE.replace("Source", "Quelle"), ".ddr", {}, "row 2"),
    "a keyword twice": (WHOLE.replace("Source Measured", "phi 1\n0"), ".ddr", {}, "twice"),
    "an unknown symmetry": (WHOLE.replace("PlaneSymmetrical", "Round"), ".ddr", {}, "row 3"),
    "neither absolute nor relative": (WHOLE.replace("Absolute", ""), ".ddr", {}, "Relative"),
    "relative without a scale": (integra(data="Luminance Relative"), ".ddr", {}, "kbdf"),
    "relative beyond all power": (
        integra(data="Luminance Relative", kbdf=(0.5, 1.6, 0.5)),
        ".ddr",
        {},
        "1.6",
    ),
    "relative on a part of the circle": (
        integra(data="Luminance Relative", kbdf=(0.5, 0.5, 0.5)).replace("PlaneSymm", "DirSymm"),
        ".ddr",
        {},
        "spans 180",
    ),
    "no unit": (WHOLE.replace("TypeData Luminance Absolute\n", ""), ".ddr", {}, "TypeData"),
    "an axis out of order": (WHOLE.replace("0 30 60", "0 60 30"), ".ddr", {}, "row 6"),
    "sigmat above sigma": (WHOLE.replace("\nsigma 3", "\nsigmat\nsigma 3"), ".ddr", {}, "sigmat stands"),
    "a word among values": (WHOLE.replace("0 30 60", "0 dreissig 60"), ".ddr", {}, "row 7"),
    "a value too many": (WHOLE.replace(" enddef", "0.3\n enddef", 1), ".ddr", {}, "enddef"),
    "more than it states": (WHOLE + "0.3\n", ".ddr", {}, "0.3"),
    "a channel of another name": (WHOLE.replace("wl 650", "bw"), ".ddr", {}, "wl should"),
    "regular light as scattered": (integra_regular(), ".sdr", {}, "read_readings"),
}


@pytest.mark.parametrize("kind", BAD)
def test_sentence(kind, tmp_path, refused):
    text, suffix, stated, named = BAD[kind]
    with refused(f"measured{suffix}", named):
        jaxink.read(written(tmp_path, text, suffix), **stated)


REGULAR = integra_regular()
BAD_REGULAR = {
    "another suffix": (REGULAR, ".txt", {}, "T_collimated"),
    "the other quantity": (REGULAR, ".sdr", {"quantity": "T_collimated"}, "R_specular"),
    "a total": (REGULAR, ".sdr", {"quantity": "R_total"}, "R_total"),
    "its own wavelength": (REGULAR, ".sdr", NM, "wavelength_nm"),
    "no wavelength": (integra_regular("BW", ("bw",)), ".sdr", {}, "wavelength_nm"),
    "colours": (integra_regular("RGB", ("red", "gre", "blu")), ".sdr", {}, "TypeColorModel BW"),
    "a value too few": (REGULAR.replace("0.05 0.2", "0.2"), ".sdr", {}, "row 9"),
}


@pytest.mark.parametrize("kind", BAD_REGULAR)
def test_sentence_of_regular_light(kind, tmp_path, refused):
    text, suffix, stated, named = BAD_REGULAR[kind]
    with refused(f"measured{suffix}", named):
        jaxink.read_readings(written(tmp_path, text, suffix), **stated)


def test_a_truncated_file_is_refused(tmp_path, refused):
    end = WHOLE.rindex("enddef") + len("enddef")
    for cut in {*range(300, end, end // 40), *range(end - 20, end)}:
        with pytest.raises(jaxink.InputRefusedError, match="measured"):
            jaxink.read(written(tmp_path, WHOLE[:cut], ".ddr"))
