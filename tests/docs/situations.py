"""Measurements as people have them: one row for each layout, with what has to become of it.

as_people_have_it.py writes the page of these rows, and test_situations.py holds each of them to it.
"""

from tests.docs.situation_files import BOTH, HEADER, TIDY, Situation, binary, csv, rows, text, with_column
from tests.docs.situations_of_tables import MATRICES, TABLES, WORKBOOKS
from tests.formats import files

OTHERS = (
    Situation("JSON", {"ink.json": text('{"theta_i_deg": [0]}')}, named=("JSON", "DataFrame")),
    Situation(
        "JSON with the suffix .txt", {"ink.txt": text('[{"theta_i_deg": 0}]')}, named=("JSON", "DataFrame")
    ),
    Situation(
        "Matlab", {"ink.mat": binary(b"MATLAB 5.0 MAT-file" + bytes(200))}, named=("Matlab", "writetable")
    ),
    Situation(
        "an array of numpy", {"ink.npy": binary(b"\x93NUMPY" + bytes(200))}, named=("numpy", "DataFrame")
    ),
    Situation(
        "an unknown binary file", {"ink.bsdf": binary(bytes(range(256)) * 4)}, named=("formats", "CSV text")
    ),
)
_SPEOS, _ZEMAX = files.speos_anisotropic(), files.zemax()
EXCHANGE = (
    Situation(
        "Zemax, which states no wavelength",
        {"ink.bsdf": text(_ZEMAX)},
        named=("--wavelength-nm",),
        then="--wavelength-nm 550",
        then_values=47,
    ),
    Situation(
        "Zemax, cut off during the transfer",
        {"ink.bsdf": text(_ZEMAX[:900])},
        "--wavelength-nm 550",
        named=("ink.bsdf, row", "incomplete"),
    ),
    Situation(
        "Zemax with a value too many",
        {"ink.bsdf": text(_ZEMAX + "0.3\n")},
        "--wavelength-nm 550",
        named=("row 36", "0.3"),
    ),
    Situation(
        "Zemax with values times the cosine",
        {"ink.bsdf": text(files.zemax(weighted=True))},
        "--wavelength-nm 550 --cosine-weighted",
        46,
    ),
    Situation("LightTools with both sides", {"ink.bsdf": text(files.lighttools())}, values=148),
    Situation("Speos with intensities, which says so", {"ink.anisotropicbsdf": text(_SPEOS)}, values=820),
    Situation(
        "Speos with intensities, and a user who says BSDF",
        {"ink.anisotropicbsdf": text(_SPEOS)},
        "--no-cosine-weighted",
        named=("row 9", "cosine"),
        then="",
        then_values=820,
    ),
    Situation(
        "Speos, cut off during the transfer",
        {"ink.anisotropicbsdf": text(_SPEOS[:9000])},
        named=("incomplete",),
    ),
    Situation(
        "ASTM E1392, one side, which it does not state",
        {"ink.astm": text(files.astm(["550nm"], is_radian=False))},
        named=("--side",),
        then="--side R",
        then_values=24,
        is_truth=False,
    ),
    Situation(
        "pab-opto with values times the cosine (DSF), which says so",
        {"ink.dat": text(files.mountain())},
        "--wavelength-nm 555",
        30,
    ),
)
TOGETHER = (
    Situation(
        "reflection and transmission in one file each, with the side",
        {f"{s}.csv": csv([HEADER, *rows(s)]) for s in "RT"},
        values=20,
    ),
    Situation(
        "the same sample on two days",
        {"monday.csv": csv(BOTH), "tuesday.csv": csv([HEADER, *rows("RT", factor=1.01)])},
        values=40,
        is_truth=False,
    ),
    Situation(
        "two thicknesses of one ink",
        {"thin.csv": csv(BOTH), "thick.csv": csv([HEADER, *rows("RT", factor=1.15)])},
        named=("same sample",),
    ),
    Situation(
        "standard deviations in one of the files only",
        {"R.csv": csv(with_column(TIDY, "sigma_per_sr", [0.002] * 10)), "T.csv": csv([HEADER, *rows("T")])},
        named=("T.csv", "sigma_per_sr"),
    ),
    Situation("one file twice, by mistake", {"ink.csv": csv(TIDY), "./ink.csv": csv(TIDY)}, named=("twice",)),
)
GROUPS = {
    "Tables": TABLES,
    "Matrices": MATRICES,
    "Workbooks": WORKBOOKS,
    "Files of ray tracers and instruments": EXCHANGE,
    "Several files": TOGETHER,
    "What is no table": OTHERS,
}
EXCHANGED = frozenset(each.what for each in EXCHANGE)
