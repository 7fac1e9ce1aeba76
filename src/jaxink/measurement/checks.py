"""Checks of the units and ranges of the columns; an invalid value is rejected with its row and column."""

import math
import re

import numpy as np

from jaxink.measurement.columns import ANGLES
from jaxink.measurement.masks import ZERO, angular_distance_deg
from jaxink.measurement.names import SIDES
from jaxink.measurement.table import TextTable, is_number, refusal

_THOUSANDS = re.compile(r"[+-]?\d{1,3}([., '’]\d{3})+([.,]\d*)?")
_DASHES = str.maketrans(dict.fromkeys("\N{EN DASH}\N{EM DASH}\N{HYPHEN}\N{NON-BREAKING HYPHEN}", "-"))
# Exponents as Fortran writes them, or after a space.
_EXPONENT = re.compile(r"\s*[dDeE]\s*(?=[-+]?\d+$)")
_WITH_UNIT = re.compile(r"([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s.,;+-]{1,6})")
# Marks of missing values: the least ones, how far they are above the values around, and how many of those.
_LEAST_MARK, _LEAST_POWER, _FAR_ABOVE, _AROUND = 99.0, 1000.0, 10.0, 4
# A specular peak: around its direction, far above what is seen elsewhere.
_OBLIQUE_DEG, _PEAK_DEG, _PEAK = 5.0, 6.0, 3.0
WAVELENGTH_RANGE_NM = (100.0, 20000.0)
_LARGEST_AZIMUTH_DEG = 1080.0
# All of the incident light within 1e-8 sr, half an angle of 0.003 degrees: by diffraction, a beam of visible
# light 1 cm wide spreads over as much. Specular peaks of laser goniometers reach 1e5 to 1e6 per sr.
LARGEST_PER_SR = 1e8
# Squares and quotients of larger values do not overflow.
_SMALLEST_PER_SR = 1e-100
# Around the source, where the detector may shade the beam.
_SHADOW_DEG = 10.0


def numbers(table: TextTable, index: int, name: str) -> np.ndarray:
    """Values of a numeric column, every cell of which must be a finite number."""
    values, cells = [], table.column(index)
    for line, cell in zip(table.lines, cells, strict=True):
        if not cell:
            n_empty = cells.count("")
            more = f" (the first of {n_empty} in this column)" if n_empty > 1 else ""
            # Written once above the rows that it is for: which these are, only the author knows.
            is_once = cells[0] and n_empty > len(cells) / 2
            remedy = "write the value in every row that it is for" if is_once else "fill it or remove the row"
            text = f"the cell is empty{more}; it must be a number, so {remedy}"
            raise refusal(table.source, text, line, name)
        try:
            # float() reads "1_0" as 10, which in a measurement file is a typing error.
            value = float(cell) if "_" not in cell else None
        except ValueError:
            value = None
        if value is None:
            remedy = _number_remedy(cell)
            raise refusal(table.source, f"'{cell}' is not a number; {remedy}", line, name)
        if not math.isfinite(value):
            raise refusal(table.source, f"'{cell}' is not finite; remove the row", line, name)
        values.append(value)
    return np.array(values)


def _number_remedy(cell: str) -> str:
    """What to do with a cell that is not a number."""
    if _THOUSANDS.fullmatch(cell):
        return "write it without separators of thousands"
    if is_number(plain := cell.translate(_DASHES)) and plain != cell:
        return f"its sign is a dash; write {plain}"
    if is_number(plain := _EXPONENT.sub("e", cell)) and plain != cell:
        return f"write {plain}"
    if (found := _WITH_UNIT.fullmatch(cell)) is not None:
        return f"write {found[1]}, and '{found[2]}' in the name of the column"
    return "correct it, or remove the row if nothing was measured"


def refuse_marks(
    table: TextTable, directions: tuple[np.ndarray, ...], bsdf: np.ndarray, divided: np.ndarray | float
) -> None:
    """Reject values such as 9999 or 65535 far above those around them: instruments mark gaps by them."""
    written = bsdf * divided
    marks = np.zeros(written.size, bool)
    for k in np.flatnonzero(written >= _LEAST_MARK):
        marks[k] = _is_mark(written[k])
    if not marks.any() or marks.all():
        return
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission = directions
    scan = np.column_stack([theta_i_deg, wavelength_nm, is_transmission])
    found = []
    for k in np.flatnonzero(marks):
        same = np.flatnonzero(~marks & (scan == scan[k]).all(axis=1))
        there = np.full(same.size, theta_o_deg[k])
        apart = angular_distance_deg(theta_o_deg[same], phi_deg[same], there, float(phi_deg[k]))
        near = written[same[np.argsort(apart, kind="stable")[:_AROUND]]] if same.size else written[~marks]
        if written[k] > _FAR_ABOVE * np.max(near):
            found.append((k, np.max(near)))
    if found:
        k, largest = found[0]
        n = "" if len(found) == 1 else f" ({len(found)} such rows)"
        what = "empty the cell" if table.is_matrix else f"remove the row{n}"
        text = (
            f"{written[k]:g} is a mark of a missing value, as the values around it do not exceed "
            f"{largest:g}; {what}, or write {written[k] * (1 + 1e-5):.7g} if it was measured"
        )
        raise refusal(table.source, text, table.lines[k], "bsdf_per_sr")


def _is_mark(value: float) -> bool:
    """Whether a number consists of nines, is a large power of ten, or the largest that a register holds."""
    digits = f"{value:.10g}".replace(".", "").rstrip("0")
    return set(digits) == {"9"} or (value >= _LEAST_POWER and digits == "1") or value in (32767.0, 65535.0)


def refuse_peak_at_source(
    table: TextTable, directions: tuple[np.ndarray, ...], bsdf: np.ndarray, remedy: str
) -> None:
    """Reject directions by which a regular peak is on the side of the source, unless the user says so.

    Programs count azimuths from the source or from the specular direction, and signs likewise.
    """
    if not remedy:
        return
    theta_i_deg, theta_o_deg, phi_deg, _, is_transmission = directions
    forward = angular_distance_deg(theta_o_deg, phi_deg, theta_i_deg, 180.0) < _PEAK_DEG
    backward = angular_distance_deg(theta_o_deg, phi_deg, theta_i_deg, 0.0) < _PEAK_DEG
    for side in (False, True):
        here = (is_transmission == side) & (bsdf > 0) & (theta_i_deg > _OBLIQUE_DEG)
        elsewhere = bsdf[here & ~forward & ~backward]
        at_source, at_regular = (np.max(bsdf[here & near], initial=0.0) for near in (backward, forward))
        if elsewhere.size and at_source > _PEAK * max(at_regular, float(np.median(elsewhere))):
            line = table.lines[np.flatnonzero(here & backward)[np.argmax(bsdf[here & backward])]]
            text = f"the largest value, {at_source:g}, is on the side of the source (phi_deg 0); {remedy}"
            raise refusal(table.source, text, line)


def sides(table: TextTable, index: int, notes: list[str]) -> np.ndarray:
    """True for transmission, read from R, T or the full words."""
    cells = table.column(index)
    for line, cell in zip(table.lines, cells, strict=True):
        if cell.lower() not in SIDES:
            what = f"'{cell}' is not a side" if cell else "the cell is empty"
            text = f"{what}; write R for reflection or T for transmission"
            raise refusal(table.source, text, line, "side")
    other = sorted(set(cells) - {"R", "T"})
    if other:
        pairs = ", ".join(f"'{cell}' as {SIDES[cell.lower()]}" for cell in other)
        notes.append(f"Column side: {pairs}.")
    return np.array([SIDES[cell.lower()] == "T" for cell in cells])


def refuse_radians(table: TextTable, angles: dict[str, np.ndarray]):
    """Reject angles that are in radians.

    There are two indications: all polar angles are below 3.2 and all azimuths below 6.3 while the polar
    angles are not multiples of 0.05; or half of the distinct values of a column become multiples of
    5 degrees when converted.
    """
    limits = dict(zip(ANGLES, (3.2, 3.2, 6.3), strict=True))
    small = [name for name in ANGLES if np.abs(angles[name]).max() <= limits[name]]
    polar = np.concatenate([angles["theta_i_deg"], angles["theta_o_deg"]])
    if len(small) == 3 and not _multiples(polar, 0.05, 1e-6).all():
        largest = max(float(np.abs(angles[name]).max()) for name in ANGLES)
        text = f"no angle exceeds {largest:.4g}, so the angles are in radians; multiply them by 180/pi"
        raise refusal(table.source, text, column=" and ".join(ANGLES))
    for name in small:
        distinct = np.unique(np.abs(angles[name][angles[name] != 0]))
        converted = _multiples(np.rad2deg(distinct), 5.0, 0.03) & ~_multiples(distinct, 0.05, 1e-6)
        if converted.sum() * 2 >= max(distinct.size, 1):
            line = table.lines[np.argmax(np.abs(angles[name]) == distinct[converted][0])]
            text = f"{distinct[converted][0]:.5g} looks like radians; multiply the column by 180/pi"
            raise refusal(table.source, text, line, name)


def _multiples(values, step, tolerance):
    return np.abs(values - step * np.round(values / step)) <= tolerance


def polar_angles(
    table: TextTable, values: np.ndarray, name: str, without_azimuth: bool = False
) -> np.ndarray:
    """Polar angles, 0 to 90 degrees; a table without azimuths has the side of the source in signs."""
    bad = np.flatnonzero((values < 0) | (values > 90))
    if bad.size:
        value = values[bad[0]]
        if value < 0:
            remedy = f"write {-value:g} and add 180 to phi_deg"
            if name == "theta_o_deg":
                remedy += ", in all such rows with --signed-angles (in Python: signed_angles=True)"
            elif without_azimuth:
                remedy = (
                    f"write {-value:g}, and theta_o_deg with its sign if the specular direction is "
                    f"{-value:g} there, or with the other sign if it is {value:g}"
                )
        elif name == "theta_o_deg" and 180 < value < 360:
            remedy = f"it is {value - 360:g}: with --signed-angles, write {_through(value - 360)}"
        elif value <= 180:
            remedy = f"measured from the normal of the side on which the light leaves, it is {180 - value:g}"
        else:
            remedy = "correct the row"
        text = f"{value:g} is outside the range 0 to 90 degrees; {remedy}"
        raise refusal(table.source, text, table.lines[bad[0]], name)
    return values + 0.0  # no negative zero


def refuse_through(table: TextTable, signed_deg: np.ndarray) -> None:
    """Reject signed polar angles of view beyond 90 degrees: that light has passed the sample."""
    bad = np.flatnonzero(np.abs(signed_deg) > 90)
    if not bad.size:
        return
    value, line = signed_deg[bad[0]], table.lines[bad[0]]
    turned = value - 360 * np.sign(value) if abs(value) > 180 else value
    if abs(turned) > 180:
        raise refusal(table.source, f"{value:g} is beyond a full turn; correct the row", line, "theta_o_deg")
    text = f"{value:g} is outside the range -90 to 90 degrees; write {_through(turned)}"
    raise refusal(table.source, text, line, "theta_o_deg")


def _through(signed_deg: float) -> str:
    """A signed angle, from the normal on the lit side, as it is from the normal where the light leaves."""
    if abs(signed_deg) <= 90:
        return f"{signed_deg:g}"
    other = np.sign(signed_deg) * (180 - abs(signed_deg))
    return f"{other:g}, from the normal of the other side, with side T"


def azimuths(table: TextTable, values: np.ndarray, notes: list[str]) -> np.ndarray:
    """Azimuths converted from -180 to 360 degrees into the range (-180, 180]."""
    bad = np.flatnonzero((values < -180) | (values > 360))
    if bad.size:
        text = f"{values[bad[0]]:g} is outside the range; an azimuth is -180 to 180 or 0 to 360 degrees"
        raise refusal(table.source, text, table.lines[bad[0]], "phi_deg")
    if (values > 180).any():
        notes.append("Azimuths above 180 degrees were reduced by 360, to the range (-180, 180].")
    if (values == -180).any():
        notes.append("Azimuths of -180 degrees were changed to 180.")
    values = np.where(values > 180, values - 360, values)
    return np.where(values == -180, 180.0, values) + 0.0


def wavelengths(source: str, values: np.ndarray, lines: np.ndarray | list[None]) -> np.ndarray:
    """Wavelengths in nm; the message recognises micrometres and metres."""
    low, high = WAVELENGTH_RANGE_NM
    bad = np.flatnonzero((values < low) | (values > high))
    if bad.size:
        value = values[bad[0]]
        remedy = wavelength_remedy(value) or f"it must be between {low:g} and {high:g}"
        text = f"{value:g} is not a wavelength in nm; {remedy}"
        raise refusal(source, text, lines[bad[0]], "wavelength_nm")
    return values


def wavelength_remedy(value: float) -> str:
    """What to do with a number that is a wavelength in another unit; empty if it is none."""
    if 0.1 <= value <= 20:
        return "if it is in micrometres, multiply by 1000"
    return "if it is in metres, multiply by 1e9" if 0 < value < 1e-4 else ""


def refuse_nothing_or_excess(
    table: TextTable,
    directions: tuple[np.ndarray, ...],
    bsdf: np.ndarray,
    scan: np.ndarray,
    mask: np.ndarray,
):
    """Reject a BSDF without any positive value, or one of `refuse_excess`."""
    if not (bsdf > 0).any():
        kind = "negative or zero" if bsdf.any() else "zero"
        text = f"every value is {kind}; a BSDF in 1/sr has positive values"
        raise refusal(table.source, text, column="bsdf_per_sr")
    refuse_excess(table, directions, bsdf, scan, mask)


def refuse_excess(
    table: TextTable,
    directions: tuple[np.ndarray, ...],
    bsdf: np.ndarray,
    scan: np.ndarray,
    mask: np.ndarray,
):
    """Reject a BSDF that sends out more light than arrives.

    A scan with the smallest value m that extends from within 30 degrees of the normal to theta >= 60 degrees
    sends out at least about pi m sin(theta)^2 of the light. If this exceeds 1.5, the values are in per cent
    or are reflectance factors. Zeros that are no readings do not count, nor does the detector's shadow.
    """
    if not (bsdf > 0).any():
        kind = "negative or zero" if bsdf.any() else "zero"
        text = f"every value is {kind}; a BSDF in 1/sr has positive values"
        raise refusal(table.source, text, column="bsdf_per_sr")
    theta_i_deg, theta_o_deg, phi_deg, _, is_transmission = directions
    shaded = angular_distance_deg(theta_o_deg, phi_deg, theta_i_deg, 0.0) < _SHADOW_DEG
    counts = (mask & ZERO.bit == 0) & ~(shaded & ~is_transmission)
    for index in np.unique(scan):
        here = np.flatnonzero((scan == index) & counts)
        if here.size < 5 or theta_o_deg[here].min() > 30 or theta_o_deg[here].max() < 60:
            continue
        widest = theta_o_deg[here].max()
        total = np.pi * bsdf[here].min() * np.sin(np.deg2rad(widest)) ** 2
        if total > 1.5:
            lowest = here[np.argmin(bsdf[here])]
            text = (
                f"no value of this scan is below {bsdf[lowest]:g}, so it sends out {total:.3g} times "
                "the incident light; divide values in per cent by 100, or reflectance factors by pi"
            )
            raise refusal(table.source, text, table.lines[lowest], "bsdf_per_sr")


def magnitudes(table: TextTable, values: np.ndarray, name: str) -> np.ndarray:
    """Values in 1/sr of a magnitude that is physically possible."""
    size = np.abs(values)
    bad = np.flatnonzero((size > LARGEST_PER_SR) | ((size < _SMALLEST_PER_SR) & (size > 0)))
    if bad.size:
        value = values[bad[0]]
        raise refusal(table.source, f"{value:g} {impossible_per_sr(value)}", table.lines[bad[0]], name)
    return values


def impossible_per_sr(value: float) -> str:
    """What is wrong with a value in 1/sr beyond the limits, for a message."""
    if abs(value) > LARGEST_PER_SR:
        return f"exceeds {LARGEST_PER_SR:g} per sr, all of the light in a cone of 1e-8 sr; correct the value"
    return f"is closer to 0 than {_SMALLEST_PER_SR:g}, which no instrument tells from 0; correct the value"


def refuse_unwrapped(source: str, phi_deg: np.ndarray, lines: np.ndarray):
    """Reject azimuths of exchange files that are beyond the sum or difference of any two, half a turn added.

    Larger ones lose their digits when they are reduced.
    """
    bad = np.flatnonzero(np.abs(phi_deg) > _LARGEST_AZIMUTH_DEG)
    if bad.size:
        text = f"the azimuth is {phi_deg[bad[0]]:g} degrees; it must be within three turns"
        raise refusal(source, text, lines[bad[0]], "phi_deg")


def sigmas(table: TextTable, values: np.ndarray) -> np.ndarray:
    """Standard deviations, all positive."""
    bad = np.flatnonzero(values <= 0)
    if bad.size:
        text = f"{values[bad[0]]:g} is not positive; it must be a standard deviation in 1/sr"
        if values[bad[0]] == 0:
            text += (
                "; a 0 says that the value is exact, so give the noise of its reading, or remove the row if "
                "nothing was measured, or the column to have the noise estimated"
            )
        raise refusal(table.source, text, table.lines[bad[0]], "sigma_per_sr")
    return values
