"""A damaged file, or one that does not say what it must, is one sentence that names the file and the row."""

import re
from random import Random

import numpy as np
import pytest

import jaxink
from tests.formats import files
from tests.fuzz import mutations
from tests.fuzz.test_fuzz import check_data, faults

ZEMAX, LIGHTTOOLS = files.zemax(), files.lighttools()
SPEOS, BRDF, ASTM = files.speos_anisotropic(), files.speos_brdf(), files.astm(["550nm"], is_radian=False)
PAB, REFLET, RGL = files.mountain(), files.reflet(), files.tensor_file(files.rgl(n=4))
MERL = files.merl(lambda *_: np.full((90, 90, 180), 0.1))[:5000]
STATED = {"zemax": {"wavelength_nm": 550}, "astm": {"side": "R"}, "pab": {"wavelength_nm": 550}}
STATED["reflet"] = {"side": "R", "wavelength_nm": 550, "specular_phi_deg": 0, "scale": 1, "theta_i_deg": 20}
STATED["reflet"]["cosine_weighted"] = True
STATED["integra"] = {"side": "R"}
STATED["rgl"] = {"wavelength_nm": 550}
WHOLE = {"zemax": ZEMAX, "lighttools": LIGHTTOOLS, "speos": SPEOS, "brdf": BRDF, "astm": ASTM}
WHOLE |= {"pab": PAB, "reflet": REFLET, "rgl": RGL, "integra": files.integra(kbdf=(1.0, 1.0, 1.0))}
# Nothing in these says how many rows follow.
COUNTED = ("zemax", "lighttools", "speos", "brdf", "astm", "rgl")


def line(text, start):
    """Number and words of the first row that starts so."""
    rows = text.split("\n")
    number = next(i for i, row in enumerate(rows) if row.startswith(start))
    return number, rows[number]


def with_line(text, start, new, below=0):
    """The text with another row in the place of one, or of one further below."""
    rows = text.split("\n")
    rows[line(text, start)[0] + below] = new
    return "\n".join(rows)


# Text, what is stated, what the sentence names.
BAD = {
    "zemax without a wavelength": (ZEMAX, {}, "--wavelength-nm"),
    "zemax with a huge count": (
        with_line(ZEMAX, "ScatterRadial", "ScatterRadial 999999999999999"),
        {"wavelength_nm": 550},
        "row 12",
    ),
    "zemax with too few angles": (
        with_line(ZEMAX, "ScatterRadial", "ScatterRadial 5"),
        {"wavelength_nm": 550},
        "row 13",
    ),
    "zemax with an axis too many": (
        with_line(ZEMAX, "AngleOfIncidence", "AngleOfIncidence 2"),
        {"wavelength_nm": 550},
        "row 9",
    ),
    "zemax with a word among values": (
        with_line(ZEMAX, "TIS", "0.1 0.2 nan 0.1 0.1 0.1", 1),
        {"wavelength_nm": 550},
        "row 18",
    ),
    "zemax without a scatter type": (
        with_line(ZEMAX, "ScatterType", ""),
        {"wavelength_nm": 550},
        "scattertype",
    ),
    "zemax with an unknown symmetry": (
        with_line(ZEMAX, "Symmetry", "Symmetry Round"),
        {"wavelength_nm": 550},
        "symmetry",
    ),
    "zemax of several rotations": (
        files.zemax(rotations=(0, 90), symmetry="Asymmetrical4D"),
        {"wavelength_nm": 550},
        "--rotation-deg",
    ),
    "zemax of tristimuli": (
        files.zemax(channels={"TristimulusX": 1.0, "TristimulusY": 1.0, "TristimulusZ": 1.0}),
        {"wavelength_nm": 550},
        "--channel",
    ),
    "zemax of the other side": (ZEMAX, {"wavelength_nm": 550, "side": "T"}, "R"),
    "zemax with a face": (ZEMAX, {"wavelength_nm": 550, "face": "front"}, "--face"),
    "zemax with a table's keyword": (ZEMAX, {"wavelength_nm": 550, "sheet": "a"}, "sheet"),
    "lighttools of two faces": (files.lighttools(faces=("Back", "Front")), {}, "--face"),
    "lighttools without that face": (LIGHTTOOLS, {"face": "back"}, "back"),
    "lighttools of an unknown face": (LIGHTTOOLS, {"face": "top"}, "top"),
    "lighttools of several planes": (files.lighttools(pois=(0, 30)), {}, "--rotation-deg"),
    "lighttools with another half": (files.lighttools(half=(0, 180)), {}, "--specular-phi-deg"),
    "lighttools without a side": (with_line(LIGHTTOOLS, "Side", ""), {}, "side"),
    "lighttools in micrometres": (
        with_line(LIGHTTOOLS, "Wavelength", "Wavelength 0.633"),
        {},
        "wavelength_nm",
    ),
    "lighttools beyond the horizon": (with_line(LIGHTTOOLS, "AOI", "AOI 120"), {}, "theta_i_deg"),
    "speos of a spectrum": (files.speos_anisotropic(spectrum=(400, 700)), {}, "--wavelength-nm"),
    "speos beyond its spectrum": (
        files.speos_anisotropic(spectrum=(400, 700)),
        {"wavelength_nm": 800},
        "wavelength_nm",
    ),
    "brdf without that wavelength": (BRDF, {"wavelength_nm": 500}, "450, 650"),
    "speos in binary mode": (with_line(SPEOS, "0", "1"), {}, "row 2"),
    "speos of another version": (SPEOS.replace("v8.0", "v3.0"), {}, "row 1"),
    "speos with a wrong description": (with_line(SPEOS, "11", "14"), {}, "row 5"),
    "speos of several rotations": (files.speos_anisotropic(rotations=(0, 90)), {}, "--rotation-deg"),
    "speos with a table too many": (SPEOS.replace("End of file", "19 13"), {}, "row 112"),
    "astm with neither side": (ASTM, {}, "--side"),
    "astm in radians or not": (files.astm(["550nm"]), {"side": "R"}, "--angle-unit"),
    "astm with colours": (files.astm(["R", "G"], is_radian=False), {"side": "R"}, "--channel"),
    "astm without a wavelength": (files.astm(["G"], is_radian=False), {"side": "R"}, "--wavelength-nm"),
    "astm with a row too few": ("\n".join(ASTM.split("\r\n")[:-2]), {"side": "R"}, "NUM_POINTS"),
    "astm with a cell too few": (with_line(ASTM, "VARS", "1,2,3", 2), {"side": "R"}, "row 5"),
    "astm with no number": (with_line(ASTM, "VARS", "1,180,3,inf,0.1", 2), {"side": "R"}, "row 5"),
    "pab-opto without a wavelength": (PAB, {}, "--wavelength-nm"),
    "pab-opto without an incidence": (
        with_line(PAB, "#inphi", "#"),
        {"wavelength_nm": 550},
        "#incident_angle",
    ),
    "pab-opto of the other face": (PAB, {"wavelength_nm": 550, "face": "back"}, "front"),
    "pab-opto with tristimuli": (files.mountain(channels=3), {"wavelength_nm": 550}, "--channel"),
    "pab-opto with a value too few": (with_line(PAB, "5\t0", "5 0"), {"wavelength_nm": 550}, "row 7"),
    "reflet without a side": (REFLET, {}, "--theta-i-deg"),
    "reflet without a scale": (
        REFLET,
        {"theta_i_deg": 20, "side": "R", "wavelength_nm": 550, "specular_phi_deg": -90},
        "--scale",
    ),
    "reflet without a specular azimuth": (
        REFLET,
        {"theta_i_deg": 20, "side": "R", "wavelength_nm": 550},
        "--specular-phi-deg",
    ),
    "reflet with a value too few": (with_line(REFLET, "20", "20 1"), {**STATED["reflet"]}, "row 6"),
    "merl that is too short": (MERL, {"wavelength_nm": 550, "channel": "R"}, "bytes"),
    "rgl without a wavelength": (RGL, {}, "--wavelength-nm"),
    "rgl beyond its wavelengths": (RGL, {"wavelength_nm": 800}, "400 to 600"),
    "rgl without a field": (
        files.tensor_file({k: v for k, v in files.rgl().items() if k != "vndf"}),
        {"wavelength_nm": 550},
        "vndf",
    ),
    "rgl that is too short": (RGL[:2000], {"wavelength_nm": 550}, "incomplete"),
    "rgl of another version": (RGL[:12] + b"\2\0" + RGL[14:], {"wavelength_nm": 550}, "version"),
    "nothing that is known": ("a b c", {}, "bsdf"),
    "binary garbage": (bytes(Random(1).randbytes(3000)), {}, "bsdf"),
}


@pytest.mark.parametrize("kind", BAD)
def test_sentence(kind, tmp_path, refused):
    text, stated, named = BAD[kind]
    path = tmp_path / "measured.bsdf"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with refused("measured.bsdf", named):
        jaxink.read(path, **stated)


@pytest.mark.parametrize("kind", COUNTED)
def test_a_truncated_file_is_refused(kind, tmp_path):
    path = tmp_path / "measured.bsdf"
    whole = WHOLE[kind]
    content = whole if isinstance(whole, bytes) else whole.encode()
    # Of the last number of a table without an end, a part is a number, too.
    last = (
        len(content) - 15 if kind == "astm" else content.rfind(b"End") + 3 if kind != "rgl" else len(content)
    )
    for cut in {*range(1, last, last // 60), *range(last - 40, last)}:
        path.write_bytes(content[:cut])
        with pytest.raises(jaxink.InputRefusedError, match=re.escape(str(path))):
            jaxink.read(path, **STATED.get(kind, {}))


@pytest.mark.parametrize("kind", ["astm", "pab", "reflet"])
def test_a_last_line_without_an_end_is_a_note(kind, tmp_path):
    path = tmp_path / "measured.bsdf"
    path.write_text(WHOLE[kind], newline="")
    whole = jaxink.read(path, **STATED[kind])
    path.write_text(WHOLE[kind].rstrip()[:-3], newline="")
    cut = jaxink.read(path, **STATED[kind])
    assert cut.bsdf_per_sr[-1] != whole.bsdf_per_sr[-1]
    assert any("may lack digits" in note for note in cut.notes)
    assert not any("may lack digits" in note for note in whole.notes)


@pytest.mark.parametrize("kind", COUNTED)
def test_a_file_with_more_than_it_states_is_refused(kind, tmp_path, told):
    path = tmp_path / "measured.bsdf"
    whole = WHOLE[kind]
    more = {"astm": "0,0,0,0,0.3\r\n"}.get(kind, "0.3\n")
    path.write_bytes(whole + bytes(400) if isinstance(whole, bytes) else (whole + more).encode())
    with pytest.raises(jaxink.InputRefusedError) as problem:
        jaxink.read(path, **STATED.get(kind, {}))
    told(str(problem.value), "measured.bsdf")


@pytest.mark.parametrize(
    ("kind", "start", "below"),
    [("zemax", "TIS", 1), ("lighttools", "TIS", 1), ("speos", "19\t13", 2), ("brdf", "19\t13", 2)],
)
@pytest.mark.parametrize("change", ["fewer", "more"])
def test_a_table_with_other_numbers_of_values_is_refused(kind, start, below, change, tmp_path, told):
    number, _ = line(WHOLE[kind], start)
    row = WHOLE[kind].split("\n")[number + below]
    changed = row.rpartition(" ")[0] if change == "fewer" else f"{row} 0.25"
    path = tmp_path / "measured.bsdf"
    path.write_text(with_line(WHOLE[kind], start, changed, below))
    with pytest.raises(jaxink.InputRefusedError) as problem:
        jaxink.read(path, **STATED.get(kind, {}))
    told(str(problem.value), "row")


@pytest.mark.parametrize("by", [-100, -1, 1, 100])
def test_sizes_of_merl(by, tmp_path, refused):
    # The sentence names both sizes before the content is looked at.
    size = 12 + 3 * 8 * 90 * 90 * 180 + by
    path = tmp_path / "a.binary"
    with path.open("wb") as file:
        file.write(MERL[:12])
        file.truncate(size)
    with refused(str(size)):
        jaxink.read(path, wavelength_nm=550, channel="R")


@pytest.mark.parametrize("kind", WHOLE)
def test_any_fault_is_one_sentence(kind, tmp_path):
    def write(path, random):
        content = WHOLE[kind]
        if isinstance(content, str):
            content = (mutations.lines_of(content, random) if random.random() < 0.5 else content).encode()
        path.write_bytes(mutations.bytes_of(content, random) if random.random() < 0.7 else content)

    def read(path):
        return jaxink.read(path, **STATED.get(kind, {}))

    assert faults(write, read, check_data, tmp_path / "measured.bsdf", 7, 60) == {}
