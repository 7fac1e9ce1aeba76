"""What to measure next, ranked by what it would determine; its forecast checked by simulated fits."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError, require_integer
from jaxink.files.encoding import plain
from jaxink.fitting import FitResult, JointResult
from jaxink.numerics.digits import percent, rounded
from jaxink.numerics.failures import Failure, Failures
from jaxink.numerics.precision import computing
from jaxink.numerics.progress import Progress, StepOf, log_progress
from jaxink.planning.forecast import NoiseOfKind, Planned
from jaxink.planning.known import RANGE_DEVIATION, KnownFit
from jaxink.planning.menu import Candidate, menu
from jaxink.planning.rivals import Rival, chance_to_decide, rivals_of, separated
from jaxink.planning.simulation import SimulatedCheck, simulated_check
from jaxink.planning.valley import valley

READINGS = 100
_UNDETERMINED = 0.2
_CHECKED = 2
# Leading forecasts that are examined for every minimum that may be right.
_MOST_EXAMINED = 4


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
    ranges
        Least and largest standard error over the values that parameters may have which the present
        measurements do not determine; empty if they determine all.
    """

    __repr__ = brief_repr

    name: str
    words: str
    standard_errors: dict[str, float]
    gain: float
    separation: float | None
    chance: float | None = None
    ranges: dict[str, tuple[float, float]] = dataclasses.field(default_factory=dict)

    def error(self, name: str) -> str:
        """The standard error of a target, with its range."""
        error = rounded(self.standard_errors[name], 2)
        if name not in self.ranges:
            return error
        least, largest = (rounded(end, 2) for end in self.ranges[name])
        return error if least == largest else f"{error} ({least} to {largest})"


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
        errors = "; ".join(
            f"{name} to {best.error(name)}, now {_now(self.targets[name])}" for name in best.standard_errors
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
            rows.append([*row, *(one.error(name) for name in names)])
        return CardTable(heads, rows)

    def card(self) -> Card:
        """What is open, and the menu."""
        relative, factor = self.noise
        remarks = [
            f"Of {self.readings} readings each, with noise of {percent(relative)}"
            + (f" and a factor of {percent(factor)} common to a scan" if factor else "")
            + "; standard errors by the linear model, with each parameter known within its range."
        ]
        if self.undetermined:
            remarks.append(
                "In brackets: from the least to the largest standard error over the values that "
                f"{', '.join(self.undetermined)} may have."
            )
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
        return _planned(KnownFit.of(result), targets, readings, seed, progress or log_progress)


def _planned(
    known: KnownFit, targets: Sequence[str], readings: int, seed: int, progress: Progress
) -> MeasurementPlan:
    for name in targets:
        if name not in known.free:
            raise InputRefusedError(
                f"{name} is no free parameter of the fit; targets are: {', '.join(known.free)}."
            )
    chosen = tuple(targets) or known.free
    noise, failures = NoiseOfKind.of(known), Failures()
    weak = np.eye(len(known.free)) / RANGE_DEVIATION**2
    now = _errors(known, known.information(known.unit) + weak, known.unit)
    width = RANGE_DEVIATION * np.abs(np.asarray(known.objective.scale.slope(known.unit)))
    wide = dict(zip(known.free, width.tolist(), strict=True))
    undetermined = tuple(name for name in chosen if now[name] > (1 - _UNDETERMINED) * wide[name])
    # The information of the present measurements at each point where the truth may be.
    places = [(unit, known.information(unit) + weak) for unit in valley(known, undetermined)]
    rivals = rivals_of(known)
    items, found, programs = list(menu(known.base[0], known.project)), list[Forecast](), dict[str, Planned]()
    for number, candidate in enumerate(items, start=1):
        progress("forecast", StepOf(number, len(items)), 0.0)
        with failures.sparing("the forecast of {}", candidate.words):
            planned = Planned(candidate, known, noise, readings)
            errors = list[dict[str, float]]()
            for unit, present in places:
                _, slopes = planned.whitened(unit)
                errors.append(_errors(known, present + slopes.T @ slopes, unit))
            then = errors[0]
            found.append(
                Forecast(
                    candidate.name,
                    candidate.words,
                    {name: then[name] for name in chosen},
                    float(np.exp(np.mean([np.log(now[name] / then[name]) for name in chosen]))),
                    separated(known, planned, rivals),
                    ranges=_ranges(errors, chosen) if undetermined else {},
                )
            )
            programs[candidate.name] = planned
    if not found:
        raise InputRefusedError("no further measurement of the menu can be predicted for this sample.")
    units = [rival for rival, _ in rivals]
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
        undetermined=undetermined,
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


def _errors(
    known: KnownFit,
    information: Float[np.ndarray, "parameters parameters"],
    unit: Float[np.ndarray, " parameters"],
) -> dict[str, float]:
    """Standard errors of the free parameters in their units, at a point."""
    deviation = np.sqrt(np.diag(np.linalg.inv(information)))
    slopes = np.abs(np.asarray(known.objective.scale.slope(unit)))
    return dict(zip(known.free, (deviation * slopes).tolist(), strict=True))


def _ranges(errors: Sequence[dict[str, float]], names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """The least and the largest of each over several points."""
    return {name: (min(at[name] for at in errors), max(at[name] for at in errors)) for name in names}


def _ranked(
    known: KnownFit,
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
        assert one.separation is not None, "there are rivals"
        separation, chance = chance_to_decide(known, rivals, programs[one.name], one.separation)
        examined.append(dataclasses.replace(one, separation=separation, chance=chance))
    examined.sort(key=lambda one: (-(one.chance or 0.0), -(one.separation or 0.0)))
    return examined + found[_MOST_EXAMINED:]
