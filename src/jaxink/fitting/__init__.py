"""Fitting a sample to a measurement, gradient-based or by other methods for comparison."""

from jaxink.fitting.agreement import Agreement
from jaxink.fitting.assembly import UNMOVED, Found, assemble
from jaxink.fitting.bounded import DECREMENT
from jaxink.fitting.colouring import colours, points_affected
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.compiled import CompiledObjective, Point, program_of
from jaxink.fitting.derived import OPTICAL_PROPERTIES
from jaxink.fitting.endings import Ending
from jaxink.fitting.exclusion import fit_near, predict_left_out, require_slope, without
from jaxink.fitting.figures_of_merit import merit
from jaxink.fitting.fit_one import fit
from jaxink.fitting.fitted_parameters import (
    FittedCovariance,
    FittedParameter,
    FittedParameters,
    merit_table,
    value_head,
)
from jaxink.fitting.gradient import Descent, GradientSearch
from jaxink.fitting.input_check import check_input, is_doubtful
from jaxink.fitting.inputs import marked, prepare_data, read_inputs, require_sample
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
from jaxink.fitting.minima import COMPARABLE_RISE, Minima
from jaxink.fitting.mistake import Mistake, mistakes_sentence, rejection
from jaxink.fitting.objective import OBJECTIVES, Objective, compose, make_objective, weights_of, whiten_scans
from jaxink.fitting.objective_of_readings import readings_objective
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Outcome, Search, SearchPath
from jaxink.fitting.prediction import predict, predict_at, unknown_nm
from jaxink.fitting.readings_result import ReadingsResult
from jaxink.fitting.relative_deviation import Deviation, deviation
from jaxink.fitting.result import FitResult, SearchSummary
from jaxink.fitting.result_tables import (
    compilation_sentence,
    correlation_lines,
    derived_table,
    named_lines,
    parameter_notes,
    points_words,
    rejected_table,
    scan_table,
    search_table,
)
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
    "OPTICAL_PROPERTIES",
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
    "compilation_sentence",
    "compose",
    "correlation_lines",
    "covariance",
    "derived_table",
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
    "named_lines",
    "noises_of",
    "parameter_notes",
    "points_affected",
    "points_words",
    "predict",
    "predict_at",
    "predict_left_out",
    "prepare_data",
    "program_of",
    "read_inputs",
    "readings_objective",
    "rejected_table",
    "rejection",
    "require_sample",
    "require_slope",
    "scan_table",
    "search",
    "search_table",
    "sweep_of",
    "unknown_nm",
    "value_head",
    "weights_of",
    "whiten_scans",
    "with_settled_effects",
    "without",
    "without_priors",
]
