"""Batches of paths, kept as they finish, so that a rendering that was stopped goes on."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError, require_number
from jaxink.files.reading import shown_path
from jaxink.files.writing import written_whole
from jaxink.numerics.progress import Progress, StepOf

FOLDER, PLAN = "batches", "plan.json"
_FEWEST = 2


class Estimate(NamedTuple):
    """Mean of batches and its standard error; arrays of the same shape."""

    value: Float[np.ndarray, "..."]
    error: Float[np.ndarray, "..."]

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {"value": self.value.tolist(), "standard_error": self.error.tolist()}


class Kept:
    """Batches of one rendering in a folder.

    Parameters
    ----------
    out
        Folder of the rendering; the batches are in a folder of their own in it.
    plan
        What the batches depend on, as plain data; of a folder with other batches it must be the same.

    Raises
    ------
    InputRefusedError
        If the folder contains batches of another rendering.
    """

    def __init__(self, out: Path, plan: dict[str, Any]):
        self._folder = out / FOLDER
        file = self._folder / PLAN
        text = json.dumps(plan, indent=1, sort_keys=True) + "\n"
        # A rendering that was stopped before its first batch has left nothing to be mixed with.
        if any(self._folder.glob("*.npy")) and file.exists():
            if file.read_text(encoding="utf-8") != text:
                raise InputRefusedError(
                    f"{shown_path(self._folder)}: contains batches of another rendering (other ink, scene, "
                    "seed or numbers); name another folder (--out), or delete this one."
                )
        else:
            self._folder.mkdir(parents=True, exist_ok=True)
            with written_whole(file) as new:
                new.write_text(text, encoding="utf-8")

    def batch(self, name: str, make: Callable[[], Float[np.ndarray, "..."]]) -> Float[np.ndarray, "..."]:
        """A batch, made only if it is not there."""
        file = self._folder / f"{name}.npy"
        if file.exists():
            return np.load(file)
        made = make()
        with written_whole(file) as new, new.open("wb") as stream:
            np.save(stream, made)
        return made


def batches_of(
    kept: Kept,
    name: str,
    n: int,
    make: Callable[[int], Float[np.ndarray, "..."]],
    follow: Progress,
    what: str,
) -> Float[np.ndarray, "batches ..."]:
    """So many batches, each from its number; ``follow`` is told each one as a step of ``what``."""
    found = []
    for k in range(n):
        found.append(kept.batch(f"{name}-{k:03d}", partial(make, k)))
        follow(what, StepOf(k + 1, n), float("nan"))
    return np.stack(found)


def require_counts(options: Any, **least: int) -> None:
    """Reject fields of ``options`` that are no numbers, or below the least of each."""
    for name, lowest in least.items():
        count = getattr(options, name)
        require_number(name, count)
        if count < lowest:
            raise InputRefusedError(f"{name} is {count}; it must be at least {lowest}.")


def estimate(batches: Float[np.ndarray, "batches ..."]) -> Estimate:
    """Mean over the first axis, and its standard error from the scatter of the batches."""
    n = len(batches)
    if n < _FEWEST:
        raise InputRefusedError(f"there is {n} batch; a standard error needs at least {_FEWEST} (--batches).")
    return Estimate(batches.mean(axis=0), batches.std(axis=0, ddof=1) / np.sqrt(n))


def jackknife(batches: Float[np.ndarray, "batches ..."], of: Callable[[np.ndarray], Any]) -> Estimate:
    """A function of the mean of the batches, and its error from leaving out each batch in turn."""
    n, total = len(batches), batches.sum(axis=0)
    without = np.array([of((total - one) / (n - 1)) for one in batches])
    spread = np.sum((without - without.mean(axis=0)) ** 2, axis=0)
    return Estimate(np.asarray(of(total / n)), np.sqrt((n - 1) / n * spread))


def ratio_less_one(one: Estimate, other: Estimate) -> Estimate:
    """Relative difference of two independent estimates."""
    ratio = one.value / other.value
    relative = np.hypot(one.error / one.value, other.error / other.value)
    return Estimate(np.asarray(ratio - 1), np.asarray(ratio * relative))
