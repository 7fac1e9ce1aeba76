"""Whether readings of equal directions, of joined files or within one file, can be of one sample."""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from jaxink.errors import InputRefusedError
from jaxink.measurement.dataset import FILE_COLUMN, GonioData
from jaxink.measurement.pairs import direction_groups

# Remounting a sample changes a BSDF by a few per cent at most (of one reading, the difference over sqrt(2)).
UNLIKE = 0.03
# So many directions in common, and an offset of so many standard errors, are no accident.
_FEWEST, _STANDARD_ERRORS = 5, 5.0
# Repeats within a file are seldom of different samples, and there may be many: more directions must tell.
_FEWEST_REPEATS = 10
_ORDINALS = ("first", "second", "third", "fourth", "fifth")
_MOST_REPEATS = len(_ORDINALS)
_REMEDY = (
    "Fit different samples one by one (of one file, by --rows COLUMN=VALUE); if it is the same, state as "
    "relative in [noise] how well its readings reproduce"
)


class _Series(NamedTuple):
    """Readings that may be of one sample, or not: points, and what messages call them."""

    points: Int[np.ndarray, " points"]
    words: str


def refuse_other_samples(data: GonioData, remedy: str = _REMEDY, within_files: bool = True) -> None:
    """Refuse readings of which one series is consistently larger than another one, in the same directions.

    The series are joined files, and within each file the first readings of the directions, the second ones,
    and so on. Each side and wavelength is looked at by itself: a thicker ink reflects more and transmits
    less. Of readings with standard deviations, the offset must exceed these, too.

    Parameters
    ----------
    data
        The measurement.
    remedy
        Last sentence of the message.
    within_files
        Whether readings of one file are compared, too.

    Raises
    ------
    InputRefusedError
        The message names the two series, the side and wavelength, the factor, and two such readings.
    """
    group, worst = direction_groups(data), None
    for first, second, fewest in _compared(data, group, within_files):
        pairs = _pairs(first.points, second.points, group)
        if not pairs.size:
            continue
        kinds = np.stack([data.is_transmission[pairs[:, 0]], data.wavelength_nm[pairs[:, 0]]], axis=1)
        for kind in np.unique(kinds, axis=0):
            same = pairs[(kinds == kind).all(axis=1)]
            offset = _offset(data, same, fewest)
            if offset is not None and (worst is None or abs(offset) > abs(worst[0])):
                worst = offset, same, first.words, second.words
    if worst is None:
        return
    offset, pairs, first_words, second_words = worst
    ratio = np.log(data.bsdf_per_sr[pairs[:, 1]] / data.bsdf_per_sr[pairs[:, 0]])
    a, b = pairs[int(np.argmax(np.abs(ratio)))].tolist()
    side, nm = data.side[a], data.wavelength_nm[a]
    raise InputRefusedError(
        f"{data.source or 'the measurement'}: in {len(pairs)} directions of {side} at {nm:g} nm, the "
        f"{second_words} are {np.exp(offset):.3g} times {first_words} (most of all {data.place(a)} and "
        f"{data.place(b)}: {data.bsdf_per_sr[a]:.4g} and {data.bsdf_per_sr[b]:.4g} /sr); is it the same "
        f"sample, with the same thickness? {remedy}."
    )


def _compared(
    data: GonioData, group: Int[np.ndarray, " points"], within_files: bool
) -> Iterator[tuple[_Series, _Series, int]]:
    """Pairs of series, and the fewest directions in common that tell them apart."""
    here = np.flatnonzero(data.used & (data.bsdf_per_sr > 0))
    if FILE_COLUMN in data.extra:
        names = list(dict.fromkeys(data.extra[FILE_COLUMN].tolist()))
        files = [here[data.file_index[here] == k] for k in range(len(names))]
        for first, second in combinations(range(len(names)), 2):
            of_first = _Series(files[first], f"those of {names[first]}")
            yield of_first, _Series(files[second], f"readings of {names[second]}"), _FEWEST
    else:
        files = [here]
    for points in files if within_files else ():
        number = _numbers_of_repeats(group[points])
        of_first = _Series(points[number == 0], "the first ones")
        for k in range(1, min(int(number.max(initial=0)) + 1, _MOST_REPEATS)):
            yield of_first, _Series(points[number == k], f"{_ORDINALS[k]} readings"), _FEWEST_REPEATS


def _numbers_of_repeats(group: Int[np.ndarray, " points"]) -> Int[np.ndarray, " points"]:
    """How many readings of its direction come before each one."""
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order], prepend=-1))
    number = np.empty(group.size, int)
    number[order] = np.arange(group.size) - np.repeat(starts, np.diff([*starts, group.size]))
    return number


def _pairs(
    first: Int[np.ndarray, " a"], second: Int[np.ndarray, " b"], group: Int[np.ndarray, " points"]
) -> Int[np.ndarray, "pairs 2"]:
    """A point of each of two series for each direction that both have."""
    _, i, j = np.intersect1d(group[first], group[second], return_indices=True)
    return np.stack([first[i], second[j]], axis=1)


def _offset(data: GonioData, pairs: Int[np.ndarray, "pairs 2"], fewest: int) -> float | None:
    """Mean logarithm of the ratio of the readings, if it is beyond what readings of one sample differ."""
    if len(pairs) < fewest:
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
