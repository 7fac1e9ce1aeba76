"""What is read of a file that holds several measurements: one rotation of the sample, one channel."""

from collections.abc import Collection, Sequence

from jaxink.measurement.formats.content import Content
from jaxink.measurement.formats.exchange_options import ExchangeOptions, ask

_SAME_DEG = 1e-6


def chosen_rotation(
    content: Content, choices: ExchangeOptions, rotations_deg: Sequence[float], words: str
) -> int:
    """Position of the rotation of the sample to read.

    Parameters
    ----------
    content, choices
        The file, and what the caller states.
    rotations_deg
        Those in the file.
    words
        What they are, with ``{}`` in their place.

    Raises
    ------
    InputRefusedError
        There are several and none is stated, or not the stated one.
    """
    listed = ", ".join(f"{angle:g}" for angle in rotations_deg)
    wanted = choices.rotation_deg
    if wanted is None:
        if len(rotations_deg) > 1:
            why = f"{words.format(listed)}, of which one is read"
            raise ask(content.source, "rotation_deg", why)
        return 0
    found = (k for k, angle in enumerate(rotations_deg) if abs(angle - wanted) < _SAME_DEG)
    position = next(found, None)
    if position is None:
        raise content.refusal(f"rotation_deg is {wanted:g}; the file has {listed}")
    return position


def chosen_tristimulus(
    content: Content,
    choices: ExchangeOptions,
    channels: Collection[str],
    words: tuple[str, str],
    notes: list[str],
) -> str:
    """The tristimulus to read.

    Parameters
    ----------
    content, choices
        The file, and what the caller states.
    channels
        Those in the file, in capitals.
    words
        What the values are, if none is stated, and what the stated one must be.
    notes
        Takes note of the channel.

    Raises
    ------
    InputRefusedError
        None is stated, or not one of these.
    """
    if choices.channel is None:
        raise ask(content.source, "channel", f"{words[0]}, of which one is read")
    wanted = choices.channel.upper()
    if wanted not in channels:
        raise content.refusal(f"channel is {choices.channel!r}; {words[1]}")
    notes.append(f"The values are those of the tristimulus {wanted}.")
    return wanted
