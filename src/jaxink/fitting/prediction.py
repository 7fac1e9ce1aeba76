"""Predict a measurement from a sample, without a fit."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from jaxink.effects import forward_model, readings_model
from jaxink.errors import InputRefusedError, require_kind
from jaxink.fitting.inputs import read_inputs, read_sample
from jaxink.measurement import GonioData, Readings, read
from jaxink.model import evaluate, wavelengths_without_values
from jaxink.sample import Sample, load_sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig


def predict(
    sample: Sample | str | Path,
    data: GonioData | Readings | str | Path | Sequence[str | Path],
    config: SolverConfig | None = None,
    accuracy: float = DEFAULT_ACCURACY,
) -> np.ndarray:
    """Predict the BSDF or the readings of a sample, without a fit, at every point of a measurement.

    Masks and the wavelengths that the sample lists only apply to fits; a prediction includes every point.
    `jaxink.fitting.marked` applies the masks of the sample while keeping all points.

    Parameters
    ----------
    sample
        Sample, or its file.
    data
        Measurement of a BSDF, or its file; only its directions, sides and wavelengths are used, and a table
        may lack the column ``bsdf_per_sr``. Or readings, of which the values are not used either.
    config
        Resolution of the solver; None for that of the accuracy.
    accuracy
        Largest relative error of the BSDF due to the discretisation.

    Returns
    -------
    np.ndarray
        Shape ``(points,)``, in the order of the measurement: a BSDF in 1/sr, NaN at the wavelengths of
        `unknown_nm`; or readings as `Readings` has them.

    Raises
    ------
    InputRefusedError
        Sample or data are invalid, or nothing can be predicted.
    """
    if isinstance(data, str | Path | list | tuple):
        data = read(data, needs_values=False)
    if isinstance(data, Readings):
        return evaluate(readings_model(read_sample(sample), data, config, accuracy))
    data, sample = read_inputs(data, sample)
    known = ~np.isin(data.wavelength_nm, unknown_nm(sample, data))
    if known.all() or not known.any():
        return evaluate(forward_model(sample, data, config, accuracy))
    predicted = np.full(len(data), np.nan)
    part = data.select(wavelength_nm=np.unique(data.wavelength_nm[known]).tolist())
    predicted[known] = evaluate(forward_model(sample, part, config, accuracy))
    return predicted


def unknown_nm(sample: Sample, data: GonioData) -> list[float]:
    """Wavelengths of a measurement at which parameters that the sample gives by wavelength have no value."""
    return wavelengths_without_values(sample, np.unique(data.wavelength_nm).tolist())


def predict_at(
    sample: Sample | str | Path,
    theta_i_deg: ArrayLike,
    theta_o_deg: ArrayLike,
    phi_deg: ArrayLike | None = None,
    wavelength_nm: ArrayLike | None = None,
    side: ArrayLike = "R",
    accuracy: float = DEFAULT_ACCURACY,
) -> GonioData:
    """Predict the BSDF of a sample in chosen directions.

    The arguments may be numbers or arrays of shapes that broadcast, so that ``theta_i_deg`` of shape
    ``(n, 1)`` and ``theta_o_deg`` of shape ``(m,)`` give all pairs.

    Parameters
    ----------
    sample
        Sample, or its file; of a fit, ``result.sample``.
    theta_i_deg
        Polar angles of incidence.
    theta_o_deg
        Polar angles of view; without ``phi_deg`` signed, in the plane of incidence, negative towards the
        source.
    phi_deg
        Azimuths as in `GonioData`.
    wavelength_nm
        Wavelengths; None: the only one of the sample.
    side
        ``"R"`` or ``"T"``, or an array of these.
    accuracy
        As for `predict`.

    Returns
    -------
    GonioData
        The directions with the predicted BSDF, one point after the other.

    Raises
    ------
    InputRefusedError
        An argument is invalid, or the wavelength is missing.
    """
    require_kind("sample", sample, Sample, str, Path)
    sample = sample if isinstance(sample, Sample) else load_sample(sample)
    if wavelength_nm is None:
        if len(sample.wavelengths_nm) != 1:
            known = ", ".join(f"{nm:g}" for nm in sample.wavelengths_nm)
            of = f", one or several of {known}" if known else ", as the sample states none"
            raise InputRefusedError(f"wavelength_nm is missing; state it in nm{of}.")
        wavelength_nm = sample.wavelengths_nm[0]
    if not np.isin(side, ("R", "T")).all():
        raise InputRefusedError(f"side is {side!r}; it must be 'R' or 'T', or an array of these.")
    view = np.asarray(theta_o_deg, float)
    phi = np.where(view < 0, 0.0, 180.0) if phi_deg is None else phi_deg
    polar = np.abs(view) if phi_deg is None else view
    shaped = np.broadcast_arrays(theta_i_deg, polar, phi, wavelength_nm, np.asarray(side) == "T")
    theta_i, theta_o, azimuth, wavelength, far = (column.ravel() for column in shaped)
    unknown, row = np.zeros(theta_i.size), np.arange(2, theta_i.size + 2)
    data = GonioData(theta_i, theta_o, azimuth, wavelength, far, unknown, row=row, source="prediction")
    return data.replace(bsdf_per_sr=evaluate(forward_model(sample, data, accuracy=accuracy)))
