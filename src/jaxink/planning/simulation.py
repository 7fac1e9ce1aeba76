"""Data of the present measurements and one more, simulated, and fits to them."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.fitting import (
    CompiledJointObjective,
    Descent,
    JointObjective,
    Objective,
    Search,
    covariance,
    search,
)
from jaxink.planning.forecast import Planned
from jaxink.planning.known import KnownFit


@dataclasses.dataclass(frozen=True)
class SimulatedCheck:
    """Fits to simulated data of the present measurements and one more.

    Parameters
    ----------
    name
        The further measurement.
    standard_errors
        Of each free parameter, from the fit of the data simulated at the present minimum.
    separation
        Least chi-square by which a minimum that the data do not follow is above the one that they follow,
        over data simulated at each of the minima; None without rivals.
    """

    __repr__ = brief_repr

    name: str
    standard_errors: dict[str, float]
    separation: float | None


def simulated_check(
    known: KnownFit,
    planned: Planned,
    rivals: Sequence[Float[np.ndarray, " parameters"]],
    seed: int,
) -> SimulatedCheck:
    """Simulate the present measurements with one more at every minimum, and fit from every minimum.

    Parameters
    ----------
    known
        The present measurements.
    planned
        The further one.
    rivals
        Other minima, scaled to [0, 1].
    seed
        Of the noise.
    """
    rng, hypotheses = np.random.default_rng(seed), [known.unit, *rivals]
    apart, errors = list[float](), dict[str, float]()
    for number, truth in enumerate(hypotheses):
        programs = CompiledJointObjective(simulated(known, planned, truth, rng))
        ends = [search(Descent(), programs, start) for start in hypotheses]
        if number == 0:
            errors = _fitted_errors(known, ends[0])
        others = [end.loss for i, end in enumerate(ends) if i != number]
        if others:
            apart.append(min(others) - ends[number].loss)
    return SimulatedCheck(planned.candidate.name, errors, min(apart) if apart else None)


def simulated(
    known: KnownFit,
    planned: Planned,
    truth: Float[np.ndarray, " parameters"],
    rng: np.random.Generator | None = None,
) -> JointObjective:
    """The objective of data that follow a hypothesis.

    Parameters
    ----------
    known, planned
        The present measurements, and the further one.
    truth
        The hypothesis, scaled to [0, 1].
    rng
        Of the noise; None for none.
    """
    present, part = known.objective, planned.at_noise_of(truth)
    parts = []
    for one, at in zip((*present.parts, part), (*present.positions, planned.positions), strict=True):
        exact = _predicted(one, truth[at], known, planned)
        measured = exact
        if rng is not None:
            factor = one.scan_relative * rng.standard_normal(one.n_scans)
            measured = exact * (1 + factor[one.scan]) + one.sigma * rng.standard_normal(len(exact))
        parts.append(dataclasses.replace(one, measured=measured))
    return dataclasses.replace(
        present,
        parts=tuple(parts),
        positions=(*present.positions, planned.positions),
        shares=(*present.shares, 1.0),
    )


def _predicted(
    part: Objective, unit: Float[np.ndarray, " own"], known: KnownFit, planned: Planned
) -> Float[np.ndarray, " points"]:
    for one, program in zip(known.objective.parts, known.programs.parts, strict=True):
        if part is one:
            return program.linearised(unit).predicted
    return planned.programs.linearised(unit).predicted


def _fitted_errors(known: KnownFit, end: Search) -> dict[str, float]:
    """Standard errors in the units of the parameters."""
    if end.triangle is None or end.gradient is None:
        return {}
    deviation = covariance(end.triangle, end.unit, end.gradient).deviation
    slopes = np.abs(np.asarray(known.objective.scale.slope(end.unit)))
    return dict(zip(known.free, (deviation * slopes).tolist(), strict=True))
