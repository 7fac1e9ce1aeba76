"""What a measurement says of itself in a notebook."""

from collections.abc import Sequence

from jaxtyping import UInt32
from numpy import ndarray

from jaxink.display.card import Card, CardTable
from jaxink.measurement.masks import mask_sentences
from jaxink.measurement.scans import Scan

_MOST_INCIDENCES = 12


def data_card(
    source: str,
    scans: Sequence[Scan],
    mask: UInt32[ndarray, " points"],
    has_sigma: bool,
    notes: Sequence[str],
) -> Card:
    """Card of a measurement; the parameters are fields of `GonioData`, or derived from them."""
    wavelengths = sorted({scan.wavelength_nm for scan in scans})
    spectrum = f"{wavelengths[0]:g} nm"
    if len(wavelengths) > 1:
        spectrum = f"{len(wavelengths)} wavelengths from {wavelengths[0]:g} to {wavelengths[-1]:g} nm"
    noise = "with standard deviations" if has_sigma else "without standard deviations"
    title = (
        f"Measurement {source or 'in memory'}: {len(mask)} points in {len(scans)} scans, {spectrum}, {noise}"
    )
    rows = []
    for side in sorted({scan.side for scan in scans}):
        for wavelength_nm in wavelengths:
            here = [s for s in scans if (s.side, s.wavelength_nm) == (side, wavelength_nm)]
            if here:
                points, used = sum(scan.points for scan in here), sum(scan.used for scan in here)
                rows.append([side, f"{wavelength_nm:g}", _incidences(here), str(points), str(used)])
    table = CardTable(["side", "nm", "incidence in degrees", "points", "used"], rows, (0, 2))
    return Card(title, mask_sentences(mask), (table,), notes)


def _incidences(scans: Sequence[Scan]) -> str:
    angles = [f"{scan.theta_i_deg:g}" for scan in scans]
    if len(angles) > _MOST_INCIDENCES:
        return f"{len(angles)} from {angles[0]} to {angles[-1]}"
    return ", ".join(angles)
