"""What a fit minimises, the objective of one measurement or of several, and the same compiled."""

from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.joint_objective import CompiledJointObjective, JointObjective
from jaxink.fitting.objective import Objective

FitObjective = Objective | JointObjective
CompiledFit = CompiledObjective | CompiledJointObjective


def compile_objective(objective: FitObjective) -> CompiledFit:
    """The programs of an objective, of one measurement or of several."""
    if isinstance(objective, JointObjective):
        return CompiledJointObjective(objective)
    return CompiledObjective(objective)
