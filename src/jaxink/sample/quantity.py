"""Kinds of keys of a sample file, with their meanings for the documentation."""

import dataclasses


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
