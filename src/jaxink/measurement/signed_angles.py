"""Polar angles with a sign, converted to directions with an azimuth."""

from collections.abc import Mapping

import numpy as np

from jaxink.measurement.table import TextTable


def unsigned_directions(
    table: TextTable, angles: Mapping[str, np.ndarray], derived: bool, notes: list[str]
) -> dict[str, np.ndarray]:
    """Polar angle of view from 0, and azimuth turned by 180 degrees where the angle was negative.

    Parameters
    ----------
    table
        The table, for row numbers.
    angles
        ``theta_o_deg`` with its sign; ``phi_deg`` in (-180, 180].
    derived
        Whether the table has no column ``phi_deg``.
    notes
        Collects sentences on what was changed.
    """
    theta, phi = angles["theta_o_deg"], angles["phi_deg"]
    negative = theta < 0
    turned = np.where(phi > 0, phi - 180, phi + 180)
    if derived:
        notes.append(
            "The file has no column phi_deg; it is 180 degrees (towards the peak) at positive theta_o_deg "
            "and 0 (towards the source) at negative."
        )
    if negative.any():
        first = table.lines[np.argmax(negative)]
        what = "" if derived else " with phi_deg turned by 180 degrees"
        notes.append(
            f"{int(negative.sum())} negative values of theta_o_deg (first in row {first}) were read as "
            f"positive{what}, as requested by the caller."
        )
    return {"theta_o_deg": np.abs(theta), "phi_deg": np.where(negative, turned, phi)}
