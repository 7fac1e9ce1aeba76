"""What a model lacks: the residual, the effect it resembles, and the error before and after that is added."""

from jaxink.diagnosis.candidate import Candidate, ScreenedCandidate, ScreenOptions, ScreenResult
from jaxink.diagnosis.cross_validation import (
    HeldOutGain,
    Observations,
    block_folds,
    held_out_gain,
    scan_folds,
)
from jaxink.diagnosis.discrepancy import SmoothPart, smooth_part
from jaxink.diagnosis.joint import ImitatingPair, JointDrop, joint_drop, pairs_that_imitate
from jaxink.diagnosis.location import Factor, Location, locate
from jaxink.diagnosis.loop import DiagnosisOptions, diagnose
from jaxink.diagnosis.outcome import CandidateRow, Diagnosis, Figures, Step, Summary, Verdict
from jaxink.diagnosis.points import Points
from jaxink.diagnosis.projection import Projection, TangentCone
from jaxink.diagnosis.screen import PreparedScreen, prepare_screen, screen
from jaxink.diagnosis.structure import (
    PreparedStructure,
    StructureResult,
    StructureStatistic,
    find_structure,
    prepare_structure,
)
from jaxink.diagnosis.transfer import Transfer, transfer

__all__ = [
    "diagnose",
    "Verdict",
    "Summary",
    "Step",
    "Figures",
    "DiagnosisOptions",
    "Diagnosis",
    "CandidateRow",
    "Candidate",
    "Factor",
    "HeldOutGain",
    "ImitatingPair",
    "JointDrop",
    "Location",
    "Observations",
    "Points",
    "PreparedScreen",
    "PreparedStructure",
    "Projection",
    "ScreenOptions",
    "ScreenResult",
    "ScreenedCandidate",
    "SmoothPart",
    "StructureResult",
    "StructureStatistic",
    "TangentCone",
    "Transfer",
    "block_folds",
    "find_structure",
    "held_out_gain",
    "joint_drop",
    "locate",
    "pairs_that_imitate",
    "prepare_screen",
    "prepare_structure",
    "scan_folds",
    "screen",
    "smooth_part",
    "transfer",
]
