"""What a fit knows of its parameters: a project at its minimum, and the information in it."""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.fitting import (
    CompiledJointObjective,
    FitResult,
    JointObjective,
    JointResult,
    Minima,
    ReadingsResult,
)
from jaxink.measurement import FitNoise, GonioData
from jaxink.projects import Measurement, Project

PRESENT = "present"
# Of a range: a parameter that is known no better is not determined.
RANGE_DEVIATION = 0.289


@dataclasses.dataclass(frozen=True)
class KnownFit:
    """A fit as the start of a plan.

    Parameters
    ----------
    project
        Its measurements; the parameters of their samples have the fitted values.
    noises
        Of the measurements.
    objective
        At the resolution of the fit.
    minima
        Those that the fit has found, or None.
    disagreement
        What is said if its measurements disagree; else empty.
    """

    project: Project
    noises: tuple[FitNoise, ...]
    objective: JointObjective
    minima: Minima | None
    disagreement: str = ""

    @classmethod
    def of(cls, result: FitResult | JointResult) -> "KnownFit":
        """What a fit knows.

        Raises
        ------
        InputRefusedError
            Its noise is unknown, or it has no measurement of a BSDF.
        """
        parts = result.measurements if isinstance(result, JointResult) else {PRESENT: result}
        names = result.names if isinstance(result, JointResult) else {}
        measurements, noises = [], []
        for name, one in parts.items():
            if not one.noise["known"]:
                raise InputRefusedError(
                    f"measurement '{name}': its noise is unknown, so nothing can be forecast; declare it in "
                    "[noise] and fit again."
                )
            own = names.get(name) or {p: p for p in one.sample.parameters}
            measurements.append(Measurement(name, one.data, one.sample, own))
            sigma = one.sigma if isinstance(one, ReadingsResult) else one.sigma_per_sr
            noises.append(FitNoise(sigma, one.noise["scan_relative"], one.noise["origin"]))
        project = Project(tuple(measurements))
        if not any(isinstance(one.data, GonioData) for one in measurements):
            raise InputRefusedError(
                "the fit has no measurement of a BSDF, whose noise and directions a plan begins from."
            )
        resolutions = tuple(one.config for one in parts.values())
        objective = JointObjective.of(project, noises, resolutions=resolutions)
        compared = result.agreement if isinstance(result, JointResult) else None
        disagreement = ""
        if compared is not None and compared.disagrees:
            odd = compared.outlier
            which = "the one that is wrong" if odd is None else f"'{odd.name}'"
            disagreement = (
                f"The measurements disagree: repeat or remove {which} first; forecasts from this fit may be "
                "far off."
            )
        return cls(project, tuple(noises), objective, result.minima, disagreement)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters in the project."""
        return self.objective.free

    @cached_property
    def unit(self) -> Float[np.ndarray, " parameters"]:
        """The minimum, free parameters scaled to [0, 1]."""
        values = np.array([self.project.parameters[name].value for name in self.free])
        return np.clip(self.objective.scale.to_unit(values), 0.0, 1.0)

    @cached_property
    def programs(self) -> CompiledJointObjective:
        """The residual and its Jacobian."""
        return CompiledJointObjective(self.objective)

    def information(
        self, unit: Float[np.ndarray, " parameters"]
    ) -> Float[np.ndarray, "parameters parameters"]:
        """Fisher information of the present measurements and priors at a point."""
        jacobian = self.programs.linearised(unit).jacobian
        assert jacobian is not None
        return jacobian.T @ jacobian

    @property
    def base(self) -> tuple[Measurement, FitNoise]:
        """The measurement of a BSDF with the most points, and its noise."""
        pairs = [
            (one, noise)
            for one, noise in zip(self.project.measurements, self.noises, strict=True)
            if isinstance(one.data, GonioData)
        ]
        return max(pairs, key=lambda pair: pair[0].n_points)
