"""What the caller states because an exchange file does not."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError, shown
from jaxink.measurement.columns import OPTIONS
from jaxink.measurement.table import refusal

# How to state each, on the command line and in Python.
STATED_BY = {
    "wavelength_nm": OPTIONS["wavelength_nm"],
    "side": "--side R or --side T (in Python: side='R' or side='T')",
    "face": "--face front or --face back (in Python: face='front' or face='back')",
    "channel": "--channel NAME (in Python: channel='NAME')",
    "rotation_deg": "--rotation-deg DEG (in Python: rotation_deg=DEG)",
    "angle_unit": "--angle-unit deg or --angle-unit rad (in Python: angle_unit='deg' or angle_unit='rad')",
    "theta_i_deg": OPTIONS["theta_i_deg"],
    "specular_phi_deg": "--specular-phi-deg DEG (in Python: specular_phi_deg=DEG)",
    "cosine_weighted": "--cosine-weighted or --no-cosine-weighted (in Python: "
    "cosine_weighted=True or cosine_weighted=False)",
    "scale": "--scale X (in Python: scale=X)",
    "every": "--every N (in Python: every=N)",
}
_WORDS = {
    "side": ("R", "T"),
    "face": ("front", "back"),
    "angle_unit": ("deg", "rad"),
}
_NUMBERS = {"wavelength_nm", "rotation_deg", "theta_i_deg", "specular_phi_deg", "scale"}


@dataclass(frozen=True)
class ExchangeOptions:
    """What the caller states about an exchange file; None if nothing.

    Parameters
    ----------
    wavelength_nm
        Wavelength, if the file does not state it or holds a spectrum apart from its values; otherwise the one
        to read.
    side
        ``"R"`` or ``"T"``, if the file does not state it; otherwise the one to read.
    face
        ``"front"`` or ``"back"``: the face that the light meets, if the file has both.
    channel
        Colour channel to read, if the values are colours.
    rotation_deg
        Rotation of the sample to read, if the file has several.
    angle_unit
        ``"deg"`` or ``"rad"``.
    theta_i_deg
        Angle of incidence.
    specular_phi_deg
        Azimuth of the specular or undeviated direction.
    cosine_weighted
        Whether the values are the BSDF times cos(theta_o).
    scale
        Factor that makes the values BSDFs in 1/sr, or these times the cosine.
    every
        Read every n-th angle of each axis only.
    """

    wavelength_nm: float | None = None
    side: str | None = None
    face: str | None = None
    channel: str | None = None
    rotation_deg: float | None = None
    angle_unit: str | None = None
    theta_i_deg: float | None = None
    specular_phi_deg: float | None = None
    cosine_weighted: bool | None = None
    scale: float | None = None
    every: int | None = None


def choices_of(source: str, title: str, takes: Collection[str], given: Mapping[str, Any]) -> ExchangeOptions:
    """The choices, checked against what a format takes.

    Raises
    ------
    InputRefusedError
        If one of them has no meaning for the format, or is not a possible value.
    """
    stated: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    for name in stated:
        if name not in takes:
            option = STATED_BY.get(name, name).partition(" ")[0]
            raise refusal(source, f"is {title}, for which {option} has no meaning; leave it out")
    for name, words in _WORDS.items():
        if name in stated and stated[name] not in words:
            raise refusal(source, f"{name} is {stated[name]!r}; it must be one of: {', '.join(words)}")
    for name in _NUMBERS & stated.keys():
        value = stated[name]
        if not isinstance(value, int | float | np.number) or not abs(float(value)) < 1e6:
            raise refusal(source, f"{name} is {shown(value)}; it must be a number")
        stated[name] = float(value)
    every = stated.get("every", 1)
    if not (isinstance(every, int) and every >= 1):
        raise refusal(source, f"every is {shown(every)}; it must be a whole number of at least 1")
    return ExchangeOptions(**stated)


def ask(source: str, name: str, why: str, row: int | None = None) -> InputRefusedError:
    """Error that says what the file does not state, and how to state it."""
    return refusal(source, f"{why}; state it: {STATED_BY[name]}", row)


def required(source: str, choices: ExchangeOptions, name: str, why: str, row: int | None = None) -> Any:
    """What the caller states; if nothing, the error of `ask`."""
    value = getattr(choices, name)
    if value is None:
        raise ask(source, name, why, row)
    return value
