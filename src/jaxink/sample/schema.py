"""Keys of a sample file that describe the sample: tables, units, ranges and meanings.

`docs/manual/tables.py` generates the tables of docs/manual/sample-file.md from these.
"""

import dataclasses

FACES = ("front_roughness", "back_roughness")
OPAQUE = "opaque"
HEIGHT_MAP_WORD = "height_map"
# Whether it is present in reflection scans only, or always.
BACKING_SIDES = ("R", "both")
# A table of sizes, in place of radius_nm.
MOST_TABULATED_RADII = 400
_LARGEST_ASYMMETRY = 0.9999
# Facet slope densities that a face may declare.
ROUGHNESS_DENSITIES = ("cauchy", "cauchy_angle", "cauchy2d", "beckmann", "ggx")
AMPLITUDES = ("perturbation", "fresnel")


@dataclasses.dataclass(frozen=True)
class Quantity:
    """One number of the file.

    Parameters
    ----------
    unit
        Unit, empty for a pure number.
    lowest, highest
        Physically possible range, inclusive.
    default
        Value if the key is absent, or None.
    scale, multimodal
        See `Parameter`.
    dispersive
        Whether it may be given as a dispersion, see `DISPERSIONS`.
    has_law
        Whether its spectrum may be given as a law, see `LAWS`.
    otherwise
        What applies without a default, in words.
    spectral
        Of a number of an effect: whether it may have a value for each wavelength.
    meaning
        For the documentation.
    """

    unit: str
    lowest: float
    highest: float
    default: float | None = None
    scale: str = "linear"
    multimodal: bool = False
    dispersive: bool = False
    has_law: bool = False
    otherwise: str = "required"
    spectral: bool = False
    meaning: str = dataclasses.field(kw_only=True)


@dataclasses.dataclass(frozen=True)
class Entry:
    """One key of the file that is not a single number: valid values, default and meaning, in words."""

    values: str
    default: str
    meaning: str


def quoted(words: tuple[str, ...]) -> str:
    """Alternatives as written in a file."""
    return " or ".join(f'`"{word}"`' for word in words)


SURROUNDINGS = {
    "index_front": Quantity(
        "", 1.0, 4.0, 1.0, dispersive=True, meaning="refractive index on the illuminated side"
    ),
    "index_back": Quantity("", 1.0, 4.0, 1.0, dispersive=True, meaning="refractive index on the far side"),
}
# An ideally diffuse reflector behind the sample.
BACKING = {"reflectance": Quantity("", 0.0, 1.0, meaning="reflectance, the parameter `backing.reflectance`")}
BACKING_ENTRIES = {
    "side": Entry(
        quoted(BACKING_SIDES),
        f'`"{BACKING_SIDES[0]}"`',
        '`"R"`: present during reflection scans only; `"both"`: always present, so rows with side T are '
        "rejected",
    ),
    "contact": Entry(
        "`true` or `false`",
        "`false`",
        "`true`: in optical contact with the last layer, so the last face does not reflect and `index_back` "
        'has no effect; requires `side = "both"`',
    ),
}
LAYER_ENTRIES = {
    "name": Entry("letters, digits, underscores", "required", "first part of the names of its parameters"),
    "kind": Entry("`clear` or `scattering`", "required", "a plate or coat, or an ink"),
    "phase_function": Entry("see below", "required", "for scattering layers only"),
    **{
        face: Entry('a table, see "Rough faces"', "smooth", f"roughness of the face {where} the light")
        for face, where in zip(FACES, ("towards", "away from"), strict=True)
    },
}
CLEAR_LAYER = {
    "refractive_index": Quantity("", 1.0, 4.0, dispersive=True, meaning="of the plate or coat"),
    "thickness_mm": Quantity(
        "mm", 0.0, 1e4, meaning="thickness, or `thickness_um` in um, which is converted"
    ),
    "absorption_per_mm": Quantity("1/mm", 0.0, 1e4, 0.0, "log", meaning="absorption coefficient"),
}
SCATTERING_LAYER = {
    "refractive_index": Quantity("", 1.0, 4.0, dispersive=True, meaning="of the binder"),
    "thickness_um": Quantity(
        "um",
        0.0,
        1e7,
        scale="log",
        meaning="thickness, or `thickness_mm` in mm, which is converted, or "
        f'`"{OPAQUE}"` (last layer only): no light leaves behind it',
    ),
}
# Coefficients of a layer or, if it is opaque, the albedo.
COEFFICIENTS = {
    "scattering_per_mm": Quantity(
        "1/mm", 0.0, 1e6, scale="log", has_law=True, meaning="scattering coefficient mu_s"
    ),
    "absorption_per_mm": Quantity(
        "1/mm", 0.0, 1e6, scale="log", has_law=True, meaning="absorption coefficient mu_a"
    ),
}
ALBEDO = {
    "single_scattering_albedo": Quantity("", 0.0, 1.0, scale="one_minus", meaning="mu_s / (mu_s + mu_a)")
}
# An ink that layers are mixed from; a law has no value at a wavelength to which a layer could be tied.
INKS = {key: dataclasses.replace(quantity, has_law=False) for key, quantity in COEFFICIENTS.items()}
SHARE = Quantity("", 0.0, 1.0, meaning="share of the volume, the parameter `layer.mixture.ink`")
MIXTURE = {"mixture": Entry("table of shares", "none", "inks that the layer is mixed from")}
MIE = {
    "radius_nm": Quantity(
        "nm",
        1.0,
        1e5,
        scale="log",
        multimodal=True,
        meaning="radius; the range of the first one that is free is scanned before a gradient-based fit, as "
        "the misfit may have many minima",
    ),
    "volume_fraction": Quantity("", 0.0, 0.74, scale="log", meaning="volume of spheres over volume of ink"),
    "particle_index": Quantity("", 0.5, 5.0, dispersive=True, meaning="real part of the refractive index"),
    "particle_absorption_index": Quantity(
        "", 0.0, 5.0, 0.0, "log", has_law=True, meaning="imaginary part k >= 0"
    ),
}
# Keys that add a parameter only if the file has them; without them the model is smaller and faster. The first
# belong to a population of a Mie layer, the second to the layer.
SIZE_DISTRIBUTION = {
    "radius_variance_ln": Quantity(
        "",
        0.0,
        0.5,
        0.0,
        # Scattering first increases and then decreases with the variance: several values may fit.
        multimodal=True,
        meaning="variance of ln(radius), the squared logarithm of the geometric standard deviation: 0.0091 "
        "for 1.1, 0.033 for 1.2, 0.069 for 1.3, 0.164 for 1.5; if it is free and no radius is, its range is "
        "scanned before a gradient-based fit",
    )
}
MIE_LAYER = {
    "structure_factor_weight": Quantity(
        "",
        0.0,
        1.0,
        0.0,
        meaning="0: independent scattering; 1: full structure factor of hard spheres",
    ),
    "binder_absorption_per_mm": Quantity(
        "1/mm",
        0.0,
        1e6,
        0.0,
        "log",
        has_law=True,
        meaning="absorption coefficient of the binder, which fills the rest of the volume",
    ),
}
RADIUS_TABLE = {
    "radii_nm": Entry(
        f"list of 1 ... {MOST_TABULATED_RADII} numbers", "none", "radii, each in the range of `radius_nm`"
    ),
    "number_weights": Entry("list of as many", "none", "relative number of spheres of each radius"),
}
POPULATIONS = {"populations": Entry("tables", "none", "further kinds of particles")}
_STRENGTH = Quantity("", -10.0, 100.0, meaning="strength of the first resonance")
_RESONANCE = Quantity("um^2", 0.0, 1e4, meaning="square of its wavelength")


def _further(quantity: Quantity, which: str) -> Quantity:
    meaning = quantity.meaning.replace("first", which)
    return dataclasses.replace(quantity, default=0.0, meaning=meaning)


# Formulas of the index against the wavelength, each with its coefficients.
DISPERSIONS: dict[str, dict[str, Quantity]] = {
    "cauchy": {
        "a": Quantity("", 0.5, 5.0, meaning="index at long wavelengths"),
        "b_um2": Quantity("um^2", -1.0, 1.0, 0.0, meaning="coefficient of 1 / wavelength^2"),
        "c_um4": Quantity("um^4", -1.0, 1.0, 0.0, meaning="coefficient of 1 / wavelength^4"),
    },
    "sellmeier": {
        "b1": _STRENGTH,
        "c1_um2": _RESONANCE,
        "b2": _further(_STRENGTH, "second"),
        "c2_um2": _further(_RESONANCE, "second"),
        "b3": _further(_STRENGTH, "third"),
        "c3_um2": _further(_RESONANCE, "third"),
    },
    "table": {"offset": Quantity("", -1.0, 1.0, 0.0, meaning="added to the whole table")},
}
DISPERSION_TABLE = {
    "wavelength_nm": Entry("list of two numbers or more, ascending", "required", "wavelengths, nm"),
    "value": Entry("list of as many", "required", "refractive index at each"),
}
_AT_REFERENCE = Quantity(
    "", 0.0, 1e6, scale="log", meaning="value at the reference, in the unit of the quantity"
)
_REFERENCE = Quantity("nm", 100.0, 1e5, meaning="wavelength of the reference")
# Laws of a coefficient against the wavelength, each with its coefficients.
LAWS: dict[str, dict[str, Quantity]] = {
    "power": {
        "at_reference": _AT_REFERENCE,
        "reference_nm": _REFERENCE,
        "exponent": Quantity("", -10.0, 10.0, meaning="b; positive if the value falls with wavelength"),
    },
    "exponential": {
        "at_reference": _AT_REFERENCE,
        "reference_nm": _REFERENCE,
        "decay_nm": Quantity("nm", 1.0, 1e5, scale="log", meaning="distance over which it falls by e"),
    },
}
_ASYMMETRY = Quantity("", -_LARGEST_ASYMMETRY, _LARGEST_ASYMMETRY, scale="one_minus", meaning="mean cosine g")
PHASE_FUNCTIONS: dict[str, dict[str, Quantity]] = {
    "henyey_greenstein": {"asymmetry_parameter": _ASYMMETRY},
    "two_term_henyey_greenstein": {
        "asymmetry_parameter": dataclasses.replace(_ASYMMETRY, meaning="g of the first lobe"),
        "second_asymmetry_parameter": dataclasses.replace(_ASYMMETRY, meaning="g2 of the second"),
        "second_weight": Quantity("", 0.0, 1.0, meaning="w, share of the second"),
    },
    "rayleigh": {},
    "tabulated": {},
    "mie": MIE,
}
# How each is called in a report.
PHASE_WORDS = {
    "henyey_greenstein": "Henyey\N{EN DASH}Greenstein scattering",
    "two_term_henyey_greenstein": "scattering by two Henyey\N{EN DASH}Greenstein terms",
    "rayleigh": "Rayleigh scattering",
    "tabulated": "scattering by a tabulated phase function",
    "mie": "scattering by Mie spheres",
}
PHASE_TABLE = {
    "moments": Entry("list starting with 1", "none", "Legendre moments without the factor 2l + 1"),
    "angle_deg": Entry("list of four or more, from 0 to 180", "none", "scattering angles, deg"),
    "phase_value": Entry("list of as many, 0 or more", "none", "values; mean over the sphere 1 within 0.01"),
}
FACETS_ENTRIES = {
    "density": Entry(f"see above, or `{HEIGHT_MAP_WORD}`", "required", "density of slopes"),
    "second_density": Entry("see above", "none", "density of slopes of the other facets"),
}
_SIGMA = Quantity("deg", 0.0, 45.0, scale="log", meaning="angle of the density; 0 is a smooth face")
ROUGHNESS = {"sigma_deg": _SIGMA}
# An optional second density.
SECOND_ROUGHNESS = {
    "second_sigma_deg": dataclasses.replace(_SIGMA, meaning="angle of the second density"),
    "second_weight": Quantity("", 0.0, 1.0, meaning="fraction of the facets with the second density"),
}
# Rough faces in wave optics: power spectra of the heights.
_HEIGHT = Quantity("um", 0.0, 1e4, scale="log", meaning="root-mean-square height")
_LENGTH = Quantity("um", 1e-3, 1e6, scale="log", meaning="B: the spectrum bends at the frequency 1/B")
SPECTRA = {
    "k_correlation": {
        "height_rms_um": _HEIGHT,
        "length_b_um": _LENGTH,
        # The height variance is infinite at 2.
        "exponent": Quantity("", 2.05, 200.0, meaning="C"),
    },
    "gaussian": {
        "height_rms_um": _HEIGHT,
        "correlation_length_um": dataclasses.replace(_LENGTH, meaning="L of exp(-(r/L)^2)"),
    },
}
WAVES_ENTRIES = {
    "spectrum": Entry(f"see above, or `{HEIGHT_MAP_WORD}`", "required", "power spectrum of the heights"),
    "amplitude": Entry(quoted(AMPLITUDES), f'`"{AMPLITUDES[0]}"`', "amplitude factor of the theory"),
}
# A measured map.
HEIGHT_MAP = {"height_scale": Quantity("", 0.0, 100.0, 1.0, meaning="factor applied to the heights")}
HEIGHT_MAP_ENTRIES = {
    "heights_um": Entry("`.csv`, `.npy`, `.x3p` or `.sur` file", "required", "heights, um"),
    "pitch_um": Entry(
        "number, or a list of two", "that of `.x3p`, `.sur`", "distance between neighbouring points, um"
    ),
}
PITCH_UM = Quantity("um", 1e-6, 1e6, meaning="distance between neighbouring heights")
