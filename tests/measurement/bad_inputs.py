"""Bad measurement files, each with the row or column that its user is told of."""

from dataclasses import dataclass

HEADER = "theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr,sigma_per_sr"
GOOD = (
    HEADER,
    "0,10,180,550,R,0.30,0.003",
    "0,20,180,550,R,0.29,0.003",
    "30,0,0,550,R,0.28,0.003",
    "30,45,-90,550,R,0.27,0.003",
    "30,80,0,550,R,0.21,0.003",
)


@dataclass(frozen=True)
class BadInput:
    name: str
    content: bytes
    named: str


def _bytes(lines) -> bytes:
    return ("\n".join(lines) + "\n").encode()


def edited(row: int, column: str, value: str) -> bytes:
    """The good file with one cell changed; row 1 is the header."""
    lines = list(GOOD)
    cells = lines[row - 1].split(",")
    cells[HEADER.split(",").index(column)] = value
    lines[row - 1] = ",".join(cells)
    return _bytes(lines)


def column(name: str, values, renamed: str | None = None) -> bytes:
    """The good file with one column replaced, and renamed."""
    index = HEADER.split(",").index(name)
    rows = [line.split(",") for line in GOOD]
    for row, value in zip(rows, [renamed or name, *values], strict=True):
        row[index] = str(value)
    return _bytes(",".join(row) for row in rows)


def without(name: str) -> bytes:
    index = HEADER.split(",").index(name)
    rows = [line.split(",") for line in GOOD]
    return _bytes(",".join(row[:index] + row[index + 1 :]) for row in rows)


def radians() -> bytes:
    rows = [line.split(",") for line in GOOD]
    for row in rows[1:]:
        row[:3] = [f"{float(cell) * 0.017453292519943295:.5f}" for cell in row[:3]]
    return _bytes(",".join(row) for row in rows)


BAD_INPUTS = (
    BadInput("empty", b"", ""),
    BadInput("blank", b"\n \n", ""),
    BadInput("only_comments", b"# nothing\n", ""),
    BadInput("only_separators", b",,\n,,\n", ""),
    BadInput("header_only", _bytes(GOOD[:1]), ""),
    BadInput(
        "no_header",
        _bytes(["0,10,180,550,0.30", "0,20,180,550,0.29"]),
        "row 1",
    ),
    BadInput(
        "comment_of_other_length",
        _bytes(["# " + HEADER.rpartition(",")[0], "0,10,180,550,0,0.30,0.003"]),
        "row 2",
    ),
    BadInput(
        "blanks_between_columns_of_other_number",
        _bytes(line.replace(",", " ") for line in [*GOOD[:2], GOOD[2].rpartition(",")[0], *GOOD[3:]]),
        "row 3",
    ),
    BadInput("excel", b"PK\x03\x04rest", ""),
    BadInput(
        "netcdf",
        b"\x89HDF\r\n\x1a\n",
        "5",
    ),
    BadInput("cut_utf16", "\ufefftheta".encode("utf-16-le")[:-1], "16"),
    BadInput("old_excel", b"\xd0\xcf\x11\xe0rest", "CSV"),
    BadInput("pdf", b"%PDF-1.7", "CSV"),
    BadInput(
        "binary",
        _bytes(GOOD[:2]) + b"\0\1\2",
        "row 3",
    ),
    BadInput(
        "no_encoding",
        _bytes(GOOD) + b"# \xb5m\n# \x81\n",
        "row 8",
    ),
    BadInput(
        "open_quote",
        _bytes(GOOD).replace(b"0.29", b'"0.29'),
        "row 7",
    ),
    BadInput(
        "long_row",
        _bytes([*GOOD, "30,85,0,550,R,0,2,0.003"]),
        "row 7",
    ),
    BadInput("short_row", _bytes([*GOOD, "30,85,0,550"]), "row 7"),
    BadInput(
        "decimal_comma",
        _bytes(line.replace(",", ";") for line in GOOD).replace(b"0.28", b"0,28"),
        "row 4",
    ),
    BadInput(
        "thousands",
        _bytes(line.replace(",", ";").replace(";550;", ";1,550;") for line in GOOD).replace(b"0.", b""),
        "row 2",
    ),
    BadInput(
        "both_signs",
        _bytes(line.replace(",", ";") for line in GOOD).replace(b"0.28", b"1.000,28"),
        "row 4",
    ),
    BadInput(
        "row_of_other_units",
        _bytes([GOOD[0], "deg,rad,deg,nm,,1/sr,1/sr", *GOOD[1:]]),
        "row 2, column theta_o_deg",
    ),
    BadInput(
        "row_of_percent",
        _bytes([GOOD[0], "[deg],[deg],[deg],[nm],-,[%],[%]", *GOOD[1:]]),
        "row 2, column bsdf_per_sr",
    ),
    BadInput(
        "row_of_unknown_units",
        _bytes([GOOD[0], "deg,deg,deg,nm,,W/sr,W/sr", *GOOD[1:]]),
        "row 2, column bsdf_per_sr",
    ),
    BadInput("only_units", _bytes([GOOD[0], "deg,deg,deg,nm,,1/sr,1/sr"]), ""),
    BadInput("second_row_of_units", _bytes([*GOOD[:3], "deg,deg,deg,nm,,1/sr,1/sr"]), "row 4"),
    BadInput("values_above_the_header", _bytes([GOOD[1], GOOD[0], *GOOD[2:]]), "row 1"),
    BadInput("title_and_no_header", _bytes(["Lab 7", "white ink", *GOOD[1:]]), "row 1"),
    BadInput("several_empty_cells", column("bsdf_per_sr", [0.3, "", 0.28, "", 0.21]), "row 3"),
    BadInput("no_azimuth", without("phi_deg"), "phi_deg"),
    BadInput(
        "misspelt_column",
        _bytes(GOOD).replace(b"theta_o_deg", b"tehta_o_deg"),
        "theta_o_deg=tehta_o_deg",
    ),
    BadInput(
        "brdf_and_btdf",
        _bytes(GOOD).replace(b"bsdf_per_sr,sigma_per_sr", b"BRDF,BTDF"),
        "bsdf_per_sr=BRDF",
    ),
    BadInput(
        "column_twice",
        _bytes(GOOD).replace(b"sigma_per_sr", b"BSDF_per_sr"),
        "bsdf_per_sr",
    ),
    BadInput(
        "unnamed_column",
        _bytes([GOOD[0] + ",", *(line + ",7" for line in GOOD[1:])]),
        "row 2",
    ),
    BadInput(
        "missing_wavelength",
        without("wavelength_nm"),
        "wavelength_nm",
    ),
    BadInput(
        "empty_wavelength",
        column("wavelength_nm", [""] * 5),
        "wavelength_nm",
    ),
    BadInput(
        "radians_by_name",
        column("theta_i_deg", [0] * 5, "theta_i_rad"),
        "theta_i_rad",
    ),
    BadInput(
        "radians",
        radians(),
        "theta_i_deg",
    ),
    BadInput(
        "azimuth_in_radians",
        column("phi_deg", [3.14159, 3.14159, 0, -1.5708, 0]),
        "row 5",
    ),
    BadInput(
        "micrometres",
        column("wavelength_nm", [0.55] * 5),
        "row 2",
    ),
    BadInput(
        "metres",
        column("wavelength_nm", ["5.5e-7"] * 5),
        "row 2",
    ),
    BadInput(
        "long_wavelength",
        edited(5, "wavelength_nm", "550000"),
        "row 5",
    ),
    BadInput(
        "micrometres_by_name",
        column("wavelength_nm", [0.55] * 5, "wavelength_um"),
        "wavelength_um",
    ),
    BadInput(
        "percent_by_name",
        column("bsdf_per_sr", [30] * 5, "bsdf_percent"),
        "bsdf_percent",
    ),
    BadInput(
        "percent_by_value",
        column("bsdf_per_sr", [30, 29, 28, 27, 21])
        .replace(b"\n0,10", b"\n30,10")
        .replace(b"\n0,20", b"\n30,20"),
        "row 6",
    ),
    BadInput(
        "reflectance_factor",
        column("bsdf_per_sr", [1, 0.99, 0.98, 0.97, 0.8], "BRF"),
        "bsdf_per_sr",
    ),
    BadInput(
        "sigma_percent",
        column("sigma_per_sr", [1] * 5, "sigma_percent"),
        "sigma_percent",
    ),
    BadInput(
        "sigma_without_unit",
        column("sigma_per_sr", [1] * 5, "sigma"),
        "sigma_per_sr",
    ),
    BadInput(
        "totals",
        b"theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,value,unit\n0,,,550,R,0.5,sphere_M_R\n",
        "bsdf_per_sr",
    ),
    BadInput(
        "signed_angle",
        edited(3, "theta_o_deg", "-20"),
        "row 3",
    ),
    BadInput(
        "angle_from_other_normal",
        edited(6, "theta_o_deg", "135"),
        "row 6",
    ),
    BadInput(
        "azimuth_range",
        edited(6, "phi_deg", "400"),
        "row 6",
    ),
    BadInput(
        "side",
        edited(4, "side", "B"),
        "row 4",
    ),
    BadInput(
        "nan",
        edited(4, "bsdf_per_sr", "NaN"),
        "row 4",
    ),
    BadInput(
        "infinite",
        edited(2, "phi_deg", "-inf"),
        "row 2",
    ),
    BadInput(
        "blank_cell",
        edited(3, "phi_deg", " "),
        "row 3",
    ),
    BadInput(
        "some_wavelengths_blank",
        edited(3, "wavelength_nm", ""),
        "row 3",
    ),
    BadInput(
        "text_cell",
        edited(6, "bsdf_per_sr", "n/a"),
        "row 6",
    ),
    BadInput(
        "underscore",
        edited(6, "theta_i_deg", "1_0"),
        "row 6",
    ),
    BadInput(
        "sigma_zero",
        edited(5, "sigma_per_sr", "0"),
        "row 5",
    ),
    BadInput(
        "sigma_negative",
        edited(5, "sigma_per_sr", "-0.01"),
        "row 5",
    ),
    BadInput(
        "beyond_any_measurement",
        edited(4, "bsdf_per_sr", "-1e308"),
        "row 4",
    ),
    BadInput("largest_integer", edited(4, "bsdf_per_sr", "2147483648"), "row 4"),
    BadInput("more_than_all_light", edited(2, "bsdf_per_sr", "5e9"), "row 2, column bsdf_per_sr"),
    BadInput("absurd_sigma", edited(3, "sigma_per_sr", "4294967295"), "row 3, column sigma_per_sr"),
    BadInput(
        "below_any_measurement",
        edited(4, "sigma_per_sr", "1e-310"),
        "row 4",
    ),
    BadInput(
        "all_zero",
        column("bsdf_per_sr", [0] * 5),
        "bsdf_per_sr",
    ),
    BadInput(
        "all_negative",
        column("bsdf_per_sr", [-1, 0, -1, -1, 0]),
        "bsdf_per_sr",
    ),
    BadInput(
        "too_many_columns",
        _bytes(line + "".join(f",c{k}" for k in range(994)) for line in GOOD),
        "row 1",
    ),
    BadInput(
        "two_samples",
        _bytes([GOOD[0] + ",sample", *(f"{line},{'ab'[i % 2]}" for i, line in enumerate(GOOD[1:]))]),
        "2",
    ),
)
