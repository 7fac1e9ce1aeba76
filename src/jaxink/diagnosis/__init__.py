"""What a model lacks: fit, look for structure in the residual, find the effect that explains it, and judge.

Layers from below: `policy` (thresholds), `statistics` (residuals only; knows neither model nor effects),
`search` (fits and chooses effects), `findings` (interprets the result), `joint` (the same for several
measurements at once), `procedure` (runs them all).
"""

from jaxink.diagnosis.findings.candidates import CandidateRow
from jaxink.diagnosis.findings.diagnosis import Diagnosis
from jaxink.diagnosis.findings.hidden import HiddenEffect
from jaxink.diagnosis.findings.judgement import TESTS
from jaxink.diagnosis.findings.location import Location, locate
from jaxink.diagnosis.findings.report_reading import read_report
from jaxink.diagnosis.findings.saved import SavedDiagnosis, Transfer, load_diagnosis, transfer
from jaxink.diagnosis.findings.summary import Figures, Summary
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.diagnosis.joint.joint_diagnosis import JointDiagnosis, JointStep
from jaxink.diagnosis.policy import SearchPolicy
from jaxink.diagnosis.procedure import diagnose
from jaxink.diagnosis.search.deadline import Omission, OptionalTask, TimeLimit
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.search.refit import Estimate
from jaxink.diagnosis.search.step import Step
from jaxink.diagnosis.search.unfinished import FolderState, Unfinished
from jaxink.diagnosis.statistics.candidate import (
    Candidate,
    ScreenedCandidate,
    ScreenOptions,
    ScreenResult,
    Testability,
)
from jaxink.diagnosis.statistics.discrepancy import SmoothPart, smooth_part
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.predictive_density import (
    HeldOutGain,
    Observations,
    block_folds,
    held_out_gain,
    scan_folds,
)
from jaxink.diagnosis.statistics.projection import Projection
from jaxink.diagnosis.statistics.screen import PreparedScreen, prepare_screen, screen
from jaxink.diagnosis.statistics.structure import (
    PreparedStructure,
    StructureResult,
    StructureStatistic,
    find_structure,
    prepare_structure,
)
from jaxink.diagnosis.statistics.tangent_cone import TangentCone
from jaxink.diagnosis.statistics.variance_analysis import Factor
from jaxink.numerics.failures import Failure

__all__ = [
    "TESTS",
    "Candidate",
    "CandidateRow",
    "Diagnosis",
    "DiagnosisOptions",
    "Estimate",
    "Factor",
    "Failure",
    "Figures",
    "HeldOutGain",
    "HiddenEffect",
    "JointDiagnosis",
    "JointStep",
    "Location",
    "Observations",
    "Omission",
    "FolderState",
    "Points",
    "PreparedScreen",
    "PreparedStructure",
    "Projection",
    "SavedDiagnosis",
    "ScreenOptions",
    "ScreenResult",
    "ScreenedCandidate",
    "SearchPolicy",
    "SmoothPart",
    "Step",
    "StructureResult",
    "StructureStatistic",
    "Summary",
    "TangentCone",
    "OptionalTask",
    "Testability",
    "TimeLimit",
    "Transfer",
    "Unfinished",
    "Verdict",
    "VerdictCode",
    "block_folds",
    "diagnose",
    "find_structure",
    "held_out_gain",
    "load_diagnosis",
    "locate",
    "prepare_screen",
    "prepare_structure",
    "read_report",
    "scan_folds",
    "screen",
    "smooth_part",
    "transfer",
]
