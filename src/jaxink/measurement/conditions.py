"""Rows with equal directions that differ in another column: repeats, or several conditions in one file.

Repeated values of a direction measure the noise only if nothing else was changed. Another column is either a
record (a time, a run number, a remark) or a condition (the illuminated side, the polarisation). Its name
decides if it contains one of the words below. Otherwise its values decide: a condition has the same few
values again and again, that is, the same set of values at most of the directions where the column varies.
Readings scatter instead, and integers from 1 count the repeats.
"""

import re
from collections import Counter

import numpy as np
from jaxtyping import Int

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.pairs import stated_groups
from jaxink.measurement.records import names_a_record
from jaxink.measurement.rows import IN_A_PROJECT, condition_of
from jaxink.measurement.table import refusal

_CONDITIONS = {"lit", "illuminated", "polarisation", "polarization", "polariser", "polarizer"}


def refuse_several_conditions(data: GonioData, source: str = "") -> None:
    """Reject a file in which rows with equal directions were measured under different conditions.

    The message names the file (``source``, or as in the data), the column, two such rows and their values.
    """
    group = stated_groups(data)
    if np.unique(group).size == group.size:
        return
    for name, values in data.extra.items():
        pair = _pair(name, values, group)
        if pair is None:
            continue
        values_there = values[list(pair)].tolist()
        first, second = map(_shown, values_there)
        raise refusal(
            f"{source or data.source}, {data.place(pair[1])}",
            f"the cell is {second}, but {first} in {data.place(pair[0])}, at equal angles, wavelength and "
            f"side; the conditions differ, so {_remedy(name, values_there[1])}, or name the column 'repeat' "
            "if these are repeats",
            column=name,
        )


def _remedy(name: str, value: str | float) -> str:
    """What to do with the rows of several conditions: a project knows what some of them change."""
    cell = repr(value) if isinstance(value, str) else "''" if value != value else f"{value:.15g}"
    bare = cell.strip("'")
    one = f'keep the rows of one: --rows "{name}={bare}" (in Python: rows={{{name!r}: {cell}}})'
    return one if condition_of(name) is None else f"{IN_A_PROJECT}, {one}"


def _shown(value: str | float) -> str:
    if value == "" or value != value:
        return "empty"
    return f"'{value}'" if isinstance(value, str) else f"{value:g}"


def _pair(name: str, values: np.ndarray, group: Int[np.ndarray, " points"]) -> tuple[int, int] | None:
    """Two rows of one direction that differ in a condition."""
    words = set(re.split(r"[^a-z]+", name.lower()))
    if names_a_record(name):
        return None
    held, label = np.unique(values, return_inverse=True)
    label = label.reshape(-1)
    differing = _differing(group, label)
    if not differing:
        return None
    if not words & _CONDITIONS:
        taken = [frozenset(label[rows].tolist()) for rows in differing]
        usual, count = Counter(taken).most_common(1)[0]
        is_counter = values.dtype.kind == "f" and np.array_equal(held, np.arange(1, held.size + 1))
        if is_counter or count < max(2, len(taken) / 2):
            return None
        differing = [rows for rows, here in zip(differing, taken, strict=True) if here == usual]
    rows = min(differing, key=lambda rows: rows[0])
    return int(rows[0]), int(rows[np.argmax(label[rows] != label[rows[0]])])


def _differing(group, label) -> list[np.ndarray]:
    """Rows, in ascending order, of each group with more than one label."""
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order], prepend=-1))
    several = np.maximum.reduceat(label[order], starts) > np.minimum.reduceat(label[order], starts)
    ends = np.append(starts[1:], order.size)
    return [order[a:b] for a, b in zip(starts[several], ends[several], strict=True)]
