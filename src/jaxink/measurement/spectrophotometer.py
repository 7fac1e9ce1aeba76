"""Reflectance spectra of spectrophotometers as readings: CGATS.17 text and CxF3 files."""

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError, no_such_name
from jaxink.files.reading import read_bounded
from jaxink.measurement.readings import IDEAL_SPHERE, QUANTITIES, Readings
from jaxink.measurement.table import refusal
from jaxink.measurement.text_file import lines_of

_MOST_BYTES = 50_000_000
# Names of a column of a wavelength: SPECTRAL_NM400, SPECTRAL_NM_400, SPEC_400, nm400.
_WAVE = re.compile(r"(?:SPECTRAL_)?(?:NM|SPEC|DEC)_?(\d{3,4}(?:\.\d+)?)", re.IGNORECASE)
_KEYS = ("SAMPLE_ID", "SAMPLE_NAME", "SAMPLEID", "SAMPLENAME")
_NAMESPACE = re.compile(r"\{[^}]*\}")
_SPECULAR_DEG = 180.0
# Above it, values of a file that states no scale are per cent.
_LARGEST_SHARE = 2.0


@dataclasses.dataclass(frozen=True)
class _Spectrum:
    """One spectrum of a file, and the row or the place that it has."""

    names: tuple[str, ...]
    wavelength_nm: Float[np.ndarray, " wavelengths"]
    value: Float[np.ndarray, " wavelengths"]
    row: int
    quantity: str | None


def is_spectrophotometer_file(head: str) -> bool:
    """Whether a file is of CGATS or CxF3, by its first characters."""
    return is_cxf(head) or "BEGIN_DATA_FORMAT" in head.upper()


def is_cxf(head: str) -> bool:
    """Whether a file is of CxF3."""
    return head.lstrip("\ufeff \t\r\n").startswith("<") and "colorexchangeformat" in head.lower()


def read_spectrophotometer(
    path: Path, head: str, quantity: str | None = None, sample: str | None = None
) -> Readings:
    """One reflectance spectrum of a spectrophotometer.

    Parameters
    ----------
    path, head
        The file, and its first characters.
    quantity
        What was read, one of `jaxink.measurement.readings.QUANTITIES`, if the file does not state it.
    sample
        Identifier or name of the sample, if the file has several.

    Returns
    -------
    Readings
        One at each wavelength, without standard deviations.

    Raises
    ------
    InputRefusedError
        If the file is invalid, or something that it leaves open is not stated.

    References
    ----------
    ISO 28178 (CGATS.17 text); ISO 17972-1 (CxF3).
    """
    found = _of_cxf(path) if is_cxf(head) else _of_cgats(path)
    one = _chosen(path, found, sample)
    return _readings(path, one, _quantity(path, one, quantity))


def _chosen(path: Path, found: Sequence[_Spectrum], sample: str | None) -> _Spectrum:
    names = list(dict.fromkeys(spectrum.names[0] for spectrum in found))
    if sample is None:
        if len(found) == 1:
            return found[0]
        shown = ", ".join(names[:12]) + (" ..." if len(names) > 12 else "")
        raise refusal(path, f"has {len(found)} spectra; name one as sample: {shown}")
    matching = [spectrum for spectrum in found if sample in spectrum.names]
    if len(matching) == 1:
        return matching[0]
    if matching:
        raise refusal(path, f"has {len(matching)} spectra named '{sample}'; name one by its identifier")
    raise refusal(path, f"sample is '{sample}', {no_such_name(names).rstrip('.')}")


def _quantity(path: Path, one: _Spectrum, stated: str | None) -> str:
    if stated is not None and stated not in QUANTITIES:
        raise InputRefusedError(f"quantity is {stated!r}, {no_such_name(QUANTITIES)}")
    if one.quantity is None and stated is None:
        raise refusal(
            path,
            "does not state the geometry; state it as quantity, such as R_45_0, R_0_45, R_de_8 or R_di_8",
        )
    if None not in (one.quantity, stated) and one.quantity != stated:
        raise refusal(path, f"states the geometry of {one.quantity}, but quantity is {stated}; leave it out")
    return str(one.quantity or stated)


def _readings(path: Path, one: _Spectrum, quantity: str) -> Readings:
    kind, size = QUANTITIES[quantity], len(one.value)
    value, notes = one.value, [f"Spectrum {one.names[0]} of the file, read as {quantity}."]
    if value.max(initial=0.0) > _LARGEST_SHARE:
        value = value / 100
        notes.append(f"Values above {_LARGEST_SHARE:g} are taken as per cent.")
    if kind.is_of_sphere:
        notes.append(IDEAL_SPHERE)
    angles = (np.nan if a is None else a for a in (kind.theta_i_deg, kind.theta_o_deg))
    theta_i, theta_o = (np.full(size, angle) for angle in angles)
    phi = np.full(size, _SPECULAR_DEG if kind.has_azimuth else np.nan)
    return Readings(
        np.full(size, quantity),
        theta_i,
        theta_o,
        phi,
        one.wavelength_nm,
        value,
        row=np.full(size, one.row),
        source=str(path),
        notes=tuple(notes),
    )


def _number(path: Path, text: str, row: int, column: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise refusal(path, f"is '{text}'; it must be a number", row, column)
    return value


def _of_cgats(path: Path) -> list[_Spectrum]:
    """Spectra of a CGATS text file; fields are separated by white space, text by quotation marks."""
    lines = lines_of(path, read_bounded(path, _MOST_BYTES, "file of readings"), [])
    fields, found, quantity, scale = list[str](), list[_Spectrum](), None, 1.0
    inside = ""
    for row, line in enumerate(lines, 1):
        words = [a or b for a, b in re.findall(r'"([^"]*)"|([^\s"]+)', line)]
        key = words[0].upper() if words else ""
        if key in ("BEGIN_DATA_FORMAT", "BEGIN_DATA"):
            inside = key
            fields = [] if key == "BEGIN_DATA_FORMAT" else fields
        elif key in ("END_DATA_FORMAT", "END_DATA"):
            inside = ""
        elif inside == "BEGIN_DATA_FORMAT":
            fields += words
        elif inside == "BEGIN_DATA" and words:
            found += _of_set(path, fields, words, row, quantity, scale)
        elif key in ("MEASUREMENT_GEOMETRY", "GEOMETRY") and len(words) > 1:
            quantity = {"45/0": "R_45_0", "45:0": "R_45_0", "0/45": "R_0_45", "0:45": "R_0_45"}.get(words[1])
        elif key == "SPECTRAL_NORM" and len(words) > 1:
            scale = _number(path, words[1], row, key)
            if not scale > 0:
                raise refusal(path, f"is {words[1]}; it must be above 0", row, key)
    if not found:
        raise refusal(path, "has no spectra between BEGIN_DATA and END_DATA")
    return found


def _of_set(path, fields, words, row, quantity, scale) -> list[_Spectrum]:
    if len(words) != len(fields):
        raise refusal(path, f"has {len(words)} values for the {len(fields)} fields of the data format", row)
    waves = [(float(match[1]), k) for k, name in enumerate(fields) if (match := _WAVE.fullmatch(name))]
    if not waves:
        raise refusal(
            path, "has no spectral fields, such as SPECTRAL_NM400; colours alone do not suffice", row
        )
    waves.sort()
    names = tuple(words[k] for key in _KEYS for k, name in enumerate(fields) if name.upper() == key)
    value = np.array([_number(path, words[k], row, fields[k]) for _, k in waves]) / scale
    return [_Spectrum(names or (f"row {row}",), np.array([w for w, _ in waves]), value, row, quantity)]


def _of_cxf(path: Path) -> list[_Spectrum]:
    """Reflectance spectra of the objects of a CxF3 file."""
    content = read_bounded(path, _MOST_BYTES, "file of readings")
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise refusal(path, "declares a document type, which CxF3 does not have")
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as problem:
        raise refusal(path, f"is no valid XML: {problem}") from None
    for element in root.iter():
        element.tag = _NAMESPACE.sub("", str(element.tag))
    specifications = {s.get("Id", ""): s for s in root.iter("ColorSpecification")}
    found = []
    for number, item in enumerate(root.iter("Object"), 1):
        for spectrum in item.iter("ReflectanceSpectrum"):
            specification = specifications.get(spectrum.get("ColorSpecification", ""))
            names = tuple(dict.fromkeys(n for n in (item.get("Id"), item.get("Name")) if n))
            found.append(_of_object(path, number, names, spectrum, specification))
    if not found:
        raise refusal(path, "has no object with a ReflectanceSpectrum")
    return found


def _of_object(path, number, names, spectrum, specification) -> _Spectrum:
    place = f"object {names[0] if names else number}"
    words = (spectrum.text or "").split()
    value = np.array([_number(path, word, number, place) for word in words])
    step = None if specification is None else specification.find(".//WavelengthRange")
    start = spectrum.get("StartWL") or (None if step is None else step.get("StartWL"))
    increment = None if step is None else step.get("Increment")
    if start is None or increment is None or not len(value):
        text = "lacks its values, the first wavelength (StartWL) or the Increment of its WavelengthRange"
        raise refusal(path, text, column=place)
    first, each = (_number(path, text, number, place) for text in (start, increment))
    wave = first + each * np.arange(len(value))
    return _Spectrum(names or (str(number),), wave, value, number, _geometry(specification))


def _geometry(specification) -> str | None:
    """Quantity of a single-angle geometry of the graphic arts; None for any other."""
    if specification is None:
        return None
    single = specification.find(".//SingleAngle")
    if single is None:
        return None
    lit, seen = (single.findtext(f"{name}Angle") or "nan" for name in ("Illumination", "Measurement"))
    try:
        pair = float(lit), float(seen)
    except ValueError:
        return None
    return {(45.0, 0.0): "R_45_0", (0.0, 45.0): "R_0_45"}.get(pair)
