"""Whether files that were joined can be readings of one sample: their readings of equal directions agree."""

from itertools import combinations

import numpy as np
from jaxtyping import Float, Int

from jaxink.errors import InputRefusedError
from jaxink.measurement.dataset import FILE_COLUMN, GonioData
from jaxink.measurement.pairs import direction_groups

# Remounting a sample changes a BSDF by a few per cent at most (of one reading, the difference over sqrt(2)).
UNLIKE = 0.03
# So many directions in common, and an offset of so many standard errors, are no accident.
_FEWEST, _STANDARD_ERRORS = 5, 5.0
_REMEDY = (
    "Fit different samples one by one; if it is the same, state as relative in [noise] how well its readings "
    "reproduce"
)


def refuse_other_samples(data: GonioData, remedy: str = _REMEDY) -> None:
    """Refuse joined files of which one reads consistently more than another one, in the same directions.

    Each side and wavelength is looked at by itself: a thicker ink reflects more and transmits less. Of files
    with standard deviations, the offset must exceed these, too.

    Parameters
    ----------
    data
        The measurement; one that was not joined passes.
    remedy
        Last sentence of the message.

    Raises
    ------
    InputRefusedError
        The message names the two files, the side and wavelength, the factor, and two such readings.
    """
    if FILE_COLUMN not in data.extra:
        return
    file, names = data.file_index, list(dict.fromkeys(data.extra[FILE_COLUMN].tolist()))
    here = np.flatnonzero(data.used & (data.bsdf_per_sr > 0))
    group, worst = direction_groups(data), None
    for first, second in combinations(np.unique(file[here]).tolist(), 2):
        pairs = _pairs(here[file[here] == first], here[file[here] == second], group)
        if not pairs.size:
            continue
        kinds = np.stack([data.is_transmission[pairs[:, 0]], data.wavelength_nm[pairs[:, 0]]], axis=1)
        for kind in np.unique(kinds, axis=0):
            same = pairs[(kinds == kind).all(axis=1)]
            offset = _offset(data, same)
            if offset is not None and (worst is None or abs(offset) > abs(worst[0])):
                worst = offset, same
    if worst is None:
        return
    offset, pairs = worst
    ratio = np.log(data.bsdf_per_sr[pairs[:, 1]] / data.bsdf_per_sr[pairs[:, 0]])
    a, b = pairs[int(np.argmax(np.abs(ratio)))].tolist()
    side, nm = data.side[a], data.wavelength_nm[a]
    raise InputRefusedError(
        f"{data.source or 'the measurement'}: in {len(pairs)} directions of {side} at {nm:g} nm, the "
        f"readings of {names[file[b]]} are {np.exp(offset):.3g} times those of {names[file[a]]} (most of "
        f"all {data.place(a)} and {data.place(b)}: {data.bsdf_per_sr[a]:.4g} and {data.bsdf_per_sr[b]:.4g} "
        f"/sr); is it the same sample, with the same thickness? {remedy}."
    )


def _pairs(
    first: Int[np.ndarray, " a"], second: Int[np.ndarray, " b"], group: Int[np.ndarray, " points"]
) -> Int[np.ndarray, "pairs 2"]:
    """A point of each of two files for each direction that both have."""
    _, i, j = np.intersect1d(group[first], group[second], return_indices=True)
    return np.stack([first[i], second[j]], axis=1)


def _offset(data: GonioData, pairs: Int[np.ndarray, "pairs 2"]) -> float | None:
    """Mean logarithm of the ratio of the readings, if it is beyond what readings of one sample differ."""
    if len(pairs) < _FEWEST:
        return None
    values: Float[np.ndarray, "pairs 2"] = data.bsdf_per_sr[pairs]
    ratio = np.log(values[:, 1] / values[:, 0])
    mean = float(ratio.mean())
    error = float(ratio.std(ddof=1)) / np.sqrt(len(pairs))
    if abs(mean) < UNLIKE * np.sqrt(2) or abs(mean) < _STANDARD_ERRORS * error:
        return None
    if data.sigma_per_sr is not None:
        relative = data.sigma_per_sr[pairs] / values
        if abs(mean) < _STANDARD_ERRORS * float(np.sqrt((relative**2).sum(axis=1).mean())):
            return None
    return mean
