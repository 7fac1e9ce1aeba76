"""Fitting a sample to a measurement, gradient-based or by other methods for comparison."""

from jaxink.fitting.agreement import Agreement
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.exclusion import predict_left_out
from jaxink.fitting.fitted_parameters import FittedCovariance, FittedParameters
from jaxink.fitting.input_check import check_input
from jaxink.fitting.inputs import marked, prepare_data
from jaxink.fitting.joint_loading import load_joint_result
from jaxink.fitting.joint_result import JointResult
from jaxink.fitting.levenberg_marquardt import BoundedLevenbergMarquardt
from jaxink.fitting.loading import load_result
from jaxink.fitting.log_density import LogDensity
from jaxink.fitting.minimisation import fit
from jaxink.fitting.mistake import Mistake
from jaxink.fitting.objective import OBJECTIVES, Objective, make_objective
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.prediction import predict, predict_at
from jaxink.fitting.readings_objective import readings_objective
from jaxink.fitting.readings_result import ReadingsResult
from jaxink.fitting.result import FitResult
from jaxink.fitting.verdict import FitVerdict, FitVerdictCode

__all__ = [
    "Agreement",
    "METHODS",
    "OBJECTIVES",
    "BoundedLevenbergMarquardt",
    "FitOptions",
    "FitResult",
    "FittedCovariance",
    "FittedParameters",
    "JointResult",
    "LogDensity",
    "FitVerdict",
    "FitVerdictCode",
    "Mistake",
    "Objective",
    "Outcome",
    "ReadingsResult",
    "check_input",
    "fit",
    "load_joint_result",
    "load_result",
    "make_objective",
    "marked",
    "predict",
    "predict_at",
    "predict_left_out",
    "prepare_data",
    "readings_objective",
]
