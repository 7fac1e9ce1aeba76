"""Figures of merit of a prediction against a measurement, and the weight of each point in them."""

import dataclasses

import numpy as np
from jaxtyping import Float

from jaxink.colour import illuminant_spectrum, matching_functions
from jaxink.errors import InputRefusedError
from jaxink.measurement import GonioData
from jaxink.numerics.chi_square import residual_above

# Objectives of a goniometer whose residual is that of the BSDF times a factor of each point.
INTENSITIES = ("intensity", "photometric")
_ILLUMINANT = "D65"


@dataclasses.dataclass(frozen=True)
class Merit:
    """How well a prediction fits a measurement.

    Parameters
    ----------
    points
        Number of points compared.
    chi_square, degrees_of_freedom, reduced_chi_square, probability
        Under the stated or estimated noise, with scan factors in the covariance; None if it is unknown.
    rmsd_absolute_pi
        Root mean square of pi (m - s), with the measured BSDF m and the predicted BSDF s.
    rmsd_absolute_intensity
        The same of f cos(theta_o), 1/sr.
    rmsd_absolute_pi_percent, rmsd_absolute_intensity_percent
        The same in percent of the largest measured value of the same quantity.
    rmsd_relative
        Root mean square of (m - s) / (0.5 (m + s)).
    rmsd_logarithmic
        The same for the natural logarithms of m and s: of (ln m - ln s) / (0.5 (ln m + ln s)).
    relative_rms
        Root mean square of s / m - 1.
    """

    points: int
    chi_square: float | None
    degrees_of_freedom: int | None
    reduced_chi_square: float | None
    probability: float | None
    rmsd_absolute_pi: float
    rmsd_absolute_pi_percent: float
    rmsd_absolute_intensity: float
    rmsd_absolute_intensity_percent: float
    rmsd_relative: float | None
    rmsd_logarithmic: float | None
    relative_rms: float | None


@dataclasses.dataclass(frozen=True)
class ScanMerit:
    """Misfit of one scan.

    Parameters
    ----------
    theta_i_deg, wavelength_nm, side
        Identify the scan.
    points
        Number of its used points.
    chi_square
        Its contribution to chi-square; None if the noise is unknown.
    relative_rms, mean_relative
        Root mean square and mean of predicted / measured - 1.
    """

    theta_i_deg: float
    wavelength_nm: float
    side: str
    points: int
    chi_square: float | None
    relative_rms: float | None
    mean_relative: float | None


def rms(values) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def merit(
    data: GonioData,
    predicted: np.ndarray,
    whitened: np.ndarray | None,
    n_parameters: int,
    noise_freedom: float = np.inf,
) -> Merit:
    """Figures of merit over the used points.

    Parameters
    ----------
    data
        The measurement.
    predicted
        Predicted BSDF at its used points, 1/sr.
    whitened
        Residuals whitened by the noise, or None.
    n_parameters
        Number of fitted parameters.
    noise_freedom
        Degrees of freedom of an estimated noise.
    """
    used = data.used
    measured = data.bsdf_per_sr[used]
    cosine = np.cos(np.deg2rad(data.theta_o_deg[used]))
    positive = bool(np.all(measured > 0) and np.all(predicted > 0))
    square: float | None = None
    freedom: int | None = None
    probability: float | None = None
    if whitened is not None:
        square, freedom = float(np.sum(whitened**2)), len(measured) - n_parameters
        probability = float(residual_above(square, freedom, noise_freedom)) if freedom > 0 else None
    log_m, log_s = (np.log(v) if positive else None for v in (measured, predicted))
    relative = (measured - predicted) / (0.5 * (measured + predicted)) if positive else None
    return Merit(
        points=len(measured),
        chi_square=square,
        degrees_of_freedom=freedom,
        reduced_chi_square=square / freedom if square is not None and freedom and freedom > 0 else None,
        probability=probability,
        rmsd_absolute_pi=np.pi * rms(measured - predicted),
        rmsd_absolute_pi_percent=100 * rms(measured - predicted) / float(np.max(measured)),
        rmsd_absolute_intensity=rms(cosine * (measured - predicted)),
        rmsd_absolute_intensity_percent=100
        * rms(cosine * (measured - predicted))
        / float(np.max(cosine * measured)),
        rmsd_relative=rms(relative) if positive else None,
        rmsd_logarithmic=rms(_symmetric(log_m, log_s)) if positive else None,
        relative_rms=rms(predicted / measured - 1) if positive else None,
    )


def _symmetric(m, s):
    """(m - s) divided by the mean of m and s, finite if the mean of two logarithms crosses 0."""
    mean = 0.5 * (m + s)
    return (m - s) / np.where(mean >= 0, 1.0, -1.0) / np.maximum(np.abs(mean), 1e-3)


def merit_by_scan(
    data: GonioData, predicted: np.ndarray, whitened: np.ndarray | None
) -> tuple[ScanMerit, ...]:
    """Misfit of each scan, in the order of the data's scans; arguments as for `merit`."""
    used = data.used
    measured, scan_index = data.bsdf_per_sr[used], data.scan_index[used]
    rows = []
    for scan in data.scans:
        here = scan_index == scan.index
        if not here.any():
            continue
        positive = bool(np.all(measured[here] > 0))
        ratio = predicted[here] / measured[here] - 1 if positive else None
        rows.append(
            ScanMerit(
                scan.theta_i_deg,
                scan.wavelength_nm,
                scan.side,
                int(here.sum()),
                None if whitened is None else float(np.sum(whitened[here] ** 2)),
                None if ratio is None else rms(ratio),
                None if ratio is None else float(np.mean(ratio)),
            )
        )
    return tuple(rows)


def factor_of_points(kind: str, data: GonioData) -> Float[np.ndarray, " used"]:
    """Factor of the residual of each used point; 1 unless the objective is one of `INTENSITIES`.

    Parameters
    ----------
    kind
        ``intensity``: cos(theta_o), which makes a BSDF an angular intensity per incident power;
        ``photometric``: that times V(lambda) and the power of D65, over their mean at the wavelengths of the
        points, so that each wavelength counts as the eye sees it.
    data
        The measurement.

    Raises
    ------
    InputRefusedError
        If no wavelength is visible.
    """
    used = data.used
    if kind not in INTENSITIES:
        return np.ones(int(used.sum()))
    cosine = np.cos(np.deg2rad(data.theta_o_deg[used]))
    if kind == "intensity":
        return cosine
    wave = data.wavelength_nm[used]
    at, functions = matching_functions(2)
    # V(lambda) is the second colour-matching function of 1931.
    seen = np.interp(wave, at, functions[1], 0.0, 0.0)
    seen = seen * np.interp(wave, *illuminant_spectrum(_ILLUMINANT), 0.0, 0.0)
    if not seen.mean() > 0:
        raise InputRefusedError(
            f"{data.source or 'the measurement'}: has no visible wavelength, so nothing is photometric; "
            "choose the objective 'intensity'."
        )
    return cosine * seen / np.mean([seen[wave == one][0] for one in np.unique(wave)])
