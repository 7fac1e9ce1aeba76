"""The objective of a fit to readings of instruments other than a goniometer."""

import numpy as np
from jaxtyping import Float

from jaxink.effects import readings_model
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.fitting.figures_of_merit import INTENSITIES
from jaxink.fitting.objective import (
    OBJECTIVES,
    Objective,
    constants_of,
    free_of,
    priors_of,
    require_positive,
)
from jaxink.fitting.scaling import UnitScale
from jaxink.measurement import FitNoise, Noise, Readings
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig


def readings_objective(
    readings: Readings,
    sample: Sample,
    kind: str = "chi_square",
    config: SolverConfig | None = None,
    noise: FitNoise | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    layer_method: str = "fastest",
) -> Objective:
    """Objective for readings and a sample.

    Parameters
    ----------
    readings
        The readings; those at other wavelengths than the sample lists are left out.
    sample
        The sample; its free parameters become the variables. Its noise and weights apply as to a BSDF; the
        readings of one quantity are a scan.
    kind
        ``chi_square``, ``absolute``, ``relative`` or ``logarithmic``.
    config
        Resolution of the solver; None to choose it for the accuracy.
    noise
        Noise of the readings at the wavelengths of the sample; None for that of `noise_of_readings`.
    accuracy, layer_method
        See `ReadingsModel`.

    Returns
    -------
    Objective
        With shares of power and reflectance factors in the place of the BSDF.

    Raises
    ------
    InputRefusedError
        No parameter is free, the noise is unknown, a wavelength of the sample is missing, or the objective
        cannot take the values.
    """
    require_one_of("objective", kind, OBJECTIVES)
    if kind in INTENSITIES:
        raise InputRefusedError(
            f"the objective '{kind}' is of the directions of a goniometer, and "
            f"{readings.source or 'the readings'} are numbers of other instruments; choose chi_square."
        )
    if any(weight.differs_within_scans for weight in sample.weights):
        raise InputRefusedError(
            f"{readings.source or 'the readings'}: [[weights]] with theta_o_deg or column are for a "
            "goniometer; use theta_i_deg, side or wavelength_nm."
        )
    free = free_of(sample)
    readings = readings.at_wavelengths(sample.wavelengths_nm)
    require_positive(kind, readings.value, "readings", "leave them out")
    noise = noise_of_readings(readings, sample.noise) if noise is None else noise
    model = readings_model(sample, readings, config, accuracy, layer_method)
    names = tuple(parameter.name for parameter in free)
    constants = constants_of(sample, names)
    prior_weights, prior_mean, prior_deviation = priors_of(free)
    return Objective(
        model=model,
        measured=readings.value,
        sigma=noise.sigma_per_sr,
        scan=readings.scan_index,
        weight=np.sqrt(_weights_of(readings, sample)),
        scale=UnitScale.of(free),
        prior_weights=prior_weights,
        prior_mean=prior_mean,
        prior_deviation=prior_deviation,
        constants=np.array(list(constants.values()), float),
        names=tuple(constants),
        scan_relative=np.asarray(noise.scan_relative, float),
        n_scans=int(readings.scan_index.max()) + 1,
        kind=kind,
        free=names,
    )


def noise_of_readings(readings: Readings, declared: Noise) -> FitNoise:
    """Noise of readings: from the file, or as declared for a BSDF, in the unit of the readings.

    Parameters
    ----------
    readings
        The readings.
    declared
        Of the sample; ``floor_per_sr`` is a share of the incident power here. Without ``scan_relative``,
        readings of one quantity have no common factor.

    Raises
    ------
    InputRefusedError
        If neither gives a standard deviation, or one of 0.
    """
    scan_relative = declared.scan_relative or 0.0
    if readings.sigma is not None and declared.use_file_sigma:
        return FitNoise(readings.sigma, scan_relative, "sigma of the file")
    name = readings.source or "the readings"
    if declared.relative is None and declared.floor_per_sr == 0:
        raise InputRefusedError(
            f"{name}: the noise is unknown, and cannot be estimated from single readings; add a column "
            "sigma, or state noise.relative or noise.floor_per_sr in the sample file."
        )
    relative = declared.relative or 0.0
    sigma = np.hypot(relative * readings.value, declared.floor_per_sr)
    if not np.all(sigma > 0):
        row = readings.row[int(np.argmin(sigma))]
        raise InputRefusedError(
            f"{name}, row {row}: noise.relative of a value of 0 gives a standard deviation of 0; state "
            "noise.floor_per_sr above 0."
        )
    origin = f"declared: {relative:.3g} of the value, floor {declared.floor_per_sr:.3g}"
    return FitNoise(sigma, scan_relative, origin)


def _weights_of(readings: Readings, sample: Sample) -> Float[np.ndarray, " readings"]:
    settings = (readings.theta_i_deg, readings.theta_o_deg, readings.wavelength_nm, readings.is_transmission)
    weight = np.ones(len(readings.value))
    for one in sample.weights:
        weight[one.chosen(*settings)] *= one.weight
    return weight
