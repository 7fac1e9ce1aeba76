"""The objective of a joint fit: the residuals of several measurements, one block for each."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from jaxink.display.brief import brief_repr
from jaxink.effects import settled
from jaxink.errors import InputRefusedError
from jaxink.fitting.compiled import CompiledObjective, Point
from jaxink.fitting.objective import Objective, make_objective, priors_of
from jaxink.fitting.objective_of_readings import readings_objective
from jaxink.fitting.scaling import UnitScale
from jaxink.measurement import FitNoise, Readings
from jaxink.projects import Measurement, Project
from jaxink.sample import ParameterTable, Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig

Resolutions = tuple[SolverConfig, ...]


@dataclasses.dataclass(frozen=True)
class JointObjective:
    """Objectives of several measurements in the variables of all; each depends on its own parameters only.

    What all know apart from the measurements, the priors, counts once.

    Parameters
    ----------
    parts
        Objective of each measurement, without priors.
    positions
        Which of the variables are those of a measurement, in the order of its own.
    shares
        Factor of the residuals of each measurement.
    scale
        Maps variables in [0, 1] to the free parameters.
    free
        Names of the free parameters in the project.
    prior_weights, prior_mean, prior_deviation
        See `Objective`.
    """

    __repr__ = brief_repr

    parts: tuple[Objective, ...]
    positions: tuple[Int[np.ndarray, "_"], ...]
    shares: tuple[float, ...]
    scale: UnitScale
    free: tuple[str, ...]
    prior_weights: Float[np.ndarray, "priors parameters"]
    prior_mean: Float[np.ndarray, " priors"]
    prior_deviation: Float[np.ndarray, " priors"]

    @classmethod
    def of(
        cls,
        project: Project,
        noises: Sequence[FitNoise],
        kind: str = "chi_square",
        resolutions: Resolutions | None = None,
        accuracy: float = DEFAULT_ACCURACY,
        layer_method: str = "fastest",
    ) -> "JointObjective":
        """Objective of a project.

        Parameters
        ----------
        project
            Measurements, with their masks.
        noises
            Noise of each.
        kind, accuracy, layer_method
            See `make_objective`.
        resolutions
            Of the solver for each measurement; None to choose them for the accuracy.
        """
        free = project.free
        names = tuple(p.name for p in free)
        configs = (None,) * len(project) if resolutions is None else resolutions
        parts = []
        for one, noise, config in zip(project.measurements, noises, configs, strict=True):
            given = without_priors(one.sample), kind, config, noise, accuracy, layer_method
            try:
                if isinstance(one.data, Readings):
                    made = readings_objective(one.data, *given)
                else:
                    made = make_objective(one.data, *given)
            except InputRefusedError as problem:
                raise InputRefusedError(f"measurement '{one.name}': {problem}") from None
            parts.append(made)
        n_points = sum(len(part.measured) for part in parts)
        mean_square = kind != "chi_square"
        weights, mean, deviation = priors_of(free)
        return cls(
            parts=tuple(parts),
            positions=tuple(
                np.array([names.index(one.names[own]) for own in part.free], int)
                for one, part in zip(project.measurements, parts, strict=True)
            ),
            # Such an objective is the mean over the points, here those of all measurements.
            shares=tuple(np.sqrt(len(p.measured) / n_points) if mean_square else 1.0 for p in parts),
            scale=UnitScale.of(free),
            free=names,
            prior_weights=weights,
            prior_mean=mean,
            prior_deviation=deviation,
        )

    @property
    def n_points(self) -> int:
        """Number of fitted points of all measurements."""
        return sum(part.n_points for part in self.parts)

    @property
    def n_rows(self) -> int:
        """Length of the residual vector."""
        return self.n_points + len(self.prior_mean)

    @property
    def n_stacks(self) -> int:
        """Number of stacks that one residual solves."""
        return sum(part.n_stacks for part in self.parts)

    @property
    def resolution(self) -> Resolutions:
        """Resolution of the solver for each measurement."""
        return tuple(part.resolution for part in self.parts)

    def resolution_at(self, values: Mapping[str, float], accuracy: float, layer_method: str) -> Resolutions:
        """See `Objective.resolution_at`; values by their names in the project."""
        everything = np.array([values[name] for name in self.free])
        return tuple(
            part.resolution_at(
                dict(zip(part.free, everything[at].tolist(), strict=True)), accuracy, layer_method
            )
            for part, at in zip(self.parts, self.positions, strict=True)
        )

    def tabulated(self) -> "JointObjective":
        """See `Objective.tabulated`."""
        return dataclasses.replace(self, parts=tuple(part.tabulated() for part in self.parts))

    def numbers(self, unit: Float[np.ndarray, " parameters"]) -> dict[str, float]:
        """Free parameters in their units by their names in the project."""
        physical = self.scale.to_physical(np.asarray(unit, float))
        return dict(zip(self.free, physical.tolist(), strict=True))

    def only(self, chosen: Sequence[int]) -> "JointObjective":
        """The objective of some of the measurements, with all priors and in the same variables."""
        return dataclasses.replace(
            self,
            parts=tuple(self.parts[i] for i in chosen),
            positions=tuple(self.positions[i] for i in chosen),
            shares=tuple(self.shares[i] for i in chosen),
        )

    def of_parts(self, column: Float[np.ndarray, " points"]) -> tuple[Float[np.ndarray, "_"], ...]:
        """What belongs to each measurement of numbers for all points."""
        ends = np.cumsum([part.n_points for part in self.parts])
        return tuple(np.split(column[: ends[-1]], ends[:-1]))

    def prior_rows(self, unit: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " priors"]:
        """Residuals of the priors."""
        physical = self.scale.to_physical(unit)
        return (self.prior_mean - self.prior_weights @ physical) / self.prior_deviation

    def prior_slopes(self, unit: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "priors parameters"]:
        """Derivatives of these by the variables."""
        return -self.prior_weights * self.scale.slope(unit) / self.prior_deviation[:, None]


class CompiledJointObjective:
    """The residual of a joint objective and its Jacobian; measurements of equal structure share programs.

    Parameters
    ----------
    objective
        To be evaluated.
    """

    def __init__(self, objective: JointObjective):
        self.objective = objective
        self.parts = tuple(CompiledObjective(part) for part in objective.parts)

    def residual(self, unit: Float[np.ndarray, " parameters"]) -> Point:
        """The residual at a point."""
        unit = np.array(unit, float)
        found = [part.residual(unit[at]) for part, at in self._parts]
        return Point(unit, self._rows(found, unit), np.concatenate([one.predicted for one in found]))

    def linearised(self, unit: Float[np.ndarray, " parameters"]) -> Point:
        """The residual and its Jacobian, whose blocks are those of the measurements."""
        unit, objective = np.array(unit, float), self.objective
        found = [part.linearised(unit[at]) for part, at in self._parts]
        blocks = []
        for one, at, share in zip(found, objective.positions, objective.shares, strict=True):
            block = np.zeros((len(one.residual), len(unit)))
            block[:, at] = share * one.jacobian
            blocks.append(block)
        predicted = np.concatenate([one.predicted for one in found])
        jacobian = np.concatenate([*blocks, objective.prior_slopes(unit)])
        return Point(unit, self._rows(found, unit), predicted, jacobian)

    def predicted(self, unit: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " points"]:
        """Prediction of all measurements, one after the other."""
        unit = np.array(unit, float)
        return np.concatenate([part.predicted(unit[at]) for part, at in self._parts])

    def prepare(self, unit: Float[np.ndarray, " parameters"], jacobian: bool) -> float:
        """Compile what a search needs, if necessary; return the seconds it took."""
        unit = np.array(unit, float)
        return sum(part.prepare(unit[at], jacobian) for part, at in self._parts)

    def count(self, evaluations: int, jacobians: int) -> None:
        """See `CompiledObjective.count`."""
        for part in self.parts:
            part.count(evaluations, jacobians)

    @property
    def _parts(self):
        return zip(self.parts, self.objective.positions, strict=True)

    def _rows(self, found: Sequence[Point], unit: np.ndarray) -> Float[np.ndarray, " rows"]:
        shares = self.objective.shares
        rows = [share * one.residual for share, one in zip(shares, found, strict=True)]
        return np.concatenate([*rows, self.objective.prior_rows(unit)])


def without_priors(sample: Sample) -> Sample:
    """A sample without independent knowledge of its parameters."""
    table = [dataclasses.replace(p, prior=None, smoothness=None) for p in sample.parameters.values()]
    return dataclasses.replace(sample, parameters=ParameterTable(table))


def with_settled_effects(one: Measurement) -> Measurement:
    """A measurement whose declared effects are fixed by its points, see `jaxink.effects.settled`."""
    if isinstance(one.data, Readings):
        return one
    return dataclasses.replace(one, sample=settled(one.sample, one.data))
