"""One augmented model and one measurement: predictions, fits and derivatives from one compiled program.

The free variables of a fit are slots; which parameter a slot stands for is data, not structure. One compiled
program therefore fits any choice of parameters and computes any column of the Jacobian.
"""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxink.diagnosis.search.checkpoint import ARRAY, POINT, SEARCH, Checkpoint
from jaxink.display.brief import brief_repr
from jaxink.effects import AugmentedModel, Effect, Scene, carriers
from jaxink.fitting import (
    DECREMENT,
    GradientSearch,
    Objective,
    Point,
    Search,
    UnitScale,
    colours,
    compose,
    fit_near,
    points_affected,
    without,
)
from jaxink.measurement import FitNoise, GonioData
from jaxink.sample import Parameter, Sample
from jaxink.solver import SolverConfig

_UNUSED = Parameter("unused", 0.5, True, 0.0, 1.0)


class SlotObjective(Objective):
    """An objective whose free variables stand for exchangeable parameters.

    Slot i stands for the name at `position[i]`, or for none beyond the last one; the other names have the
    values of `constants`.
    """

    position: Int[np.ndarray, " parameters"]
    at_once: int = eqx.field(static=True, default=1)

    @property
    def variables(self) -> tuple[str | None, ...]:
        """Names that the slots stand for."""
        return tuple(self.names[i] if i < len(self.names) else None for i in self.position)

    @property
    def directions_at_once(self) -> int:
        """Those of most fits, all of which share a program."""
        return self.at_once

    def named(self, physical: Float[Array, " parameters"]) -> dict[str, Float[Array, ""]]:
        """Values of all names: the constants, replaced by the slots."""
        whole = jnp.asarray(self.constants).at[self.position].set(physical, mode="drop")
        return {name: whole[i] for i, name in enumerate(self.names)}


def _declared_directions(model: AugmentedModel, base_free: tuple[str, ...]) -> int:
    """Directional derivatives of a fit without effects."""
    return 1 + int(max(colours(points_affected(model, base_free)[0]), default=-1))


@dataclasses.dataclass(frozen=True)
class Solution:
    """Result of a fit.

    Parameters
    ----------
    values
        Of all names of the objective.
    free
        The fitted parameters.
    chi_square
        Including the priors.
    predicted_per_sr
        At the used points.
    search
        The search itself.
    """

    __repr__ = brief_repr

    values: dict[str, float]
    free: tuple[str, ...]
    chi_square: float
    predicted_per_sr: Float[np.ndarray, " points"]
    search: Search


class Place(NamedTuple):
    """A prediction at values that no fit has found."""

    values: dict[str, float]
    predicted_per_sr: Float[np.ndarray, " points"]


class Linearisation(NamedTuple):
    """Derivatives of the whitened prediction by parameters (rows of priors last), and the residual."""

    jacobian: Float[np.ndarray, "rows parameters"]
    residual: Float[np.ndarray, " rows"]


class Start(NamedTuple):
    """An objective with a point where it has been linearised, to be fitted to nearly the same data."""

    objective: SlotObjective
    end: Point
    free: tuple[str, ...]

    @property
    def derivatives(self) -> Linearisation:
        """Derivatives with respect to the free parameters."""
        n = len(self.free)
        slope = self.objective.scale.slope(self.end.unit)[:n]
        assert self.end.jacobian is not None
        return Linearisation(-self.end.jacobian[:, :n] / slope, self.end.residual)


class _Slotted(NamedTuple):
    """An objective with its slots assigned, and their values."""

    objective: SlotObjective
    unit: Float[np.ndarray, " slots"]


class CandidateObjective:
    """A sample with effects, and one measurement; `objective` is minimised, with no slot assigned.

    Parameters
    ----------
    sample
        As declared, without effects; the values of its table are the constants.
    effects
        Added to the sample.
    data, noise
        The measurement and its noise.
    config
        Resolution of the solver.
    n_slots
        Largest number of free parameters of a fit.
    checkpoint
        Where results are kept; None to keep none.
    added_at_once
        Parameters in addition to the declared ones by which fits are differentiated in one run of a program.
    """

    def __init__(
        self,
        sample: Sample,
        effects: tuple[Effect, ...],
        data: GonioData,
        noise: FitNoise,
        config: SolverConfig,
        scene: Scene,
        n_slots: int,
        checkpoint: Checkpoint | None = None,
        added_at_once: int = 1,
    ):
        self._checkpoint = checkpoint or Checkpoint()
        model = AugmentedModel(sample, effects, scene, config)
        self.noise_freedom = noise.degrees_of_freedom
        self.base, self.effects = sample, carriers(sample, effects)
        table = model.sample.parameters
        terms = {term.name: term for effect in self.effects for term in effect.terms}
        base_free = {p.name: p for p in sample.parameters.free}
        # A declared effect keeps its own range.
        self.terms: dict[str, Parameter] = terms | base_free
        names = tuple(n for n, p in table.items() if p.tie is None)
        self._index = {name: i for i, name in enumerate(names)}
        start = table.values_with({})
        self.start = {name: float(start[name]) for name in names}
        self.n_slots = n_slots
        self.base_free = tuple(base_free)
        self._engine: GradientSearch | None = None
        self.objective = compose(
            SlotObjective,
            model,
            data,
            sample,
            noise,
            self.start,
            kind="chi_square",
            scale=UnitScale.of((_UNUSED,) * n_slots),
            free=tuple(f"slot{i}" for i in range(n_slots)),
            position=np.full(n_slots, len(names)),
            at_once=added_at_once + _declared_directions(model, self.base_free),
        )

    @property
    def measured(self) -> Float[np.ndarray, " points"]:
        """Measured BSDF at the used points, 1/sr."""
        return self.objective.measured

    @property
    def weight(self) -> Float[np.ndarray, " points"]:
        """Factor of the residual of each used point; see `Objective`."""
        return self.objective.weight

    @property
    def declared(self) -> dict[str, float]:
        """Values of the declared sample's free parameters, as declared."""
        return {name: self.start[name] for name in self.base_free}

    def _with_slots(self, values: dict[str, float], free: tuple[str, ...]) -> _Slotted:
        whole = self.start | {k: v for k, v in values.items() if k in self.start}
        chosen = [self.terms[name] for name in free]
        chosen += [_UNUSED] * (self.n_slots - len(free))
        scale = UnitScale.of(tuple(chosen))
        physical = np.array([*(whole[name] for name in free), *[0.5] * (self.n_slots - len(free))])
        position = [self._index[n] for n in free] + [len(self._index)] * (self.n_slots - len(free))
        objective = dataclasses.replace(
            self.objective,
            scale=scale,
            constants=np.array([whole[n] for n in self._index]),
            position=np.array(position),
        )
        return _Slotted(objective, np.clip(scale.to_unit(physical), 0.0, 1.0))

    def _search(self, objective: SlotObjective) -> GradientSearch:
        """Search on the objective with some slots assigned; it holds on to the compiled programs."""
        if self._engine is None:
            self._engine = GradientSearch(objective)
        return self._engine.on(objective)

    def release(self) -> None:
        """Drop the compiled programs; they are compiled again when needed."""
        self._engine = None

    def replace_measured(self, measured: Float[np.ndarray, " points"]) -> None:
        """Take other measured values at the same points, with the same noise."""
        self.objective = dataclasses.replace(self.objective, measured=measured)

    def scale_of(self, free: tuple[str, ...]) -> UnitScale:
        """Map from the unit interval to the ranges of some parameters."""
        return UnitScale.of(tuple(self.terms[name] for name in free))

    def predict(self, values: dict[str, float]) -> Float[np.ndarray, " points"]:
        """Predicted BSDF at the used points, 1/sr."""
        objective, unit = self._with_slots(values, ())
        return self._checkpoint.once(
            "prediction", (objective, unit), ARRAY, lambda: self._search(objective).predicted(unit)
        )

    def fit(
        self,
        values: dict[str, float],
        free: tuple[str, ...],
        max_jacobians: int = 40,
        decrement: float = DECREMENT,
    ) -> Solution:
        """Fit some parameters, all others at given values.

        Parameters
        ----------
        values
            Start.
        free
            Parameters to fit; those of the declared sample first.
        max_jacobians
            Limit of the search.
        decrement
            At which the search ends; see `jaxink.fitting.bounded.DECREMENT`.
        """
        objective, unit = self._with_slots(values, free)
        held = self._unused(free)
        search = self._checkpoint.once(
            "fit",
            (objective, unit, held, max_jacobians, decrement),
            SEARCH,
            lambda: self._search(objective).run(unit, held, max_jacobians=max_jacobians, decrement=decrement),
        )
        return self._solution(objective, free, search)

    def fit_near(
        self,
        start: Start,
        left_out: Bool[np.ndarray, " points"] | None = None,
        measured: Float[np.ndarray, " points"] | None = None,
        max_jacobians: int = 40,
        decrement: float = DECREMENT,
    ) -> Solution:
        """Fit to some of the points, or to other measured values.

        Parameters
        ----------
        start
            From `linearised`, at the fit to all of them as a rule.
        left_out
            Points to ignore.
        measured
            Values to fit instead of the measured ones, 1/sr.
        max_jacobians, decrement
            See `fit`.
        """
        objective, end, free = start
        if left_out is not None:
            objective = without(objective, left_out)
        if measured is not None:
            objective = dataclasses.replace(objective, measured=measured)
        limits = self._unused(free), max_jacobians, decrement
        search = self._checkpoint.once(
            "fit nearby",
            (objective, end.unit, *limits),
            SEARCH,
            lambda: fit_near(self._search(objective), objective, end, *limits),
        )
        return self._solution(objective, free, search)

    def _unused(self, free: tuple[str, ...]) -> dict[int, float]:
        """Values of the slots that stand for no parameter."""
        return {i: 0.5 for i in range(len(free), self.n_slots)}

    def _solution(self, objective: SlotObjective, free: tuple[str, ...], search: Search) -> Solution:
        physical = objective.scale.to_physical(np.asarray(search.unit))
        found = dict(zip(objective.names, objective.constants.tolist(), strict=True))
        found |= dict(zip(free, physical.tolist(), strict=False))
        return Solution(found, free, search.loss, search.predicted, search)

    def linearised(self, values: dict[str, float], free: tuple[str, ...]) -> Start:
        """Start of fits of some parameters to nearly the same data."""
        objective, unit = self._with_slots(values, free)
        end = self._checkpoint.once(
            "linearisation", (objective, unit), POINT, lambda: self._search(objective).linearised(unit)
        )
        return Start(objective, end, free)

    def jacobian(self, values: dict[str, float], free: tuple[str, ...]) -> Linearisation:
        """Derivatives with respect to some parameters, all others at given values."""
        # Priors apply to the first slots, so every batch begins with the declared sample's parameters.
        fixed = self.base_free
        rest = [n for n in free if n not in fixed]
        room = self.n_slots - len(fixed)
        batches = [tuple(rest[i : i + room]) for i in range(0, max(len(rest), 1), room)]
        found: dict[str, np.ndarray] = {}
        each = [self.linearised(values, (*fixed, *batch)).derivatives for batch in batches]
        for batch, one in zip(batches, each, strict=True):
            found |= zip((*fixed, *batch), one.jacobian.T, strict=True)
        columns = [found[name] for name in free]
        return Linearisation(np.stack(columns, axis=1), each[-1].residual)

    def whiten(
        self, predicted: Float[np.ndarray, " points"], change: Float[np.ndarray, " points"]
    ) -> Float[np.ndarray, " rows"]:
        """A change of the prediction in units of the noise, weighted, with zeros for the rows of priors."""
        rows = self.objective.weight * self.in_noise(predicted, change)
        return np.concatenate([rows, np.zeros(len(self.objective.prior_mean))])

    def in_noise(
        self, predicted: Float[np.ndarray, " points"], change: Float[np.ndarray, " points"]
    ) -> Float[np.ndarray, " points"]:
        """A change of the prediction in units of the noise, unweighted."""
        return np.asarray(self.objective.in_noise(predicted, change))
