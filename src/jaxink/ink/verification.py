"""Comparison of a table, as a thin sheet on its plate, with the full model and with the measurement."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.fitting import FitResult
from jaxink.ink.sheet import sheets
from jaxink.ink.stacks import reversed_sample
from jaxink.ink.table import InkTable
from jaxink.model import ForwardModel, evaluate
from jaxink.sample import Sample

_AWAY_FROM_GRAZING_DEG = 75.0


@dataclasses.dataclass(frozen=True)
class SheetCheck:
    """Comparison of the sheet with the full model at one incidence.

    Parameters
    ----------
    wavelength_nm
        Wavelength.
    lit_from
        ``inside``: light meets the plate first; ``outside``: light meets the ink first.
    side
        ``R`` or ``T``.
    theta_i_deg
        Angle of incidence in the surroundings.
    largest_difference
        Largest difference over all exit directions, relative to the largest BSDF of the full model.
    largest_away_from_grazing
        The same for exit angles up to 75 degrees.
    """

    wavelength_nm: float
    lit_from: str
    side: str
    theta_i_deg: float
    largest_difference: float
    largest_away_from_grazing: float


@dataclasses.dataclass(frozen=True)
class SheetVerification:
    """Result of `verify_sheet`.

    Parameters
    ----------
    checks
        One for each wavelength, illuminated side, exit side and incidence.
    sheet_rms, model_rms
        Relative root mean square differences of the sheet and of the full model from the used points of the
        measurement, by exit side; None without a measurement.
    """

    __repr__ = brief_repr

    checks: tuple[SheetCheck, ...]
    sheet_rms: dict[str, float] | None = None
    model_rms: dict[str, float] | None = None

    @property
    def largest_difference(self) -> float:
        """The largest difference of all checks."""
        return max(check.largest_difference for check in self.checks)


def verify_sheet(
    table: InkTable,
    source: FitResult | Sample,
    theta_i_deg: Sequence[float] = (0.0, 15.0, 30.0, 45.0, 60.0),
    n_nodes: int = 32,
) -> SheetVerification:
    """Put a table on its plate as a thin sheet and compare it with the full model and the measurement.

    Parameters
    ----------
    table
        Table from `ink_table`.
    source
        Fit or sample from which it was computed.
    theta_i_deg
        Angles of incidence in the surroundings; if empty, only the measurement is compared.
    n_nodes
        As for `Sheet`.

    Returns
    -------
    SheetVerification
        Exit directions are every 2.5 degrees up to 87.5, in the plane of incidence and perpendicular to it.
        The measurement is only compared if the instrument has no cones.

    Raises
    ------
    InputRefusedError
        If the table does not belong to this sample.
    """
    ink, of_wavelength = sheets(table, source, n_nodes)
    sample = dataclasses.replace(ink.sample, source_half_angle_deg=0.0, detector_half_angle_deg=0.0)
    first_lit = 0 if ink.inside == "front" else 1
    checks = []
    for lit_from, lit_sample in ((first_lit, sample), (1 - first_lit, reversed_sample(sample))):
        if len(theta_i_deg):
            checks += _checks(of_wavelength, lit_sample, lit_from, theta_i_deg)
    return SheetVerification(tuple(checks), *_against_measurement(of_wavelength, source, first_lit))


def _checks(of_wavelength, sample, lit_from, theta_i_deg):
    axes = np.meshgrid([False, True], np.arange(0, 88, 2.5), [0.0, 90.0, 180.0], indexing="ij")
    side, theta_o, phi = (axis.ravel() for axis in axes)
    incidences = np.repeat(theta_i_deg, len(side))
    n_i = len(theta_i_deg)
    wavelengths = [sheet.table.wavelength_nm[sheet.wavelength] for sheet in of_wavelength]
    points = [np.tile(column, n_i * len(wavelengths)) for column in (theta_o, phi, side)]
    model = ForwardModel(
        sample,
        np.tile(incidences, len(wavelengths)),
        *points[:2],
        np.repeat(wavelengths, len(incidences)),
        points[2],
    )
    full = evaluate(model).reshape(len(wavelengths), n_i, len(side))
    for sheet, wavelength, of_model in zip(of_wavelength, wavelengths, full, strict=True):
        for theta_i, expected in zip(theta_i_deg, of_model, strict=True):
            difference = np.abs(sheet.bsdf(lit_from, theta_i, theta_o, phi, side) - expected)
            for name, chosen in (("R", ~side), ("T", side)):
                share = difference[chosen] / np.max(expected[chosen])
                away = share[theta_o[chosen] <= _AWAY_FROM_GRAZING_DEG]
                lit = ("inside", "outside")[lit_from]
                largest = float(np.max(share)), float(np.max(away))
                yield SheetCheck(float(wavelength), lit, name, float(theta_i), *largest)


def _against_measurement(of_wavelength, source, lit_from):
    """Relative root mean square differences of the sheet and of the fit, by side."""
    if not isinstance(source, FitResult):
        return None, None
    if source.sample.source_half_angle_deg or source.sample.detector_half_angle_deg:
        return None, None
    data, used = source.data, source.data.used
    columns = (column[used] for column in (*data.directions, data.bsdf_per_sr))
    theta_i, theta_o, phi, wavelength, side, measured = columns
    predicted = np.full(len(measured), np.nan)
    for sheet in of_wavelength:
        here = np.isclose(wavelength, sheet.table.wavelength_nm[sheet.wavelength], rtol=0, atol=1e-6)
        for incidence in np.unique(theta_i[here]):
            now = here & (theta_i == incidence)
            predicted[now] = sheet.bsdf(lit_from, incidence, theta_o[now], phi[now], side[now])

    def rms(prediction):
        ratio = prediction / measured - 1
        found = {}
        for name, chosen in (("R", ~side), ("T", side)):
            here = chosen & (measured != 0) & np.isfinite(predicted)
            if here.any():
                found[name] = float(np.sqrt(np.mean(ratio[here] ** 2)))
        return found

    return rms(predicted), rms(source.predicted_per_sr)
