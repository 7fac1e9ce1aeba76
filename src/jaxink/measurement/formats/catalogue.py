"""The exchange formats that are read, each recognised by its content."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from jaxink.files.reading import read_bounded
from jaxink.measurement.dataset import GonioData
from jaxink.measurement.formats import astm, integra, lighttools, merl, mountain, reflet, rgl, speos, zemax
from jaxink.measurement.formats.content import Content
from jaxink.measurement.formats.exchange_options import ExchangeOptions, choices_of
from jaxink.measurement.formats.points import FilePoints, measurement

# So much of a file decides.
HEAD_BYTES = 1 << 16


class ExchangeFormat(NamedTuple):
    """A format of instruments or ray tracers.

    Parameters
    ----------
    title
        Name in messages, after "is".
    recognises
        Whether a file with this beginning, each byte of which is one character, has the format.
    read
        Points of the content; sentences on what was changed are added to the list.
    takes
        Fields of `ExchangeOptions` that mean something for it.
    most_bytes
        Largest file.
    """

    title: str
    recognises: Callable[[str], bool]
    read: Callable[[Content, ExchangeOptions, list[str]], FilePoints]
    takes: tuple[str, ...]
    most_bytes: int = 100_000_000


FORMATS = (
    ExchangeFormat(
        "a BSDF file of Zemax OpticStudio",
        zemax.recognises,
        zemax.read,
        ("wavelength_nm", "side", "channel", "rotation_deg", "cosine_weighted"),
    ),
    ExchangeFormat(
        "a BSDF file of LightTools",
        lighttools.recognises,
        lighttools.read,
        ("wavelength_nm", "side", "face", "channel", "rotation_deg", "specular_phi_deg", "cosine_weighted"),
    ),
    ExchangeFormat(
        "an anisotropic BSDF file of Speos",
        speos.recognises_anisotropic,
        speos.read_anisotropic,
        ("wavelength_nm", "side", "rotation_deg", "cosine_weighted"),
    ),
    ExchangeFormat(
        "a BRDF file of Speos",
        speos.recognises_brdf,
        speos.read_brdf,
        ("wavelength_nm", "side", "cosine_weighted"),
    ),
    ExchangeFormat(
        "a BSDF file of Integra",
        integra.recognises,
        integra.read,
        ("wavelength_nm", "side", "channel", "rotation_deg"),
    ),
    ExchangeFormat(
        "a text file in the layout of ASTM E1392",
        astm.recognises,
        astm.read,
        ("wavelength_nm", "side", "channel", "angle_unit", "cosine_weighted"),
    ),
    ExchangeFormat(
        "a text file of pab-opto's goniophotometer",
        mountain.recognises,
        mountain.read,
        ("wavelength_nm", "side", "face", "channel", "cosine_weighted"),
    ),
    ExchangeFormat(
        "a text file of Light Tec's goniometer REFLET",
        reflet.recognises,
        reflet.read,
        ("wavelength_nm", "side", "theta_i_deg", "specular_phi_deg", "scale", "cosine_weighted"),
    ),
    ExchangeFormat(
        "a binary file of the MERL database",
        merl.recognises,
        merl.read,
        ("wavelength_nm", "side", "channel", "every"),
    ),
    ExchangeFormat(
        "a tensor file of the EPFL RGL database",
        rgl.recognises,
        rgl.read,
        ("wavelength_nm", "side", "channel", "rotation_deg", "every"),
        500_000_000,
    ),
)


def format_of(head: bytes) -> ExchangeFormat | None:
    """The format of a file with this beginning; None if it is none of these."""
    text = head[:HEAD_BYTES].decode("latin-1")
    return next((each for each in FORMATS if each.recognises(text)), None)


def read_exchange(path: Path, found: ExchangeFormat, stated: dict[str, Any]) -> GonioData:
    """Read a file of one of the formats.

    Parameters
    ----------
    path
        The file.
    found
        Its format.
    stated
        What the caller states, by the fields of `ExchangeOptions`.

    Raises
    ------
    InputRefusedError
        If the file is damaged, or does not state what the caller has to; the message names file and row.
    """
    choices = choices_of(str(path), found.title, found.takes, stated)
    content = Content(str(path), read_bounded(path, found.most_bytes, "measurement file"))
    notes = [f"The file was recognised as {found.title}."]
    points = found.read(content, choices, notes)
    return measurement(points, str(path), choices, notes)
