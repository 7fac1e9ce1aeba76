"""Predict a measurement from a sample, without a fit."""

from pathlib import Path

import numpy as np

from jaxink.fitting.inputs import read_inputs
from jaxink.measurement import GonioData
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.sample import Sample
from jaxink.solver.accuracy import DEFAULT_ACCURACY
from jaxink.solver.config import SolverConfig


def predict(
    sample: Sample | str | Path,
    data: GonioData | str | Path,
    config: SolverConfig | None = None,
    accuracy: float = DEFAULT_ACCURACY,
) -> np.ndarray:
    """Predict the BSDF of a sample, without a fit, at every point of a measurement.

    Masks and the wavelengths that the sample names say what a fit takes; a prediction leaves nothing out.
    `jaxink.fitting.marked` masks what the sample's file masks, all points kept.

    Parameters
    ----------
    sample
        Sample, or its file.
    data
        Measurement, or its file; only its directions, sides and wavelengths are used. At a wavelength that
        the sample does not name, its parameters must hold, too; one given by wavelength needs a value there.
    config
        Sizes of the discretisation; None: those for the accuracy.
    accuracy
        Largest relative error of the BSDF that the discretisation may cause.

    Returns
    -------
    np.ndarray
        1/sr, shape ``(points,)``, in the order of the measurement.

    Raises
    ------
    InputRefusedError
        If sample or data cannot be used.
    """
    data, sample = read_inputs(data, sample)
    return evaluate(ForwardModel(sample, *data.directions, config=config, accuracy=accuracy))
