"""The names that people give to columns, in the languages of the field, and the units that they add.

Case, accents, spaces and underscores do not count; Greek letters are read by their names.
"""

import re
import unicodedata
from typing import NamedTuple

UNITS = {
    "deg": (
        "deg",
        "degs",
        "degree",
        "degrees",
        "°",
        "\N{MASCULINE ORDINAL INDICATOR}",
        "grad",
        "degre",
        "degres",
    )
    + ("度", "grado", "grados", "gradi"),
    "nm": ("nm", "nanometer", "nanometers", "nanometre", "nanometres", "ナノメートル"),
    "1/sr": (
        "1/sr",
        "/sr",
        "sr-1",
        "sr^-1",
        "sr^{-1}",
        "sr^(-1)",
        "sr**-1",
        "sr⁻¹",
        "sr-¹",
        "steradian-1",
        "steradian^-1",
        # Of luminance coefficients.
        "cd/m2/lx",
        "cd/m^2/lx",
        "cd/m²/lx",
        "persr",
        "per_sr",
        "1/steradian",
    ),
}
UNIT_OF = dict.fromkeys(("theta_i_deg", "theta_o_deg", "phi_deg", "phi_i_deg", "phi_o_deg"), "deg")
UNIT_OF |= {"wavelength_nm": "nm", "bsdf_per_sr": "1/sr", "sigma_per_sr": "1/sr"}
# Units that need a conversion, by the unit of the column.
CONVERSIONS = {
    "deg": {"rad": "180/pi", "radian": "180/pi", "radians": "180/pi", "mrad": "0.18/pi", "gon": "0.9"},
    "nm": {
        **dict.fromkeys(("um", "\N{MICRO SIGN}m", "\N{GREEK SMALL LETTER MU}m", "micron", "microns"), "1000"),
        **{"m": "1e9", "mm": "1e6", "a": "0.1", "å": "0.1", "angstrom": "0.1"},
    },
    "1/sr": {"%": "0.01, if it is per cent of 1/sr", "percent": "0.01, if it is per cent of 1/sr"}
    | {"%/sr": "0.01", "pct": "0.01, if it is per cent of 1/sr"},
}
# Of a signal or of another quantity: the BSDF does not follow from it by a factor that is known.
_NO_BSDF_UNITS = {
    *("v", "mv", "a", "ma", "na", "w", "mw", "w/sr", "mw/sr", "w/m2/sr", "w/m^2/sr", "w/(m2sr)"),
    *("cd", "cd/m2", "cd/m^2", "cd/m²", "lx", "lux", "lm", "counts", "count", "cts", "cps", "adc", "db"),
    *("a.u.", "au", "arb.u.", "arb.units"),
}
# Of a name of values, what says that they are the BSDF times a cosine, or a factor of a perfect diffuser.
_COSINE = re.compile(
    r"cos(?:ine)?[ _-]*(?:corrected|weighted)|corrected.*\bcos|\bcc_?b[rst]df|[*x×·]\s*cos"
    r"|b[rst]df[ _]*cos\b|\bars\b|angle[ -]resolved scatter",
    re.IGNORECASE,
)
_FACTOR = re.compile(r"(?:reflectance|radiance|luminance|reflection|leuchtdichte)[ _-]*fa[ck]tor", re.I)
_LOGARITHM = re.compile(r"\blog(?:10)?\b|\blg\b|\bln\b", re.IGNORECASE)
_INTENSITY = re.compile(r"(?:radiant|luminous)[ _-]*intensity|lichtstärke|strahlstärke", re.IGNORECASE)
# A unit with a power of ten before it.
_POWER = re.compile(r"[x×*]?(?:10\^?|1e)(-?\d{1,2})[*×]?(.*)")
# Angles that are not measured from the normal.
_FROM_ELSEWHERE = {
    "from the specular direction": re.compile(r"specular|glanzwinkel", re.IGNORECASE),
    "from the surface": re.compile(r"elevation|grazing|from (?:the )?(?:surface|plane)", re.IGNORECASE),
    "from the beam": re.compile(r"from (?:the )?(?:incident )?(?:beam|source|lamp)", re.IGNORECASE),
}
# Names of values that also say the side.
_OF_SIDE = {
    "R": ("brdf", "fdrb", "反射", "f_r"),
    "T": ("btdf", "fdtb", "透過", "透射"),
}
# Words for the two sides.
SIDES = {
    "R": "r reflection reflectance reflected brdf reflexion réflexion réflectance reflektion "
    "reflektiert réfléchi reflexionsgrad remission reflexión riflessione reflectie 反射",
    "T": "t transmission transmittance transmitted btdf transmittiert transmis transmisión trasmissione "
    "transmissie 透過 透射",
}
SIDES = {word: side for side, words in SIDES.items() for word in words.split()}
_BESIDE = re.compile(r"\d{3,4}(nm)?|nm|side|seite")
_ANGLE_WORDS = ("angle", "winkel", "theta", "azimut", "角", "ángulo", "angolo")
# Coordinates of directions that are no angles: direction cosines and sine space.
COSINES = """
        beta, beta_0, beta_i, beta_o, beta_s, beta_r, beta_x, beta_y, beta_minus_beta0, beta_beta0,
        abs_beta_beta0, mod_beta_beta0, delta_beta, u_x, u_y, u_z, k_x, k_y, k_z, dir_x, dir_y, dir_z,
        d_x, d_y, d_z, cos_x, cos_y, cos_z, cos_alpha, cos_beta, cos_gamma, direction_cosine,
        direction_cosine_x, direction_cosine_y, direction_cosine_z, x_cosine, y_cosine, z_cosine,
        cosine_x, cosine_y, dcx, dcy, dcz, sin_theta, sin_theta_i, sin_theta_o, sin_theta_s, sin_theta_r,
        cos_theta, cos_theta_i, cos_theta_o, cos_theta_s, cos_theta_r, Richtungskosinus,
        Richtungscosinus, cosinus directeur, 方向余弦, 方向余弦x, 方向余弦y"""
_GREEK = {"α": "alpha", "β": "beta", "γ": "gamma", "θ": "theta", "λ": "lambda", "σ": "sigma", "φ": "phi"}
_GREEK |= {"δ": "delta", "ς": "sigma"}
_BRACKETS = re.compile(r"(.*?)\s*[\[({（［]([^\])}）］]*)[\])}）］]\s*")
_BETWEEN = re.compile(r"(?:\s+in|\s*[/,;:]|[\s_]+)[\s_]*$", re.IGNORECASE)
_ENDINGS = sorted(
    {
        word
        for words in (*UNITS.values(), *CONVERSIONS.values())
        for word in words
        if len(word) > 1 or word in "°%"
    },
    key=len,
    reverse=True,
)


def is_unit(cell: str) -> bool:
    """Whether a cell is a unit, right or wrong, and nothing else."""
    return any(plain_unit(cell) in (*UNITS[kind], *CONVERSIONS[kind]) for kind in UNITS)


def plain_unit(cell: str) -> str:
    """A unit in small letters without accents, spaces and brackets."""
    word = re.sub(r"[\s\[\]()]", "", cell).lower().replace("\N{MINUS SIGN}", "-").replace("·", "")
    return "".join(c for c in unicodedata.normalize("NFD", word) if not unicodedata.combining(c))


# Names of each quantity, separated by commas. phi_deg is phi_o_deg minus phi_i_deg.
NAMES = {
    "theta_i_deg": """
        theta_i, theta_in, theta_inc, theta_incident, theta_incidence, theta_source, theta_light,
        theta_entrance, incident_theta, incidence_angle, incident_angle, angle_of_incidence, aoi,
        polar_angle_of_incidence, incident_polar_angle, Einfall, incidence_zenith_angle, entrance_angle,
        illumination_angle, angle_of_illumination, Einfallswinkel, Einfallwinkel, Einstrahlwinkel,
        Beleuchtungswinkel, theta_ein, angle d'incidence, angle incident, angle d'éclairage,
        angle d'illumination, 入射角, 入射角度, 入射天頂角, 入射极角, 照明角, 照射角,
        ángulo de incidencia, angolo di incidenza, angolo d'incidenza, invalshoek, theta_incoming,
        incoming_theta, incoming_angle, theta_illumination, illumination_zenith_angle, source_angle,
        source_zenith_angle, lamp_angle, solar_zenith_angle, incident_zenith_angle, zenith_i,
        incident_zenith, incidence_zenith, source_zenith, zenith_of_incidence""",
    "theta_o_deg": """
        theta_o, theta_out, theta_r, theta_s, theta_v, theta_t, theta_scatter, theta_scattered,
        theta_refl, theta_reflected, theta_transmitted, theta_view, theta_viewing, theta_det,
        theta_detector, theta_exit, theta_obs, outgoing_theta, viewing_angle, view_angle, angle_of_view,
        exit_angle, exiting_angle, observation_angle, angle_of_observation, outgoing_angle,
        detection_angle, angle_of_detection, detector_angle, receiver_angle, receiving_angle,
        reflection_angle, angle_of_reflection, emergence_angle, view_zenith_angle, viewing_zenith_angle,
        Ausfallswinkel, Ausfallwinkel, Austrittswinkel, Beobachtungswinkel, Betrachtungswinkel,
        Abstrahlwinkel, Reflexionswinkel, Detektorwinkel, theta_aus, angle d'observation, angle de vue,
        angle de réflexion, angle d'émergence, angle de sortie, 出射角, 出射角度, 射出角, 受光角,
        受光角度, 観測角, 観察角, 反射角, 观测角, 观察角, 散射极角, ángulo de observación,
        ángulo de reflexión, angolo di osservazione, waarnemingshoek, theta_outgoing, theta_detection,
        theta_observation, theta_sensor, sensor_angle, sensor_zenith_angle, camera_angle, emission_angle,
        angle_of_emission, theta_emission, outgoing_zenith_angle, exit_zenith_angle, exitant_angle,
        observation_zenith_angle, viewing_polar_angle, polar_angle_of_view, Sichtwinkel, zenith_o,
        zenith_r, zenith_s, zenith_v, view_zenith, viewing_zenith, detector_zenith, sensor_zenith""",
    "phi_deg": """
        phi, dphi, delta_phi, phi_rel, phi_relative, relative_phi, azimuth, azimuth_angle,
        relative_azimuth, relative_azimuth_angle, azimuth_difference, rel_azimuth, Azimut, Azimutwinkel,
        relativer Azimut, relativer Azimutwinkel, Azimutdifferenz, azimut relatif, angle azimutal,
        angle azimutal relatif, différence d'azimut, 方位角, 相対方位角, 方位角差, 相对方位角, acimut,
        acimut relativo""",
    "phi_i_deg": """
        phi_i, phi_in, phi_inc, phi_incident, phi_incidence, phi_source, phi_light, phi_entrance,
        incident_phi, azimuth_i, azimuth_in, azimuth_inc, azimuth_incident, azimuth_incidence,
        azimuth_of_incidence, azimuth_source, azimuth_entrance, azimuth_entrance_angle,
        azimuth_incidence_angle, entrance_azimuth, incidence_azimuth, incident_azimuth,
        incidence_azimuth_angle, incident_azimuth_angle, source_azimuth, illumination_azimuth,
        azimuth_of_illumination, azimuth_of_source, azimuth_angle_of_incidence, Einfallsazimut,
        Einfallsazimutwinkel, Azimut Einfall, Azimut des Einfalls, Azimut Einfallswinkel,
        Azimut der Quelle, Beleuchtungsazimut, phi_ein, azimut d'incidence, azimut incident,
        phi_incoming, incoming_phi, incoming_azimuth, solar_azimuth, azimut incidence,
        azimut de la source, azimut d'éclairage, 入射方位角, 入射方位, 照明方位角,
        acimut de incidencia, azimut di incidenza""",
    "phi_o_deg": """
        phi_o, phi_out, phi_r, phi_s, phi_v, phi_t, phi_scatter, phi_scattered, phi_refl, phi_reflected,
        phi_transmitted, phi_view, phi_viewing, phi_det, phi_detector, phi_exit, phi_obs, outgoing_phi,
        azimuth_o, azimuth_r, azimuth_s, azimuth_v, azimuth_out,
        azimuth_outgoing, azimuth_scatter, azimuth_view, azimuth_exit,
        azimuth_detector, azimuth_exit_angle, azimuth_of_view, azimuth_of_observation, view_azimuth,
        viewing_azimuth, exit_azimuth, detector_azimuth, outgoing_azimuth, scatter_azimuth,
        reflection_azimuth, observation_azimuth, view_azimuth_angle, viewing_azimuth_angle,
        outgoing_azimuth_angle, Ausfallsazimut, Ausfallsazimutwinkel, Azimut Ausfall,
        Azimut Ausfallswinkel, Beobachtungsazimut, Azimut des Detektors, phi_aus, azimut d'observation,
        phi_outgoing, phi_detection, phi_observation, phi_sensor, sensor_azimuth,
        azimut d'émergence, azimut de sortie, azimut du détecteur, 出射方位角, 受光方位角, 観測方位角,
        反射方位角, 观测方位角, acimut de observación""",
    "wavelength_nm": """
        wavelength, wave_length, wavelen, lambda, wl, Wellenlänge, Wellenlaenge, longueur d'onde, 波長,
        波长, longitud de onda, lunghezza d'onda, golflengte""",
    "side": "side, r_or_t, r_t, Seite, côté, lado, lato, 反射透過",
    "bsdf_per_sr": """
        bsdf, brdf, btdf, bsdf_value, brdf_value, btdf_value, brdf_per_sr, btdf_per_sr, f_r, BSDF-Wert,
        BRDF-Wert, BTDF-Wert, valeur BSDF, valeur BRDF, valeur BTDF, FDRB, FDTB, BSDF値, BRDF値, BTDF値,
        radiance_coefficient, luminance_coefficient, Strahldichtekoeffizient, Leuchtdichtekoeffizient,
        coefficient de luminance, 輝度係数, 双方向反射率分布関数, 双方向透過率分布関数, 双向反射分布函数,
        双向透射分布函数""",
    "sigma_per_sr": """
        sigma, sigma_bsdf, sigma_brdf, sigma_btdf, bsdf_sigma, brdf_sigma, btdf_sigma, bsdf_std,
        brdf_std, btdf_std, bsdf_uncertainty, brdf_uncertainty, btdf_uncertainty, u_bsdf, u_brdf, u_btdf,
        std, stdev, stderr, std_dev, error, uncertainty, standard_deviation, standard_uncertainty,
        Standardabweichung, Unsicherheit, Messunsicherheit, écart-type, incertitude, incertitude type,
        標準偏差, 不確かさ, 标准差, 不确定度, desviación estándar""",
}


# Words that name an angle if degrees stand beside them, and otherwise may be anything.
_WITH_DEGREES = {
    "theta_i_deg": "incidence, incident, incoming, illumination, source, Einfall, Beleuchtung, 入射, 照明",
    "theta_o_deg": """
        view, viewing, observation, detection, detector, sensor, receiver, exit, outgoing, Ausfall,
        Beobachtung, Betrachtung, Detektor, 受光, 観測, 观测""",
}


def plain_name(name: str) -> str:
    """A column name in small letters, digits and underscores: ``phi [deg]`` is ``phi_deg``."""
    letters = unicodedata.normalize("NFKD", unicodedata.normalize("NFKC", name).casefold())
    spelt = "".join(_GREEK.get(c, c) for c in letters if not unicodedata.combining(c))
    return re.sub(r"\W+", "_", spelt).strip("_")


def _key(name: str) -> str:
    return plain_name(name).replace("_", "")


def _keys(text: str) -> set[str]:
    return {_key(name) for name in text.split(",")}


_TARGET = {key: target for target, text in NAMES.items() for key in (_keys(text) | {_key(target)})}
_TARGET_WITH_DEGREES = {key: target for target, text in _WITH_DEGREES.items() for key in _keys(text)}
_COSINES = _keys(COSINES)


def meaning(name: str) -> tuple[str, str] | None:
    """Quantity and unit (may be empty) of a column with this name; None if the name is unknown."""
    if (exact := plain_name(name)) in NAMES:
        return exact, ""
    stem, unit = name_and_unit(name)
    target = _TARGET.get(_key(stem)) or _TARGET.get(_key(name))
    if target is None and plain_unit(unit) in UNITS["deg"]:
        target = _TARGET_WITH_DEGREES.get(_key(stem))
    return None if target is None else (target, unit)


def unit_problem(target: str, unit: str, if_right: str = "") -> str | None:
    """What is wrong with a unit for a quantity, and the remedy; None if it is right or absent.

    Parameters
    ----------
    target
        The quantity.
    unit
        What a heading has in brackets, or at its end.
    if_right
        How the caller says that the unit is right, if it is none that is known: it may be a remark.
    """
    word = plain_unit(unit)
    kind = UNIT_OF.get(target)
    if kind is None or word in ("", "-") or word in UNITS[kind]:
        return None
    named = f"the unit is '{unit.strip()}'"
    if target == "sigma_per_sr" and "%" in word:
        return (
            f"{named}; if it is per cent of the BSDF, multiply the column by 0.01 and by the BSDF, and name "
            "it sigma_per_sr, or remove it and state relative in [noise] of the sample file"
        )
    if (factor := _factor_of(kind, word)) is not None:
        return f"{named}; multiply the column by {factor}, and name it {target}"
    if kind == "1/sr" and word in _NO_BSDF_UNITS:
        return f"{named}, in which no BSDF is; convert the column to 1/sr, and name it {target}"
    return f"{named}, which is not known; convert the column to {kind}, and name it {target}{if_right}"


def is_known_unit(target: str, unit: str) -> bool:
    """Whether a unit is right, or one that `unit_problem` knows to be wrong; else it may be a remark."""
    kind, word = UNIT_OF.get(target, ""), plain_unit(unit)
    known = {*UNITS.get(kind, ()), *(_NO_BSDF_UNITS if kind == "1/sr" else ())}
    return word in known or _factor_of(kind, word) is not None or "%" in unit


def _factor_of(kind: str, word: str) -> str | None:
    """By which a column in this unit is multiplied; None if that is not known."""
    if (factor := CONVERSIONS.get(kind, {}).get(word)) is not None:
        return factor
    power = _POWER.fullmatch(word)
    is_multiple = power is not None and (
        power[2] in UNITS.get(kind, ()) or f"/{power[2]}" in UNITS.get(kind, ())
    )
    return f"1e{int(power[1])}" if power is not None and is_multiple else None


def is_cosine_product(name: str) -> bool:
    """Whether a name of values says that they are the BSDF times a cosine."""
    return _COSINE.search(name) is not None


class Otherwise(NamedTuple):
    """What a name says that values or angles are, and what turns them into what is wanted."""

    what: str
    remedy: str
    is_cosine: bool = False

    def of_column(self, target: str) -> str:
        """Sentence on a column that would have to be this quantity."""
        end = f"; if it is the BSDF itself, name it {target}" if self.is_cosine else f", and name it {target}"
        return f"{self.what}; {self.remedy}{end}"

    def of_title(self, title: str) -> str:
        """Sentence on a title that says it of the values below."""
        end = "; if it is the BSDF itself, remove" if self.is_cosine else ", and remove"
        return f"the title '{title}' says that the table {self.what}; {self.remedy}{end} these words"


def other_quantity(target: str, name: str) -> Otherwise | None:
    """What a name says that a column is instead of a quantity; None if it says nothing against it."""
    if target == "bsdf_per_sr":
        if is_cosine_product(name):
            remedy = "state it: --cosine-weighted (in Python: cosine_weighted=True)"
            return Otherwise("holds the BSDF times a cosine", remedy, is_cosine=True)
        if _FACTOR.search(name):
            by = "100 pi" if "%" in name or "percent" in name.lower() else "pi"
            return Otherwise("holds factors of a perfect diffuser", f"divide by {by}")
        if _LOGARITHM.search(name):
            return Otherwise("holds logarithms", "raise 10, or the base, to them")
        if _INTENSITY.search(name):
            return Otherwise("holds an intensity", "divide it by the incident flux and by cos(theta_o)")
    if target in ("theta_i_deg", "theta_o_deg"):
        for origin, words in _FROM_ELSEWHERE.items():
            if words.search(name):
                return Otherwise(f"holds angles {origin}", "convert them to angles from the normal")
    return None


def side_of(name: str) -> str | None:
    """``R`` or ``T`` if the name of the values says so."""
    key = _key(name)
    found = [side for side, words in _OF_SIDE.items() if any(_key(word) in key for word in words)]
    return found[0] if len(found) == 1 else None


def side_in_words(text: str) -> str | None:
    """``R`` or ``T`` if the words of a title, or of the name of a sheet, say so and nothing else.

    A single letter counts if it stands alone, or next to a wavelength; angles of reflection are not the side.
    """
    low = unicodedata.normalize("NFC", text.strip().lower())
    if any(word in low for word in _ANGLE_WORDS):
        return None
    words = [word for word in re.split(r"[\W_]+", low) if word]
    named = [SIDES.get(word) or _side_of_ideographs(word) for word in words]
    plain = [word for word in words if not _BESIDE.fullmatch(word)]
    found = {
        side
        for word, side in zip(words, named, strict=True)
        if side is not None and (len(word) > 1 or len(plain) == 1 or not word.isascii())
    }
    return found.pop() if len(found) == 1 else None


def _side_of_ideographs(word: str) -> str | None:
    """Words of ideographs are not separated."""
    if word.isascii():
        return None
    return next(
        (side for name, side in SIDES.items() if not name.isascii() and len(name) == 2 and name in word), None
    )


def is_angle(name: str) -> bool:
    """Whether a name is that of an angle, whichever."""
    if plain_unit(name_and_unit(name)[1]) in UNITS["deg"]:
        return True
    return any(word in unicodedata.normalize("NFC", name.lower()) for word in _ANGLE_WORDS)


def is_cosine(name: str) -> bool:
    """Whether the name is that of a direction cosine or of sine space."""
    return _key(name_and_unit(name)[0]) in _COSINES or _key(name) in _COSINES


def name_and_unit(name: str) -> tuple[str, str]:
    """Name and unit of a header."""
    if found := _BRACKETS.fullmatch(name):
        return found[1], found[2]
    low = name.strip().lower()
    for word in _ENDINGS:
        if low.endswith(word) and (between := _BETWEEN.search(low[: -len(word)])):
            return name.strip()[: between.start()], word
        if word == "°" and low.endswith(word):
            return name.strip()[:-1], word
    return name, ""
