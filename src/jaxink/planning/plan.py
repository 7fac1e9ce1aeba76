"""What to measure next, ranked by what it would determine; its forecast checked by simulated fits."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError, require_integer
from jaxink.files.encoding import plain
from jaxink.fitting import (
    COMPARABLE_RISE,
    CompiledJointObjective,
    Descent,
    FitResult,
    JointObjective,
    JointResult,
    Objective,
    Search,
    covariance,
    scan_of,
    search,
)
from jaxink.numerics.digits import percent, rounded
from jaxink.numerics.failures import Failure, Failures
from jaxink.numerics.precision import computing
from jaxink.numerics.progress import Progress, StepOf, log_progress
from jaxink.planning.forecast import NoiseOfKind, Planned
from jaxink.planning.known import Known
from jaxink.planning.menu import Candidate, menu

READINGS = 100
# Of a range: a parameter that is known no better is not determined.
_RANGE_DEVIATION = 0.289
_UNDETERMINED = 0.2
# Minima that are so little higher are told apart by a plan, even if the fit excludes them already.
_NEAR_RISE = 3 * COMPARABLE_RISE
_MOST_RIVALS = 8
_CHECKED = 2
# Leading forecasts that are examined for every minimum that may be right: the present one, and so many.
_MOST_EXAMINED, _MOST_RIGHT = 4, 4
Rival = tuple[Float[np.ndarray, " parameters"], float]


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
    known: Known,
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
    known: Known,
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
    part: Objective, unit: Float[np.ndarray, " own"], known: Known, planned: Planned
) -> Float[np.ndarray, " points"]:
    for one, program in zip(known.objective.parts, known.programs.parts, strict=True):
        if part is one:
            return program.linearised(unit).predicted
    return planned.programs.linearised(unit).predicted


def _fitted_errors(known: Known, end: Search) -> dict[str, float]:
    """Standard errors in the units of the parameters."""
    if end.triangle is None or end.gradient is None:
        return {}
    deviation = covariance(end.triangle, end.unit, end.gradient).deviation
    slopes = np.abs(np.asarray(known.objective.scale.slope(end.unit)))
    return dict(zip(known.free, (deviation * slopes).tolist(), strict=True))


@dataclasses.dataclass(frozen=True)
class Forecast:
    """What one measurement would leave.

    Parameters
    ----------
    name, words
        Of the measurement.
    standard_errors
        Of each target, with the present measurements and this one.
    gain
        Geometric mean over the targets of the standard error now divided by that then.
    separation
        Least chi-square of the other minima on noise-free data that follow the present one, all parameters
        refitted; None without rival minima.
    chance
        Probability that all minima but the right one are then excluded (chi-square at least 9 above it), the
        right one being any of the five likeliest now, by its likelihood; None if it was not examined.
    """

    __repr__ = brief_repr

    name: str
    words: str
    standard_errors: dict[str, float]
    gain: float
    separation: float | None
    chance: float | None = None


@dataclasses.dataclass(frozen=True, repr=False)
class MeasurementPlan(Presented):
    """Further measurements, the most telling first.

    Parameters
    ----------
    readings
        Number of readings that each is taken to have.
    noise
        Of each reading, relative to its value, and of the factor common to a scan.
    targets
        Parameters that are to be determined, with their standard errors now.
    disagreement
        That the present measurements disagree; empty if they do not.
    undetermined
        Those of them that the present measurements do not determine within their ranges.
    rivals
        Values of the free parameters at minima that the present measurements hardly exclude.
    separation
        Chi-square of the lowest of these above the present minimum.
    forecasts
        Of every measurement of the menu.
    checks
        Of the first two forecasts, by fits to simulated data.
    failures
        Measurements of the menu that cannot be predicted, with the reason.
    candidates
        The measurements of the forecasts, by name.

    Notes
    -----
    Standard errors follow from the linear model at the minimum, with each parameter known within its range.
    """

    readings: int
    noise: tuple[float, float]
    targets: dict[str, float]
    disagreement: str
    undetermined: tuple[str, ...]
    rivals: tuple[dict[str, float], ...]
    separation: float | None
    forecasts: tuple[Forecast, ...]
    checks: tuple[SimulatedCheck, ...] = ()
    failures: tuple[Failure, ...] = ()
    candidates: dict[str, Candidate] = dataclasses.field(default_factory=dict)

    @property
    def best(self) -> Forecast:
        """The first of the forecasts."""
        return self.forecasts[0]

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is open, and what would settle it."""
        said = [self.disagreement] if self.disagreement else []
        if self.undetermined:
            said.append(f"The data do not determine {', '.join(self.undetermined)} within the range.")
        if self.separation is not None:
            words = f"Another minimum is {_higher(self.separation)} in chi-square"
            if self.best.separation is not None:
                words += f"; with {self.best.words}, it would be {_higher(self.best.separation)}"
            said.append(f"{words}.")
            if self.best.chance is not None:
                said.append(
                    f"The chance that this measurement excludes all minima but the right one is "
                    f"{percent(self.best.chance)}."
                )
        best = self.best
        errors = ", ".join(
            f"{name} to {rounded(error, 2)} (now {_now(self.targets[name])})"
            for name, error in best.standard_errors.items()
        )
        said.append(f"{self.readings} readings of {best.words} would determine {errors}.")
        return tuple(said)

    def table(self) -> CardTable:
        """Every measurement with the standard errors that it would leave."""
        names = list(self.targets)
        heads = ["further measurement", "gain", *(["separation", "chance"] if self.rivals else []), *names]
        rows = [["none", "1", *([rounded(self.separation, 3), ""] if self.rivals else [])]]
        rows[0] += [_now(self.targets[name]) for name in names]
        for one in self.forecasts:
            row = [one.words, rounded(one.gain, 3)]
            row += [rounded(one.separation, 3), percent(one.chance)] if self.rivals else []
            rows.append([*row, *(rounded(one.standard_errors[name], 2) for name in names)])
        return CardTable(heads, rows)

    def card(self) -> Card:
        """What is open, and the menu."""
        relative, factor = self.noise
        remarks = [
            f"Of {self.readings} readings each, with noise of {percent(relative)}"
            + (f" and a factor of {percent(factor)} common to a scan" if factor else "")
            + "; standard errors by the linear model, with each parameter known within its range."
        ]
        remarks += [self._checked(check) for check in self.checks]
        remarks += [failure.sentence for failure in self.failures]
        return Card("What to measure next", self.sentences, (self.table(),), remarks)

    def _checked(self, check: SimulatedCheck) -> str:
        """What simulated fits say of a forecast."""
        words = next(one.words for one in self.forecasts if one.name == check.name)
        errors = ", ".join(f"{name} {_now(check.standard_errors[name])}" for name in self.targets)
        said = f"Checked by fits to simulated data with {words}: standard errors {errors}"
        if check.separation is not None:
            said += f"; the wrong minimum is {rounded(check.separation, 3)} higher"
        return f"{said}."

    def to_dict(self) -> dict:
        """Plain data."""
        fields = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name != "candidates"}
        return plain(fields | {"failures": [failure._asdict() for failure in self.failures]})


def plan_measurement(
    result: FitResult | JointResult,
    targets: Sequence[str] = (),
    readings: int = READINGS,
    seed: int = 0,
    progress: Progress | None = None,
) -> MeasurementPlan:
    """Rank further measurements by what they would determine.

    Parameters
    ----------
    result
        A fit of a measurement or of a project.
    targets
        Names of free parameters that are to be determined; empty: all.
    readings
        Number of readings of each further measurement.
    seed
        Of the noise with which the first two forecasts are checked.
    progress
        Called with the task, the step and 0.

    Raises
    ------
    InputRefusedError
        The fit did not end in a minimum, its noise is unknown, or a target is not free.

    References
    ----------
    Atkinson, Donev, Tobias 2007 Optimum Experimental Designs (A- and T-optimality).
    """
    require_integer("readings", readings, 1, 1_000_000)
    if not result.converged:
        raise InputRefusedError("the fit did not end in a minimum, so nothing can be forecast from it.")
    with computing():
        return _planned(Known.of(result), targets, readings, seed, progress or log_progress)


def _planned(
    known: Known, targets: Sequence[str], readings: int, seed: int, progress: Progress
) -> MeasurementPlan:
    for name in targets:
        if name not in known.free:
            raise InputRefusedError(
                f"{name} is no free parameter of the fit; targets are: {', '.join(known.free)}."
            )
    chosen = tuple(targets) or known.free
    noise, failures = NoiseOfKind.of(known), Failures()
    weak = np.eye(len(known.free)) / _RANGE_DEVIATION**2
    present = known.information(known.unit) + weak
    now = _errors(known, present)
    rivals = _rivals(known)
    items, found, programs = list(menu(known.base[0], known.project)), list[Forecast](), dict[str, Planned]()
    for number, candidate in enumerate(items, start=1):
        progress("forecast", StepOf(number, len(items)), 0.0)
        with failures.sparing("the forecast of {}", candidate.words):
            planned = Planned(candidate, known, noise, readings)
            _, slopes = planned.whitened(known.unit)
            then = _errors(known, present + slopes.T @ slopes)
            found.append(
                Forecast(
                    candidate.name,
                    candidate.words,
                    {name: then[name] for name in chosen},
                    float(np.exp(np.mean([np.log(now[name] / then[name]) for name in chosen]))),
                    _separated(known, planned, rivals),
                )
            )
            programs[candidate.name] = planned
    if not found:
        raise InputRefusedError("no further measurement of the menu can be predicted for this sample.")
    scale, unit = known.objective.scale, known.unit
    units = [rival for rival, _ in rivals]
    width = _RANGE_DEVIATION * np.abs(np.asarray(scale.slope(unit)))
    wide = dict(zip(known.free, width.tolist(), strict=True))
    found = _ranked(known, rivals, found, programs, progress)
    checks = list[SimulatedCheck]()
    for number, one in enumerate(found[:_CHECKED], start=1):
        progress("check by simulated fits", StepOf(number, _CHECKED), 0.0)
        with failures.sparing("the check of {}", one.words):
            checks.append(simulated_check(known, programs[one.name], units, seed))
    return MeasurementPlan(
        readings=readings,
        noise=(noise.relative, noise.scan_relative),
        targets={name: now[name] for name in chosen},
        disagreement=known.disagreement,
        undetermined=tuple(name for name in chosen if now[name] > (1 - _UNDETERMINED) * wide[name]),
        rivals=tuple(known.objective.numbers(rival) for rival, _ in rivals),
        separation=min((rise for _, rise in rivals), default=None),
        forecasts=tuple(found),
        checks=tuple(checks),
        failures=failures.found,
        candidates={name: planned.candidate for name, planned in programs.items()},
    )


def _higher(rise: float) -> str:
    return f"{rounded(rise, 3)} higher" if rise >= 0 else f"{rounded(-rise, 3)} lower"


def _now(error: float) -> str:
    return rounded(error, 2)


def _errors(known: Known, information: Float[np.ndarray, "parameters parameters"]) -> dict[str, float]:
    """Standard errors of the free parameters in their units."""
    deviation = np.sqrt(np.diag(np.linalg.inv(information)))
    slopes = np.abs(np.asarray(known.objective.scale.slope(known.unit)))
    return dict(zip(known.free, (deviation * slopes).tolist(), strict=True))


def _ranked(
    known: Known,
    rivals: Sequence[Rival],
    found: Sequence[Forecast],
    programs: dict[str, Planned],
    progress: Progress,
) -> list[Forecast]:
    """Forecasts in their order; without rivals by their gain, otherwise by what they separate.

    The order by separations takes the present minimum for the right one. The leading measurements are looked
    at for every minimum that may be right, and come in the order of their chance to decide.
    """
    if not rivals:
        return sorted(found, key=lambda one: -one.gain)
    found = sorted(found, key=lambda one: -(one.separation or 0.0))
    examined = list[Forecast]()
    for number, one in enumerate(found[:_MOST_EXAMINED], start=1):
        progress("chance to decide", StepOf(number, _MOST_EXAMINED), 0.0)
        examined.append(_examined(known, rivals, one, programs[one.name]))
    examined.sort(key=lambda one: (-(one.chance or 0.0), -(one.separation or 0.0)))
    return examined + found[_MOST_EXAMINED:]


def _examined(known: Known, rivals: Sequence[Rival], forecast: Forecast, planned: Planned) -> Forecast:
    """A forecast with its chance to decide.

    A minimum of both measurements need not be near one of the present alone: in a flat valley, they may meet
    elsewhere, so that a scan looks for more if the present one is right.
    """
    units = [known.unit, *(unit for unit, _ in rivals)]
    objective = simulated(known, planned, known.unit)
    apart = [rise for _, rise in _minima(objective, known.unit, _starts(known, objective))]
    assert forecast.separation is not None, "there are rivals"
    least = min([*apart, forecast.separation])
    weights, separations = [1.0], [least]
    for truth, rise in [rival for rival in rivals if rival[1] < COMPARABLE_RISE][:_MOST_RIGHT]:
        others = [unit for unit in units if unit is not truth]
        found = _minima(simulated(known, planned, truth), truth, others)
        weights.append(float(np.exp(-rise / 2)))
        separations.append(min((one for _, one in found), default=np.inf))
    decides = np.array(separations) >= COMPARABLE_RISE
    chance = float(np.average(decides, weights=weights))
    return dataclasses.replace(forecast, separation=least, chance=chance)


def _rivals(known: Known) -> list[Rival]:
    """Other minima that the present measurements exclude barely or not, lowest first.

    What a scan has only passed by is searched to its end first, which may be a minimum that is known already.
    """
    if known.minima is None:
        return []
    scale = known.objective.scale
    listed = [one for one in known.minima.found[1:] if one.rise < _NEAR_RISE][:_MOST_RIVALS]
    starts = [scale.to_unit(np.array([one.values[name] for name in known.free])) for one in listed]
    found = _minima(known.objective, known.unit, [*starts, *_starts(known, known.objective)])
    return [rival for rival in found if rival[1] < _NEAR_RISE][:_MOST_RIVALS]


def _starts(known: Known, objective: JointObjective) -> list[Float[np.ndarray, " parameters"]]:
    """Where a scan finds minima; none if no free parameter has several."""
    free = [known.project.parameters[name] for name in known.free]
    made = scan_of(objective, free, known.unit)
    return [] if made is None else made.starts


def _minima(
    objective: JointObjective,
    right: Float[np.ndarray, " parameters"],
    starts: Sequence[Float[np.ndarray, " parameters"]],
) -> list[Rival]:
    """Minima of an objective besides the right one, by their rise above it, lowest first."""
    programs = CompiledJointObjective(objective)
    lowest, found = programs.residual(right).loss, list[Rival]()
    # Each minimum with its Jacobian, in which a distance is one in standard errors.
    known = [(right, _jacobian(programs, right))]
    for start in starts:
        end = search(Descent(), programs, np.clip(start, 0.0, 1.0))
        apart = (np.sum((jacobian @ (end.unit - unit)) ** 2) for unit, jacobian in known)
        if end.outcome.converged and min(apart) >= 1:
            known.append((end.unit, _jacobian(programs, end.unit)))
            found.append((end.unit, end.loss - lowest))
    return sorted(found, key=lambda rival: rival[1])


def _jacobian(
    programs: CompiledJointObjective, unit: Float[np.ndarray, " parameters"]
) -> Float[np.ndarray, "residuals parameters"]:
    jacobian = programs.linearised(unit).jacobian
    assert jacobian is not None, "every measurement has one"
    return jacobian


def _separated(known: Known, planned: Planned, rivals: Sequence[Rival]) -> float | None:
    """Least chi-square of the rivals, all parameters refitted, on noise-free data of the present minimum."""
    if not rivals:
        return None
    programs = CompiledJointObjective(simulated(known, planned, known.unit))
    return min(search(Descent(), programs, unit).loss for unit, _ in rivals)
