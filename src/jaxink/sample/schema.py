"""What a sample file may say: every table, key, unit and range in one place."""

import dataclasses
import math

SCHEMA_VERSION = 1


@dataclasses.dataclass(frozen=True)
class Quantity:
    """One number that a layer, or the surroundings, may have.

    Parameters
    ----------
    unit
        Unit, empty for a pure number.
    lowest, highest
        What physics allows, inclusive.
    default
        Value if the file is silent; None: the file must say it.
    scale, multimodal
        For fits, see `Parameter`.
    dispersive
        Whether it may be given as a dispersion, see `DISPERSIONS`.
    """

    unit: str
    lowest: float
    highest: float
    default: float | None = None
    scale: str = "linear"
    multimodal: bool = False
    dispersive: bool = False


_INDEX = Quantity("", 1.0, 4.0, dispersive=True)
_LARGEST_ASYMMETRY = 0.9999

SURROUNDINGS = {
    "index_front": dataclasses.replace(_INDEX, default=1.0),
    "index_back": dataclasses.replace(_INDEX, default=1.0),
}
# Of an ideally diffuse reflector behind the sample.
BACKING = {"reflectance": Quantity("", 0.0, 1.0)}
# Which scans see it: those of reflection alone, from the others it was taken away; or it stays.
BACKING_SIDES = ("R", "both")
CLEAR_LAYER = {
    "refractive_index": _INDEX,
    "thickness_mm": Quantity("mm", 0.0, 1e4),
    "absorption_per_mm": Quantity("1/mm", 0.0, 1e4, 0.0, "log"),
}
SCATTERING_LAYER = {
    "refractive_index": _INDEX,
    "thickness_um": Quantity("um", 0.0, 1e7, scale="log"),
}
# How much a layer scatters: by coefficients, or, where only their ratio matters, by the albedo.
COEFFICIENTS = {
    "scattering_per_mm": Quantity("1/mm", 0.0, 1e6, scale="log"),
    "absorption_per_mm": Quantity("1/mm", 0.0, 1e6, scale="log"),
}
ALBEDO = {"single_scattering_albedo": Quantity("", 0.0, 1.0, scale="one_minus")}
MIE = {
    "radius_nm": Quantity("nm", 1.0, 1e5, scale="log", multimodal=True),
    "volume_fraction": Quantity("", 0.0, 0.74, scale="log"),
    "particle_index": Quantity("", 0.5, 5.0, dispersive=True),
    "particle_absorption_index": Quantity("", 0.0, 5.0, 0.0, "log"),
}
# Keys that bring a parameter only where a file has them: without them the model is the smaller, quicker one.
# The first go with every population of a Mie layer, the second with the layer.
# Scattering first grows and then falls with the variance: more than one value may fit.
SIZE_DISTRIBUTION = {"radius_variance_ln": Quantity("", 0.0, 0.5, 0.0, multimodal=True)}
MIE_LAYER = {
    "structure_factor_weight": Quantity("", 0.0, 1.0, 0.0),
    "binder_absorption_per_mm": Quantity("1/mm", 0.0, 1e6, 0.0, "log"),
}
# A table of sizes, in place of radius_nm.
RADIUS_TABLE = ("radii_nm", "number_weights")
MOST_TABULATED_RADII = 400
_STRENGTH, _RESONANCE = Quantity("", -10.0, 100.0), Quantity("um^2", 0.0, 1e4)
# Formulas of the index against the wavelength, each with its coefficients.
DISPERSIONS: dict[str, dict[str, Quantity]] = {
    "cauchy": {
        "a": Quantity("", 0.5, 5.0),
        "b_um2": Quantity("um^2", -1.0, 1.0, 0.0),
        "c_um4": Quantity("um^4", -1.0, 1.0, 0.0),
    },
    "sellmeier": {
        "b1": _STRENGTH,
        "c1_um2": _RESONANCE,
        "b2": dataclasses.replace(_STRENGTH, default=0.0),
        "c2_um2": dataclasses.replace(_RESONANCE, default=0.0),
        "b3": dataclasses.replace(_STRENGTH, default=0.0),
        "c3_um2": dataclasses.replace(_RESONANCE, default=0.0),
    },
    "table": {"offset": Quantity("", -1.0, 1.0, 0.0)},
}
_ASYMMETRY = Quantity("", -_LARGEST_ASYMMETRY, _LARGEST_ASYMMETRY, scale="one_minus")
PHASE_FUNCTIONS: dict[str, dict[str, Quantity]] = {
    "henyey_greenstein": {"asymmetry_parameter": _ASYMMETRY},
    "two_term_henyey_greenstein": {
        "asymmetry_parameter": _ASYMMETRY,
        "second_asymmetry_parameter": _ASYMMETRY,
        "second_weight": Quantity("", 0.0, 1.0),
    },
    "rayleigh": {},
    "tabulated": {},
    "mie": MIE,
}
OPAQUE = "opaque"
# Facet slope densities that a face may declare.
ROUGHNESS_DENSITIES = ("cauchy", "cauchy_angle", "cauchy2d", "beckmann", "ggx")
_SIGMA = Quantity("deg", 0.0, 45.0, scale="log")
ROUGHNESS = {"sigma_deg": _SIGMA}
# Of a second density that a face may have, with its share.
SECOND_ROUGHNESS = {"second_sigma_deg": _SIGMA, "second_weight": Quantity("", 0.0, 1.0)}
# Rough faces by wave optics: power spectra of their heights, with their numbers.
_HEIGHT = Quantity("um", 0.0, 1e4, scale="log")
_LENGTH = Quantity("um", 1e-3, 1e6, scale="log")
SPECTRA = {
    "k_correlation": {
        "height_rms_um": _HEIGHT,
        "length_b_um": _LENGTH,
        # The height variance is infinite at 2.
        "exponent": Quantity("", 2.05, 200.0),
    },
    "gaussian": {"height_rms_um": _HEIGHT, "correlation_length_um": _LENGTH},
}
AMPLITUDES = ("perturbation", "fresnel")
# Of a measured map: the factor of its heights.
HEIGHT_MAP = {"height_scale": Quantity("", 0.0, 100.0, 1.0)}
FACES = ("front_roughness", "back_roughness")

# Plain settings: key -> (lowest, highest, default, unit).
INSTRUMENT = {
    "source_half_angle_deg": (0.0, 30.0, 0.0, "deg"),
    "detector_half_angle_deg": (0.0, 30.0, 0.0, "deg"),
    "beam_diameter_mm": (1e-3, 1e4, None, "mm"),
    "detector_diameter_mm": (1e-3, 1e4, None, "mm"),
}
# What the detector sees of light that the sample sends back at another wavelength.
DETECTOR_MODES = ("spectrometer", "broadband")
ILLUMINATION = ("wavelength_nm", "power")
NOISE = {
    "relative": (0.0, 1.0, None, ""),
    "floor_per_sr": (0.0, math.inf, 0.0, "1/sr"),
    "scan_relative": (0.0, 1.0, 0.0, ""),
}
# 0 (90 for the grazing limit) switches a mask off.
MASKS = {
    "specular_half_angle_deg": (0.0, 90.0, 2.5, "deg"),
    "undeviated_half_angle_deg": (0.0, 90.0, 2.5, "deg"),
    "retro_half_angle_deg": (0.0, 90.0, 2.5, "deg"),
    "grazing_theta_o_deg": (0.0, 90.0, 90.0, "deg"),
}
