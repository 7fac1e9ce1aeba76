"""What a model lacks: the residual, the effect it resembles, and the error before and after that is added."""

from jaxink.diagnosis.findings.diagnosis import CandidateRow, Diagnosis, Figures, Step, Summary, Verdict
from jaxink.diagnosis.findings.location import Factor, Location, locate
from jaxink.diagnosis.findings.transfer import Transfer, transfer
from jaxink.diagnosis.search.loop import DiagnosisOptions, diagnose
from jaxink.diagnosis.statistics.candidate import Candidate, ScreenedCandidate, ScreenOptions, ScreenResult
from jaxink.diagnosis.statistics.discrepancy import SmoothPart, smooth_part
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.predictive_density import (
    HeldOutGain,
    Observations,
    block_folds,
    held_out_gain,
    scan_folds,
)
from jaxink.diagnosis.statistics.projection import Projection, TangentCone
from jaxink.diagnosis.statistics.screen import PreparedScreen, prepare_screen, screen
from jaxink.diagnosis.statistics.structure import (
    PreparedStructure,
    StructureResult,
    StructureStatistic,
    find_structure,
    prepare_structure,
)

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
    "locate",
    "prepare_screen",
    "prepare_structure",
    "scan_folds",
    "screen",
    "smooth_part",
    "transfer",
]
