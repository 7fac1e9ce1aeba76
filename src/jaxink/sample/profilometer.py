"""Height maps of profilometers: x3p (ISO 25178-72) and sur (Digital Surf), read by the package surfalize."""

import io
import warnings
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError

SUFFIXES = (".x3p", ".sur")


class MeasuredMap(NamedTuple):
    """Heights in um, nan where none was measured, and their distances in um along y (rows) and along x."""

    heights_um: Float[np.ndarray, "rows columns"]
    pitch_um: tuple[float, float]


def read_profilometer(content: bytes, path: str, suffix: str) -> MeasuredMap:
    """The surface in a file of a profilometer; it is not levelled here.

    Parameters
    ----------
    content
        Content of the file.
    path
        Its name, for messages.
    suffix
        One of `SUFFIXES`.

    Raises
    ------
    InputRefusedError
        If surfalize is not installed, or cannot read the file.
    """
    try:
        # Its import changes the filters of warnings; those are for the user to choose.
        with warnings.catch_warnings():
            from surfalize import Surface
    except ImportError:
        raise InputRefusedError(
            f"{path}: {suffix} files need the package surfalize, which is not installed; run "
            "`pip install 'jaxink[profilometer]'`."
        ) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            surface = Surface.load(io.BytesIO(content), format=suffix)
            heights = np.array(surface.data, float)
            pitch = float(surface.step_y), float(surface.step_x)
    # A damaged file fails in any of the ways of zip, XML, struct and NumPy.
    except Exception as problem:
        why = " ".join(str(problem).split()).rstrip(".") or type(problem).__name__
        raise InputRefusedError(
            f"{path}: is not a {suffix} file of one surface that surfalize can read ({why})."
        ) from None
    if heights.ndim != 2 or not all(np.isfinite(p) and p > 0 for p in pitch):
        raise InputRefusedError(
            f"{path}: states the distances {pitch[0]:g} um along y and {pitch[1]:g} um along x; both must be "
            "above 0."
        )
    return MeasuredMap(heights, pitch)
