"""What people write in place of a key or a word of a sample file, and the hints that they get."""

import difflib
import re
from collections.abc import Iterable, Mapping

from jaxink.errors import no_such_name
from jaxink.sample import measurement_schema, schema
from jaxink.sample.schema import Entry, Quantity

# Further words for a key. Some have several keys; the one that is valid in the table is suggested.
_WORDS = {
    "refractive_index": "n index ior refraction refraction_index binder_index binder_refractive_index "
    "index_binder n_binder plate_index index_plate n_plate",
    "index_front": "n_front front_index index_in n_in n0 medium_index",
    "index_back": "n_back back_index index_out n_out substrate_index",
    "thickness_mm": "thickness thickness_um thickness_cm thickness_nm thickness_m d d_mm d_um d_nm height",
    "thickness_um": "thickness thickness_mm thickness_cm thickness_nm thickness_m d d_mm d_um d_nm height",
    "scattering_per_mm": "mu_s mus s scattering sigma_s scattering_coefficient scattering_per_cm "
    "scattering_per_um scattering_per_m",
    "absorption_per_mm": "mu_a mua a alpha absorption sigma_a absorption_coefficient absorption_per_cm "
    "absorption_per_um absorption_per_m",
    "single_scattering_albedo": "albedo ssa omega omega0 w0",
    "scattering_per_mm and absorption_per_mm": "albedo ssa omega omega0 w0 single_scattering_albedo",
    "asymmetry_parameter": "g hg g1 asymmetry anisotropy asymmetry_factor mean_cosine henyey_greenstein",
    "second_asymmetry_parameter": "g2 second_g asymmetry_2",
    "second_weight": "w w2 weight fraction",
    "phase_function": "phase phasefunction scattering_function",
    "kind": "type layer_type category",
    "name": "label id",
    "wavelength_nm": "wavelength wavelengths wavelengths_nm wavelength_um lambda lambda_nm wl wl_nm",
    "layers": "layer stack",
    "radius_nm": "r radius r_nm radius_um diameter diameter_nm particle_radius size size_nm particle_size",
    "radius_variance_ln": "radius_variance variance polydispersity",
    "radii_nm": "radii sizes sizes_nm",
    "number_weights": "weights numbers",
    "volume_fraction": "concentration volume_concentration pvc loading volume fraction",
    "particle_index": "n_particle pigment_index index_particle n_pigment particle_refractive_index",
    "particle_absorption_index": "k kappa extinction_coefficient imaginary_index",
    "structure_factor_weight": "structure_factor dependent_scattering percus_yevick",
    "sigma_deg": "sigma slope rms_slope roughness roughness_deg angle_deg",
    "height_rms_um": "rms rms_um rq sq sigma sigma_um height_rms",
    "correlation_length_um": "correlation_length length length_um",
    "length_b_um": "correlation_length length length_um",
    "reflectance": "r albedo reflectivity",
    "source_half_angle_deg": "source_angle_deg source_half_angle source_cone_deg divergence_deg",
    "detector_half_angle_deg": "detector_angle_deg detector_half_angle acceptance acceptance_deg",
    "beam_diameter_mm": "beam beam_mm spot spot_mm spot_diameter_mm",
    "detector_diameter_mm": "field field_mm aperture_mm field_diameter_mm",
    "relative": "sigma noise error percent relative_noise relative_sigma standard_deviation",
    "floor_per_sr": "floor absolute offset background dark",
    "scan_relative": "scan scan_factor gain systematic",
    "value": "start initial init guess",
    "free": "fit fitted vary variable fixed",
    "min": "minimum lower lowest lower_bound",
    "max": "maximum upper highest upper_bound",
    "min and max": "bounds range limits",
    "standard_deviation": "std sd sigma",
    "tie": "tied equal_to same_as expression formula",
    "shape": "spectrum spectral_shape relative_values ratios profile",
    "lit_side": "lit illuminated illuminated_side",
}
# Further words for a value.
_VALUES = {
    "henyey_greenstein": "hg henyey greenstein henyeygreenstein",
    "two_term_henyey_greenstein": "tthg double_henyey_greenstein two_term two_hg double_hg two_term_hg",
    "mie": "mie_theory sphere spheres particle particles lorenz_mie",
    "tabulated": "table legendre moments measured custom",
    "clear": "transparent plate glass coat coating substrate non_scattering air",
    "scattering": "ink diffuse paint turbid scatterer scatter",
    "beckmann": "gaussian gauss normal",
    "ggx": "trowbridge_reitz",
    "R": "reflection reflectance brdf",
    "T": "transmission transmittance btdf",
}


def _units() -> dict[str, str]:
    """Unit of every number of a sample file by its key."""
    tables: list[Mapping[str, Quantity | Entry]] = [
        value
        for module in (schema, measurement_schema)
        for value in vars(module).values()
        if isinstance(value, dict)
    ]
    for choices in (schema.PHASE_FUNCTIONS, schema.SPECTRA, schema.DISPERSIONS, schema.LAWS):
        tables += choices.values()
    units = {key: q.unit for table in tables for key, q in table.items() if isinstance(q, Quantity)}
    return units | {"wavelength_nm": "nm", "radii_nm": "nm", "heights_um": "um", "pitch_um": "um"}


_UNIT_OF = _units()


def unknown_key(name: str, known: Iterable[str]) -> str:
    """End of a sentence about a key or parameter that does not exist; suggests one with its unit.

    Parameters
    ----------
    name
        The key as written, or the dotted name of a parameter.
    known
        Valid ones.
    """
    known = list(known)
    near = _meant(name, known) or next(iter(difflib.get_close_matches(name, known, n=1)), None)
    if near is None:
        return no_such_name(known)
    unit = _UNIT_OF.get(_key(near.split(" and ")[0]), "")
    return no_such_name(known, f"{near}{', in ' + unit if unit else ''}")


def _key(name: str) -> str:
    """Last key of a dotted name, without a wavelength."""
    return name.split("@")[0].rpartition(".")[2]


def _meant(name: str, known: list[str]) -> str | None:
    """The valid name, or several, that another word stands for."""
    stem, dot, _ = name.split("@")[0].rpartition(".")
    for keys, words in _WORDS.items():
        if _plain(_key(name)) not in words.split():
            continue
        wanted = [f"{stem}{dot}{key}" for key in keys.split(" and ")]
        found = [next((valid for valid in known if valid.split("@")[0] == each), None) for each in wanted]
        if None not in found:
            return " and ".join(map(str, found))
    return None


def meant_key(table: Mapping[str, object], key: str) -> str | None:
    """A key of a table that was written in place of the given one, or None."""
    return next((other for other in table if _plain(other) in _WORDS.get(key, "").split()), None)


def meant_word(value: object, known: Iterable[str]) -> str | None:
    """The valid word that another one stands for, or None."""
    if not isinstance(value, str):
        return None
    plain = _plain(value)
    by_plain = {_plain(word): word for word in known}
    for word, others in _VALUES.items():
        if plain in others.split() and word in by_plain.values():
            return word
    near = difflib.get_close_matches(plain, list(by_plain), n=1)
    return by_plain[near[0]] if near else None


def _plain(word: str) -> str:
    return re.sub(r"[\s\-\u2013]+", "_", word.strip().lower())
