"""Regular light in files of Integra's programs (Lumicept): SDR of reflection, SDT of transmission.

Known from the open reader and writer of libbsdf (SdrReader, SdrWriter).
"""

from pathlib import Path

import numpy as np

from jaxink.files.reading import read_bounded
from jaxink.measurement.formats.content import Content, Words
from jaxink.measurement.formats.integra_text import (
    COMMENT,
    channels,
    expect,
    is_integra,
    is_scattered,
    own_origin,
    read_header,
)
from jaxink.measurement.formats.own_files import refuse_other_media
from jaxink.measurement.readings import Readings

_MOST_BYTES = 50_000_000
_QUANTITIES = {".sdr": "R_specular", ".sdt": "T_collimated"}
# Readings have no light along the surface.
_HORIZON_DEG = 90.0 - 1e-9


def is_regular_file(head: str) -> bool:
    """Whether a file starts as one of regular light of Integra's programs."""
    return is_integra(head) and not is_scattered(head)


def read_regular(path: Path, wavelength_nm: float | None = None, quantity: str | None = None) -> Readings:
    """Read regular reflectances or transmittances over the angle of incidence.

    Parameters
    ----------
    path
        The file; its suffix, ``.sdr`` or ``.sdt``, tells reflection from transmission.
    wavelength_nm
        Wavelength of all readings, if the file does not state it.
    quantity
        ``R_specular`` or ``T_collimated``, for another suffix.

    Raises
    ------
    InputRefusedError
        If the file is damaged, or does not state what the caller has to; the message names file and row.
    """
    content = Content(str(path), read_bounded(path, _MOST_BYTES, "file of readings"))
    words = Words(content, comment=COMMENT)
    header = read_header(content, words, ("TypeColorModel", "sigma"))
    own, component = own_origin(content)
    if component is not None:
        refuse_other_media(content, own, component)
    name = _quantity(content, path, quantity)
    if header.words["typecolormodel"] == "rgb":
        raise content.refusal(
            "the values are those of red, green and blue, which are no wavelengths; copy those of one colour "
            "into a file with TypeColorModel BW, and state its wavelength"
        )
    sigma = header.axes["sigma"]
    held = []
    for _, stated_nm in channels(content, words, header):
        expect(content, words, "def")
        values, rows = words.numbers(sigma.size, "a channel")
        expect(content, words, "enddef")
        held.append((_wavelength(content, stated_nm, wavelength_nm), values, rows))
    keep = sigma < _HORIZON_DEG
    notes = ["The file was recognised as one of Integra: regular light over the angle of incidence."]
    if not keep.all():
        notes.append("The values at an incidence of 90 degrees were left out.")
    if not keep.any():
        raise content.refusal("has no value below an incidence of 90 degrees")
    size = len(held) * int(keep.sum())
    return Readings(
        quantity=np.full(size, name),
        theta_i_deg=np.tile(sigma[keep], len(held)),
        theta_o_deg=np.full(size, np.nan),
        phi_deg=np.full(size, np.nan),
        wavelength_nm=np.repeat([nm for nm, _, _ in held], int(keep.sum())),
        value=np.concatenate([values[keep] for _, values, _ in held]),
        row=np.concatenate([rows[keep] for _, _, rows in held]),
        source=path.name,
        notes=tuple(notes),
    )


def _quantity(content: Content, path: Path, stated: str | None) -> str:
    known = _QUANTITIES.get(path.suffix.lower())
    names = tuple(_QUANTITIES.values())
    if stated is not None and stated not in names:
        raise content.refusal(
            f"quantity is {stated!r}; of regular light it must be one of: {', '.join(names)}"
        )
    if known is None and stated is None:
        raise content.refusal(
            "only the suffix .sdr or .sdt tells reflection from transmission, and the file has another one; "
            f"state the quantity, {' or '.join(names)}"
        )
    if None not in (known, stated) and known != stated:
        raise content.refusal(f"quantity is {stated}, but by its suffix the file has {known}; leave it out")
    return known or str(stated)


def _wavelength(content: Content, in_file_nm: float, stated_nm: float | None) -> float:
    if np.isnan(in_file_nm):
        if stated_nm is None:
            raise content.refusal("has no wavelength, only values of one channel; state it as wavelength_nm")
        return stated_nm
    if stated_nm is not None:
        raise content.refusal("has wavelengths of its own; do not state wavelength_nm")
    return in_file_nm
