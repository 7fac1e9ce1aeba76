"""What a sample file may say of the measurement, and of its numbers in general.

`docs/tables.py` writes the tables of docs/sample-file.md from here.
"""

import math

from jaxink.sample.quantity import Entry, Quantity, quoted

SCHEMA_VERSION = 1
WAVELENGTH_NM = Quantity("nm", 100.0, 1e5, meaning="wavelength in vacuum")
TOP = {
    "schema_version": Entry(f"{SCHEMA_VERSION}", "required", "version of this format"),
    "title": Entry("text", "empty", 'for people; "simulated" in it is repeated in the figures'),
    "wavelength_nm": Entry(
        f"number or list, {WAVELENGTH_NM.lowest:g} ... {WAVELENGTH_NM.highest:g}",
        "all of the measurement",
        "rows of other wavelengths are left out; needed where a parameter has `per_wavelength`",
    ),
    "lit_side": Entry("name", "the first layer", "only a check: layers are listed from the lit side on"),
    "surroundings": Entry("table", "air on both sides", "see below"),
    "layers": Entry("tables", "required", "at least one of them scattering"),
    "backing": Entry("table", "nothing behind", "see below"),
    "instrument": Entry("table", "ideal", "see below"),
    "noise": Entry("table", "from the measurement", "see below"),
    "masks": Entry("table", "see below", "which points do not enter the fit"),
    "weights": Entry("tables", "none", "weights of residuals"),
}
# Of what is known of a free parameter from elsewhere.
PRIOR = {
    "mean": Quantity("", -math.inf, math.inf, meaning="of the parameter"),
    "standard_deviation": Quantity("", 0.0, math.inf, meaning="of the parameter"),
}
# What a number may be instead of itself.
NUMBER = {
    "value": Entry(
        "number", "middle of the range if free, else required", "the fixed value, or the start of the fit"
    ),
    "free": Entry("`true` or `false`", "`false`", "whether the fit may change it"),
    "min": Entry("number", "required if free", "lower bound of the fit, within the range of the quantity"),
    "max": Entry("number", "required if free", "upper bound of the fit, within the range of the quantity"),
    "unit": Entry("text", "that of its name", "only a check: another unit is refused, never converted"),
    "tie": Entry(
        "expression",
        "none",
        "an expression that gives the value: numbers, names of parameters, `+ - * / **` and brackets; up to "
        "100 operations, powers from -100 to 100, finite real values",
    ),
    "prior": Entry(
        "`{ " + ", ".join(f"{key} = ..." for key in PRIOR) + " }`",
        "none",
        "knowledge of a free parameter from elsewhere, one more residual of chi-square",
    ),
    "per_wavelength": Entry(
        "`true` or `false`",
        "`false`",
        "a value of its own at each of `wavelength_nm`: `value` is a list by ascending wavelength, or one "
        "number for all",
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
# What the detector sees of light that the sample sends back at another wavelength.
DETECTOR_MODES = ("spectrometer", "broadband")
ILLUMINATION = ("wavelength_nm", "power")
LIGHT_ENTRIES = {
    "detector_mode": Entry(
        quoted(DETECTOR_MODES),
        "none",
        '`"spectrometer"`: light of all wavelengths falls on the sample and the detector resolves them; '
        '`"broadband"`: light of one wavelength falls on it and the detector sees all',
    ),
    "illumination": Entry(
        "`{ " + ", ".join(f"{key} = [...]" for key in ILLUMINATION) + " }`",
        "none",
        "spectrum of the light, in any unit of power per nm",
    ),
}
NOISE = {
    "relative": Quantity(
        "",
        0.0,
        1.0,
        otherwise="none",
        meaning="part of the value; without it sigma comes from the file, else from repeats and pairs in the "
        "data",
    ),
    "floor_per_sr": Quantity("1/sr", 0.0, math.inf, 0.0, meaning="constant part"),
    "scan_relative": Quantity("", 0.0, 1.0, 0.0, meaning="common factor of each scan"),
}
NOISE_ENTRIES = {
    "use_file_sigma": Entry(
        "`true` or `false`",
        "`true`",
        "whether the column `sigma_per_sr` of the measurement, where it has one, goes before `relative` and "
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
    "grazing_theta_o_deg": Quantity("deg", 0.0, 90.0, 90.0, meaning="polar angle of view larger than this"),
}
SIDES = ("R", "T")
WEIGHTS = {
    "theta_i_deg": Quantity("deg", 0.0, 90.0, otherwise="all", meaning="incidence"),
    "weight": Quantity(
        "", 0.0, math.inf, meaning="factor of the squared residuals; those of several tables multiply"
    ),
}
WEIGHTS_ENTRIES = {"side": Entry(quoted(SIDES), "both", "side of the sample")}
