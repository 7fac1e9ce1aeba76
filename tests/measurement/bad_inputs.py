"""Bad measurement files, each with the exact sentence that its user gets after the file name."""

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
    sentence: str


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


_OTHERS = HEADER.replace("wavelength_nm,", "").replace(",", ", ")
BAD_INPUTS = (
    BadInput("empty", b"", ": is empty; a header row and data rows are needed."),
    BadInput("blank", b"\n \n", ": is empty; a header row and data rows are needed."),
    BadInput(
        "only_comments", b"# nothing\n", ": holds only comments; a header row and data rows are needed."
    ),
    BadInput(
        "only_separators", b",,\n,,\n", ": holds separators only; a header row and data rows are needed."
    ),
    BadInput("header_only", _bytes(GOOD[:1]), ": has a header but no data rows."),
    BadInput(
        "no_header",
        _bytes(["0,10,180,550,0.30", "0,20,180,550,0.29"]),
        ", row 1: holds numbers where the column names should stand; add a header row.",
    ),
    BadInput(
        "commented_header",
        _bytes(["# " + HEADER, "0,10,180,550,0,0.30,0.003"]),
        ", row 2: holds numbers where the column names should stand; add a header row, or remove the "
        "'#' before the one that is there.",
    ),
    BadInput(
        "blanks_between_columns",
        _bytes(line.replace(",", " ") for line in GOOD),
        ", row 1: the header holds no comma; separate the columns by commas.",
    ),
    BadInput("excel", b"PK\x03\x04rest", ": is a spreadsheet or zip archive; export it as CSV."),
    BadInput(
        "netcdf",
        b"\x89HDF\r\n\x1a\n",
        ": is a netCDF or HDF5 file; give it the suffix .nc.",
    ),
    BadInput("utf16", "\ufefftheta".encode("utf-16-le"), ": is UTF-16 text; save it as UTF-8."),
    BadInput(
        "binary",
        _bytes(GOOD[:2]) + b"\0\1\2",
        ", row 3: holds a zero byte, so it is a binary file and not CSV text.",
    ),
    BadInput(
        "latin1",
        _bytes(GOOD) + b"# \xb5m\n",
        ", row 7: byte 0xb5 is not UTF-8 text; save as UTF-8.",
    ),
    BadInput(
        "open_quote",
        _bytes(GOOD).replace(b"0.29", b'"0.29'),
        ", row 7: is not CSV text (unexpected end of data).",
    ),
    BadInput(
        "long_row",
        _bytes([*GOOD, "30,85,0,550,R,0,2,0.003"]),
        ", row 7: has 8 cells where the header has 7 (a decimal comma? write 0.5 and not 0,5).",
    ),
    BadInput("short_row", _bytes([*GOOD, "30,85,0,550"]), ", row 7: has 4 cells where the header has 7."),
    BadInput(
        "decimal_comma",
        _bytes(line.replace(",", ";") for line in GOOD).replace(b"0.28", b"0,28"),
        ", row 4, column bsdf_per_sr: '0,28' is not a number; write 0.28 with a decimal point.",
    ),
    BadInput(
        "misspelt_column",
        _bytes(GOOD).replace(b"theta_o_deg", b"theta_out_deg"),
        ", column theta_out_deg: the name is not known; did you mean theta_o_deg.",
    ),
    BadInput(
        "brdf_for_bsdf",
        _bytes(GOOD).replace(b"bsdf_per_sr", b"brdf_per_sr"),
        ", column brdf_per_sr: the name is not known; did you mean bsdf_per_sr.",
    ),
    BadInput(
        "column_twice",
        _bytes(GOOD).replace(b"sigma_per_sr", b"BSDF_per_sr"),
        ", column bsdf_per_sr: the column stands twice in the header.",
    ),
    BadInput(
        "unnamed_column",
        _bytes([GOOD[0] + ",", *(line + ",7" for line in GOOD[1:])]),
        ", row 2, column 8: the cell '7' stands under an empty column name; name the column.",
    ),
    BadInput(
        "missing_wavelength",
        without("wavelength_nm"),
        f": column wavelength_nm is missing; the header holds {_OTHERS}; if all rows share one, pass "
        "wavelength_nm to read_csv.",
    ),
    BadInput(
        "empty_wavelength",
        column("wavelength_nm", [""] * 5),
        ", column wavelength_nm: the column is empty; give wavelength_nm=... to state the wavelength of "
        "all rows.",
    ),
    BadInput(
        "radians_by_name",
        column("theta_i_deg", [0] * 5, "theta_i_rad"),
        ", column theta_i_rad: holds radians; multiply by 180/pi and name the column theta_i_deg.",
    ),
    BadInput(
        "radians",
        radians(),
        ", column theta_i_deg and theta_o_deg and phi_deg: no angle exceeds 3.142, so the angles are "
        "radians; multiply them by 180/pi.",
    ),
    BadInput(
        "azimuth_in_radians",
        column("phi_deg", [3.14159, 3.14159, 0, -1.5708, 0]),
        ", row 5, column phi_deg: 1.5708 looks like radians; multiply the column by 180/pi.",
    ),
    BadInput(
        "micrometres",
        column("wavelength_nm", [0.55] * 5),
        ", row 2, column wavelength_nm: 0.55 is not a wavelength in nm; micrometres must be multiplied "
        "by 1000.",
    ),
    BadInput(
        "metres",
        column("wavelength_nm", ["5.5e-7"] * 5),
        ", row 2, column wavelength_nm: 5.5e-07 is not a wavelength in nm; metres must be multiplied by 1e9.",
    ),
    BadInput(
        "long_wavelength",
        edited(5, "wavelength_nm", "550000"),
        ", row 5, column wavelength_nm: 550000 is not a wavelength in nm; it must lie in 100 ... 20000.",
    ),
    BadInput(
        "micrometres_by_name",
        column("wavelength_nm", [0.55] * 5, "wavelength_um"),
        ", column wavelength_um: holds micrometres; multiply by 1000 and name the column wavelength_nm.",
    ),
    BadInput(
        "percent_by_name",
        column("bsdf_per_sr", [30] * 5, "bsdf_percent"),
        ", column bsdf_percent: holds per cent; convert it to 1/sr and name the column bsdf_per_sr.",
    ),
    BadInput(
        "percent_by_value",
        column("bsdf_per_sr", [30, 29, 28, 27, 21])
        .replace(b"\n0,10", b"\n30,10")
        .replace(b"\n0,20", b"\n30,20"),
        ", row 6, column bsdf_per_sr: no value of this scan is below 21, so it sends out 64 times the "
        "incident light; divide per cent by 100, or a reflectance factor by pi.",
    ),
    BadInput(
        "reflectance_factor",
        column("bsdf_per_sr", [1, 0.99, 0.98, 0.97, 0.8], "BRF"),
        ", column BRF: holds reflectance factors; divide by pi and name the column bsdf_per_sr.",
    ),
    BadInput(
        "sigma_percent",
        column("sigma_per_sr", [1] * 5, "sigma_percent"),
        ", column sigma_percent: holds per cent; convert it to 1/sr and name the column sigma_per_sr.",
    ),
    BadInput(
        "sigma_without_unit",
        column("sigma_per_sr", [1] * 5, "sigma"),
        ", column sigma: an uncertainty without a unit; convert it to 1/sr and name the column "
        "sigma_per_sr, or rename it if it is something else.",
    ),
    BadInput(
        "totals",
        b"theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,value,unit\n0,,,550,R,0.5,sphere_M_R\n",
        ": column bsdf_per_sr is missing: column value is in 'sphere_M_R', a total or ratio from which "
        "the BSDF in 1/sr of one direction does not follow.",
    ),
    BadInput(
        "signed_angle",
        edited(3, "theta_o_deg", "-20"),
        ", row 3, column theta_o_deg: -20 is outside 0 ... 90 degrees; write 20 and turn phi_deg by 180.",
    ),
    BadInput(
        "angle_from_other_normal",
        edited(6, "theta_o_deg", "135"),
        ", row 6, column theta_o_deg: 135 is outside 0 ... 90 degrees; from the normal of the side that "
        "the light leaves it is 45.",
    ),
    BadInput(
        "azimuth_range",
        edited(6, "phi_deg", "400"),
        ", row 6, column phi_deg: 400 is outside (-180, 180] and 0 ... 360 degrees.",
    ),
    BadInput(
        "side",
        edited(4, "side", "B"),
        ", row 4, column side: 'B' is no side; write R for reflection or T for transmission.",
    ),
    BadInput(
        "nan",
        edited(4, "bsdf_per_sr", "NaN"),
        ", row 4, column bsdf_per_sr: 'NaN' is not finite; leave the row out.",
    ),
    BadInput(
        "infinite",
        edited(2, "phi_deg", "-inf"),
        ", row 2, column phi_deg: '-inf' is not finite; leave the row out.",
    ),
    BadInput(
        "blank_cell",
        edited(3, "phi_deg", " "),
        ", row 3, column phi_deg: the cell is blank; a number is needed.",
    ),
    BadInput(
        "some_wavelengths_blank",
        edited(3, "wavelength_nm", ""),
        ", row 3, column wavelength_nm: the cell is blank; a number is needed.",
    ),
    BadInput(
        "text_cell",
        edited(6, "bsdf_per_sr", "n/a"),
        ", row 6, column bsdf_per_sr: 'n/a' is not a number.",
    ),
    BadInput(
        "underscore",
        edited(6, "theta_i_deg", "1_0"),
        ", row 6, column theta_i_deg: '1_0' is not a number.",
    ),
    BadInput(
        "sigma_zero",
        edited(5, "sigma_per_sr", "0"),
        ", row 5, column sigma_per_sr: 0 is not positive; a standard deviation in 1/sr is needed.",
    ),
    BadInput(
        "sigma_negative",
        edited(5, "sigma_per_sr", "-0.01"),
        ", row 5, column sigma_per_sr: -0.01 is not positive; a standard deviation in 1/sr is needed.",
    ),
    BadInput(
        "beyond_any_measurement",
        edited(4, "bsdf_per_sr", "-1e308"),
        ", row 4, column bsdf_per_sr: -1e+308 is beyond any measurement; without its sign it must be 0 or "
        "lie in 1e-100 ... 1e+12.",
    ),
    BadInput(
        "below_any_measurement",
        edited(4, "sigma_per_sr", "1e-310"),
        ", row 4, column sigma_per_sr: 1e-310 is beyond any measurement; without its sign it must be 0 or "
        "lie in 1e-100 ... 1e+12.",
    ),
    BadInput(
        "all_zero",
        column("bsdf_per_sr", [0] * 5),
        ", column bsdf_per_sr: every value is zero, so nothing was measured.",
    ),
    BadInput(
        "all_negative",
        column("bsdf_per_sr", [-1, 0, -1, -1, 0]),
        ", column bsdf_per_sr: every value is negative or zero, so nothing was measured.",
    ),
    BadInput(
        "too_many_columns",
        _bytes(line + "".join(f",c{k}" for k in range(994)) for line in GOOD),
        ", row 1: has 1001 columns; 1000 are read at most.",
    ),
    BadInput(
        "two_samples",
        _bytes([GOOD[0] + ",sample", *(f"{line},{'ab'[i % 2]}" for i, line in enumerate(GOOD[1:]))]),
        ", column sample: holds 2 samples; choose one by sample=..., of a, b.",
    ),
)
