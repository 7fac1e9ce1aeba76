"""The relative azimuth, from the azimuths of incidence and of view."""

from collections.abc import Mapping

import numpy as np

from jaxink.measurement import checks
from jaxink.measurement.table import TextTable, refusal

_SAME_DEG = 1e-3
_LARGEST_DEG = 360.0


def relative_azimuths(
    table: TextTable, known: Mapping[str, int], phi_deg: np.ndarray | None, notes: list[str]
) -> dict[str, np.ndarray]:
    """``phi_deg`` where a table has an azimuth of incidence; otherwise nothing.

    Parameters
    ----------
    table, known
        The table, and the position of its known columns.
    phi_deg
        The column ``phi_deg`` if there is one: it is then the relative azimuth only if the azimuth of
        incidence is 0, or if all three agree.
    notes
        Collects sentences on what was computed.
    """
    if "phi_i_deg" not in known:
        return {}
    source = _azimuth(table, known, "phi_i_deg")
    view = _azimuth(table, known, "phi_o_deg") if "phi_o_deg" in known else None
    named = {name: f"'{table.names[known[name]]}'" for name in ("phi_i_deg", "phi_o_deg") if name in known}
    if phi_deg is not None:
        wrong = _turned(source) if view is None else _turned(phi_deg - view + source)
        if wrong.any():
            line = table.lines[np.argmax(wrong)]
            text = (
                f"the azimuth of incidence {named['phi_i_deg']} is not 0, so it is open whether phi_deg is "
                "measured from the source; if it is not, name it phi_o_deg, and phi_deg is phi_o_deg - "
                f"phi_i_deg; if it is, remove {named['phi_i_deg']}"
            )
            raise refusal(table.source, text, line, "phi_deg")
        return {}
    if view is None:
        # The caller says that polar angles have a sign.
        return {}
    notes.append(
        f"phi_deg is {named['phi_o_deg']} minus {named['phi_i_deg']}, the azimuth of the direction towards "
        "the source."
    )
    turned = np.round(np.mod(view - source, 360.0), 9) % 360
    return {"phi_deg": np.where(turned > 180, turned - 360, turned)}


def _azimuth(table: TextTable, known: Mapping[str, int], name: str) -> np.ndarray:
    values = checks.numbers(table, known[name], name)
    bad = np.flatnonzero(np.abs(values) > _LARGEST_DEG)
    if bad.size:
        text = f"{values[bad[0]]:g} is outside the range -360 to 360 degrees"
        raise refusal(table.source, text, table.lines[bad[0]], name)
    return values


def _turned(difference_deg: np.ndarray) -> np.ndarray:
    """True where azimuths are not equal."""
    return np.abs((difference_deg + 180) % 360 - 180) > _SAME_DEG
