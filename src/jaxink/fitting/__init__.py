"""Fitting a sample to a measurement, by gradient or by simplex."""

from jaxink.fitting.exclusion import predict_left_out
from jaxink.fitting.loading import load_result
from jaxink.fitting.objective import OBJECTIVES, Objective, make_objective, noise_of
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.result import FitResult
from jaxink.fitting.run import FitOptions, fit, marked, predict, prepare_data

__all__ = [
    "OBJECTIVES",
    "FitOptions",
    "FitResult",
    "Objective",
    "Outcome",
    "fit",
    "load_result",
    "make_objective",
    "marked",
    "noise_of",
    "predict",
    "predict_left_out",
    "prepare_data",
]
