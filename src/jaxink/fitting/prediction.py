"""Predict a measurement from a sample, without a fit."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jaxink.effects import forward_model
from jaxink.fitting.inputs import read_inputs
from jaxink.measurement import GonioData
from jaxink.model.forward import evaluate
from jaxink.sample import Sample
from jaxink.solver.accuracy import DEFAULT_ACCURACY
from jaxink.solver.config import SolverConfig


def predict(
    sample: Sample | str | Path,
    data: GonioData | str | Path | Sequence[str | Path],
    config: SolverConfig | None = None,
    accuracy: float = DEFAULT_ACCURACY,
) -> np.ndarray:
    """Predict the BSDF of a sample, without a fit, at every point of a measurement.

    Masks and the wavelengths that the sample lists only apply to fits; a prediction includes every point.
    `jaxink.fitting.marked` applies the masks of the sample while keeping all points.

    Parameters
    ----------
    sample
        Sample, or its file.
    data
        Measurement, or its file; only its directions, sides and wavelengths are used. Parameters given by
        wavelength must have a value at each of its wavelengths.
    config
        Resolution of the solver; None for that of the accuracy.
    accuracy
        Largest relative error of the BSDF due to the discretisation.

    Returns
    -------
    np.ndarray
        1/sr, shape ``(points,)``, in the order of the measurement.

    Raises
    ------
    InputRefusedError
        Sample or data are invalid.
    """
    data, sample = read_inputs(data, sample)
    return evaluate(forward_model(sample, data, config, accuracy))
