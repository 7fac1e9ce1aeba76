"""Keys of a sample file that describe the measurement, and its numbers in general.

`docs/manual/tables.py` generates the tables of docs/manual/sample-file.md from these.
"""

import math

from jaxink.sample.schema import Entry, Quantity, quoted

SCHEMA_VERSION = 1
WAVELENGTH_NM = Quantity("nm", 100.0, 1e5, meaning="wavelength in vacuum")
TOP = {
    "schema_version": Entry(f"{SCHEMA_VERSION}", "required", "version of this format"),
    "title": Entry("text", "empty", 'for people; if it contains "simulated", the figures say so'),
    "wavelength_nm": Entry(
        f"number or list, {WAVELENGTH_NM.lowest:g} ... {WAVELENGTH_NM.highest:g}",
        "all of the measurement",
        "rows with other wavelengths are omitted; required if a parameter has `per_wavelength` or `shape`",
    ),
    "lit_side": Entry("name", "the first layer", "check only: layers are listed from the illuminated side"),
    "surroundings": Entry("table", "air on both sides", "see below"),
    "layers": Entry("tables", "required", "at least one must be scattering"),
    "inks": Entry("tables", "none", 'inks that layers are mixed from, see "Mixed inks"'),
    "backing": Entry("table", "none", "see below"),
    "instrument": Entry("table", "ideal", "see below"),
    "noise": Entry("table", "from the measurement", "see below"),
    "masks": Entry("table", "see below", "points that are excluded from the fit"),
    "weights": Entry("tables", "none", "weights of residuals"),
    "effects": Entry("tables", "none", 'effects beyond layers and instrument, see "Effects"'),
}
# Independent knowledge of a free parameter.
PRIOR = {
    "mean": Quantity("", -math.inf, math.inf, meaning="of the parameter"),
    "standard_deviation": Quantity("", 0.0, math.inf, meaning="of the parameter"),
}
# How fast a quantity with values by wavelength changes.
SMOOTHNESS = {
    "change": Quantity("", 0.0, math.inf, meaning="of the value, one standard deviation"),
    "over_nm": Quantity("nm", 0.0, math.inf, meaning="distance of the wavelengths that it refers to"),
}
# Keys of a table in place of a number.
_SWITCH = "`true` or `false`"
NUMBER = {
    "value": Entry("number", "middle of the range if free, else required", "fixed value or start of the fit"),
    "free": Entry(
        _SWITCH,
        "`false`",
        "whether the fit may change it; with `per_wavelength`, a list says so for each wavelength",
    ),
    "min": Entry("number", "required if free", "lower bound of the fit, within the range of the quantity"),
    "max": Entry("number", "required if free", "upper bound of the fit, within the range of the quantity"),
    "unit": Entry("text", "that in its name", "check only: any other unit is rejected, never converted"),
    "tie": Entry(
        "expression",
        "none",
        "expression that determines the value: numbers, parameter names, `+ - * / **` and brackets; up to "
        "100 operations, powers from -100 to 100, finite real values",
    ),
    "prior": Entry(
        "`{ " + ", ".join(f"{key} = ..." for key in PRIOR) + " }`",
        "none",
        "independent knowledge of a free parameter; adds a term to chi-square",
    ),
    "per_wavelength": Entry(
        _SWITCH,
        "`false`",
        "separate values at each of `wavelength_nm`: `value` is a list by ascending wavelength, or one "
        "number for all",
    ),
    "smoothness": Entry(
        "`{ " + ", ".join(f"{key} = ..." for key in SMOOTHNESS) + " }`",
        "none",
        "with `per_wavelength` and `free`: expected change of the value over so many nm, one standard "
        "deviation; adds a term to chi-square for each pair of neighbouring wavelengths",
    ),
    "shape": Entry(
        "list of numbers, 0 or more",
        "none",
        "values at each of `wavelength_nm` in these ratios, in ascending order of wavelength; `value`, "
        "`free`, `min`, `max`, `prior` and `tie` are then those of their mean",
    ),
}
INSTRUMENT = {
    "source_half_angle_deg": Quantity(
        "deg", 0.0, 30.0, 0.0, meaning="half-angle of the uniform cone of incident light"
    ),
    "detector_half_angle_deg": Quantity(
        "deg", 0.0, 30.0, 0.0, meaning="half-angle of the cone that the detector sees"
    ),
    "beam_diameter_mm": Quantity(
        "mm", 1e-3, 1e4, otherwise="none", meaning="diameter of the uniform beam, across it"
    ),
    "detector_diameter_mm": Quantity(
        "mm", 1e-3, 1e4, otherwise="none", meaning="diameter of the disc on the sample that the detector sees"
    ),
}
# These may be tables, as other parameters.
DIAMETERS = ("beam_diameter_mm", "detector_diameter_mm")
# How the detector responds to fluorescence.
DETECTOR_MODES = ("spectrometer", "broadband")
ILLUMINATION = ("wavelength_nm", "power")
LIGHT_ENTRIES = {
    "detector_mode": Entry(
        quoted(DETECTOR_MODES),
        "none",
        '`"spectrometer"`: light of all wavelengths is incident and the detector resolves them; '
        '`"broadband"`: light of one wavelength is incident and the detector sees all',
    ),
    "illumination": Entry(
        "`{ " + ", ".join(f"{key} = [...]" for key in ILLUMINATION) + " }`",
        "none",
        "spectrum of the incident light, in any unit of power per nm",
    ),
}
NOISE = {
    "relative": Quantity(
        "",
        0.0,
        1.0,
        otherwise="none",
        meaning="share of the value that a point's neighbours have; without it, sigma is taken from the file "
        "or estimated from the values",
    ),
    "floor_per_sr": Quantity("1/sr", 0.0, math.inf, 0.0, meaning="constant part"),
    "scan_relative": Quantity(
        "",
        0.0,
        1.0,
        otherwise="0.002, or estimated with the rest",
        meaning="common factor of each scan; 0 if there is none",
    ),
}
NOISE_ENTRIES = {
    "use_file_sigma": Entry(
        _SWITCH,
        "`true`",
        "whether a column `sigma_per_sr` of the measurement takes precedence over `relative` and "
        "`floor_per_sr`",
    )
}
# 0 (90 for the grazing limit) switches a mask off.
MASKS = {
    "specular_half_angle_deg": Quantity(
        "deg", 0.0, 90.0, 2.5, meaning="in reflection, nearer than this to the specular direction"
    ),
    "undeviated_half_angle_deg": Quantity(
        "deg", 0.0, 90.0, 2.5, meaning="in transmission, nearer than this to the undeviated beam"
    ),
    "retro_half_angle_deg": Quantity(
        "deg", 0.0, 90.0, 2.5, meaning="in reflection, nearer than this to the source"
    ),
    "grazing_theta_o_deg": Quantity("deg", 0.0, 90.0, 90.0, meaning="at polar angles of view above this"),
}
SIDES = ("R", "T")
WEIGHTS = {
    "theta_i_deg": Quantity("deg", 0.0, 90.0, otherwise="all", meaning="angle of incidence"),
    "weight": Quantity(
        "",
        0.0,
        math.inf,
        otherwise="required, or 1 with `column`",
        meaning="factor of the squared residuals; factors of several tables multiply",
    ),
}
WEIGHTS_ENTRIES = {
    "side": Entry(quoted(SIDES), "both", "side of the sample"),
    "theta_o_deg": Entry("list of two numbers", "all", "lowest and highest polar angle of view, deg"),
    "wavelength_nm": Entry("list of two numbers", "all", "lowest and highest wavelength, nm"),
    "column": Entry("text", "none", "column of the measurement with a further factor for each point"),
}
