"""Fitting a sample to a measurement, gradient-based or by other methods for comparison."""

from jaxink.fitting.agreement import Agreement
from jaxink.fitting.assembly import UNMOVED, Found, assemble
from jaxink.fitting.bounded import DECREMENT
from jaxink.fitting.colouring import colours, points_affected
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.compiled import CompiledObjective, Point, program_of
from jaxink.fitting.endings import Ending
from jaxink.fitting.exclusion import fit_near, predict_left_out, require_slope, without
from jaxink.fitting.figures_of_merit import merit
from jaxink.fitting.fit_one import fit
from jaxink.fitting.fitted_parameters import FittedCovariance, FittedParameter, FittedParameters, merit_table
from jaxink.fitting.gradient import Descent, GradientSearch
from jaxink.fitting.input_check import check_input, is_doubtful
from jaxink.fitting.inputs import marked, prepare_data, read_inputs
from jaxink.fitting.joint_fit import fit_project, noises_of
from jaxink.fitting.joint_loading import load_joint_result
from jaxink.fitting.joint_objective import (
    CompiledJointObjective,
    JointObjective,
    with_settled_effects,
    without_priors,
)
from jaxink.fitting.joint_result import JointResult
from jaxink.fitting.levenberg_marquardt import BoundedLevenbergMarquardt
from jaxink.fitting.limits import SearchLimits
from jaxink.fitting.loading import load_result
from jaxink.fitting.log_density import LogDensity
from jaxink.fitting.method import search
from jaxink.fitting.minima import COMPARABLE_RISE, OVER_MINIMA, Minima
from jaxink.fitting.mistake import Mistake, mistakes_sentence, rejected, rejection
from jaxink.fitting.objective import OBJECTIVES, Objective, compose, make_objective, weights_of, whiten_scans
from jaxink.fitting.objective_of_readings import readings_objective
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Outcome, Search, SearchPath
from jaxink.fitting.prediction import predict, predict_at, unknown_nm
from jaxink.fitting.readings_result import ReadingsResult
from jaxink.fitting.relative_deviation import Deviation, deviation
from jaxink.fitting.result import FitResult, SearchSummary
from jaxink.fitting.scaling import UnitScale
from jaxink.fitting.sweep import sweep_of
from jaxink.fitting.uncertainty import covariance
from jaxink.fitting.verdict import FitVerdict, FitVerdictCode, level_in_doubt

__all__ = [
    "UNMOVED",
    "COMPARABLE_RISE",
    "DECREMENT",
    "METHODS",
    "OBJECTIVES",
    "OVER_MINIMA",
    "Agreement",
    "BoundedLevenbergMarquardt",
    "CompiledJointObjective",
    "CompiledObjective",
    "Descent",
    "Deviation",
    "Ending",
    "FitOptions",
    "FitResult",
    "FitVerdict",
    "FitVerdictCode",
    "FittedCovariance",
    "FittedParameter",
    "FittedParameters",
    "Found",
    "GradientSearch",
    "JointObjective",
    "JointResult",
    "SearchLimits",
    "LogDensity",
    "Minima",
    "Mistake",
    "Objective",
    "Outcome",
    "Point",
    "ReadingsResult",
    "Search",
    "SearchPath",
    "SearchSummary",
    "UnitScale",
    "assemble",
    "check_input",
    "colours",
    "compose",
    "covariance",
    "deviation",
    "fit",
    "fit_near",
    "fit_project",
    "is_doubtful",
    "level_in_doubt",
    "load_joint_result",
    "load_result",
    "make_objective",
    "marked",
    "merit",
    "merit_table",
    "mistakes_sentence",
    "noises_of",
    "points_affected",
    "predict",
    "predict_at",
    "predict_left_out",
    "prepare_data",
    "program_of",
    "read_inputs",
    "readings_objective",
    "rejected",
    "rejection",
    "require_slope",
    "search",
    "sweep_of",
    "unknown_nm",
    "weights_of",
    "whiten_scans",
    "with_settled_effects",
    "without",
    "without_priors",
]
