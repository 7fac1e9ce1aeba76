"""Kinds of keys that a sample file has; what they mean is declared with them, for the documentation."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Quantity:
    """One number of the file.

    Parameters
    ----------
    unit
        Unit, empty for a pure number.
    lowest, highest
        What physics allows, inclusive.
    default
        Value if the file is silent; None: there is no number then.
    scale, multimodal
        Of a parameter, for fits, see `Parameter`.
    dispersive
        Whether it may be given as a dispersion, see `DISPERSIONS`.
    otherwise
        What holds without a default, in words.
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
    meaning: str = dataclasses.field(kw_only=True)


@dataclasses.dataclass(frozen=True)
class Entry:
    """One key of the file that is no single number, for the documentation.

    Parameters
    ----------
    values
        What it may be.
    default
        What holds if the file is silent.
    meaning
        What it says.
    """

    values: str
    default: str
    meaning: str


def quoted(words: tuple[str, ...]) -> str:
    """Words as a file writes them, one or the other."""
    return " or ".join(f'`"{word}"`' for word in words)
