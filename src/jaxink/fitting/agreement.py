"""Whether the measurements of a joint fit agree, and which one pulls against the others."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.fitting.joint_objective import CompiledJointObjective, JointObjective
from jaxink.fitting.limits import Budget, SearchLimits
from jaxink.fitting.method import Method, search
from jaxink.fitting.outcome import Search
from jaxink.fitting.uncertainty import covariance
from jaxink.numerics.chi_square import probability_above
from jaxink.numerics.digits import percent, rounded, with_uncertainty

# Measurements that agree are called in disagreement this often.
DISAGREE = 1e-3
# The one that is left out is named if the others agree better than this.
AGREE = 0.01
# Singular values of a Jacobian with columns of length 1 below this share of the largest one say nothing.
_UNKNOWN = 1e-9
# Of what a measurement and all others determine, the others' share below which they determine nothing.
_DETERMINED_ELSEWHERE = 1e-6
# So many candidates are left out in turn by fits; the linear model finds them.
_CANDIDATES = 2
# Chi-square at which a measurement alone is met: readings that its parameters follow exactly have no noise
# left by which a search could tell its end.
_MET = 1e-3


@dataclasses.dataclass(frozen=True)
class PartMisfit:
    """One measurement in a joint fit, and fitted alone.

    Parameters
    ----------
    name
        The measurement.
    points
        Number of its fitted points.
    chi_square
        Its share of the chi-square of the joint fit.
    leverage
        Its share of the fitted parameters: the degrees of freedom that the joint fit has taken from its
        points, the trace of its block of the hat matrix.
    chi_square_alone
        Chi-square at the optimum of this measurement alone.
    parameters_alone
        Number of parameters, or of combinations of these, that it determines alone.
    chi_square_held_out
        Chi-square of its deviation from what the fit of all others predicts, with the covariance of this
        prediction added to its noise, by the linear model at the joint minimum; about its number of points
        if the model is right. None if nothing but this measurement determines one of its parameters.

    References
    ----------
    Allen 1974 Technometrics 16, 125 (predictions of what is held out, without further fits).
    """

    __repr__ = brief_repr

    name: str
    points: int
    chi_square: float
    leverage: float
    chi_square_alone: float
    parameters_alone: int
    chi_square_held_out: float | None = None

    @property
    def reduced_chi_square(self) -> float | None:
        """Chi-square in the joint fit per degree of freedom; None if there is none."""
        freedom = self.points - self.leverage
        return self.chi_square / freedom if freedom > 0 else None

    @property
    def reduced_held_out(self) -> float | None:
        """Chi-square of the deviation from what the others predict, per point."""
        return None if self.chi_square_held_out is None else self.chi_square_held_out / self.points

    @property
    def cost(self) -> float:
        """What the joint fit costs it, in chi-square."""
        return max(self.chi_square - self.chi_square_alone, 0.0)


@dataclasses.dataclass(frozen=True)
class OwnCause:
    """A parameter of one measurement alone, with which all measurements agree.

    Parameters
    ----------
    parameter
        Its name in the project: an effect of the instrument, or a thickness.
    value, standard_error, unit
        Fitted with all others.
    probability
        Of the disagreement that is left.
    """

    __repr__ = brief_repr

    parameter: str
    value: float
    standard_error: float | None
    unit: str
    probability: float

    @property
    def words(self) -> str:
        """Name, value and probability."""
        value = f"{with_uncertainty(self.value, self.standard_error)} {self.unit}".rstrip()
        return f"{self.parameter} = {value} ({_chance(self.probability)})"


@dataclasses.dataclass(frozen=True)
class Outlier:
    """A measurement that pulls against the others.

    Parameters
    ----------
    name
        The measurement.
    probability_without
        That of the disagreement among the others.
    parameter
        Which parameter it pulls most, in standard errors of the fit without it.
    value, value_without, standard_error_without
        Of this parameter.
    offset
        Mean of measured / predicted - 1 of the measurement, predicted from the fit of the others; None unless
        all values are positive.
    causes
        What would make it agree: one parameter of it alone, the best fit first.
    """

    __repr__ = brief_repr

    name: str
    probability_without: float
    parameter: str
    value: float
    value_without: float
    standard_error_without: float
    offset: float | None
    causes: tuple[OwnCause, ...] = ()

    @property
    def sentence(self) -> str:
        """For the user."""
        errors = abs(self.value - self.value_without) / self.standard_error_without
        words = (
            f"The measurement '{self.name}' pulls against the others, which agree without it "
            f"({_chance(self.probability_without)}): it moves {self.parameter} from "
            f"{rounded(self.value_without, 4)} to {rounded(self.value, 4)}, by {rounded(errors, 2)} standard "
            "errors."
        )
        if self.offset is not None:
            way = "above" if self.offset > 0 else "below"
            words += f" Its values are {percent(abs(self.offset))} {way} what the others predict, on average."
        if self.causes:
            listed = " or ".join(cause.words for cause in self.causes)
            words += f" All agree with one more free parameter, of this measurement alone: {listed}."
        return f"{words} Look at this measurement, its instrument and its sample before the model."


@dataclasses.dataclass(frozen=True)
class Agreement:
    """Whether the measurements of a joint fit agree.

    Parameters
    ----------
    chi_square
        Chi-square of the joint fit above the sum of the measurements' own minima.
    degrees_of_freedom
        Number of parameters that measurements determine more than once.
    scale
        Chi-square per degree of freedom of the measurements alone, at least 1: the disagreement that a model
        which does not fit any of them would cause anyway.
    probability
        That measurements which agree are so far apart; None if they share nothing.
    parts
        Each measurement.
    outlier
        The one that pulls against the others; None if they agree, or if it cannot be told.

    References
    ----------
    Maltoni, Schwetz 2003 Phys. Rev. D 68, 033020 (parameter goodness of fit).
    """

    __repr__ = brief_repr

    chi_square: float
    degrees_of_freedom: int
    scale: float
    probability: float | None
    parts: tuple[PartMisfit, ...]
    outlier: Outlier | None = None

    @property
    def disagrees(self) -> bool:
        """Whether the measurements are further apart than their noise allows."""
        return self.probability is not None and self.probability < DISAGREE

    @property
    def sentence(self) -> str:
        """For the user."""
        if self.probability is None:
            return "The measurements share no parameter that more than one of them determines."
        scaled = (
            f", of which {rounded(self.scale, 3)} a degree are the misfit of each alone"
            if self.scale > 1
            else ""
        )
        apart = (
            f"the joint fit is {rounded(self.chi_square, 3)} above their own minima in chi-square, for "
            f"{self.degrees_of_freedom} degrees of freedom{scaled} ({_chance(self.probability)})"
        )
        if not self.disagrees:
            return f"The measurements agree: {apart}."
        if self.outlier is not None:
            return f"The measurements disagree: {apart}. {self.outlier.sentence}"
        costs = sorted(self.parts, key=lambda part: -part.cost)[:2]
        most = " and ".join(f"'{part.name}' ({rounded(part.cost, 3)})" for part in costs)
        return (
            f"The measurements disagree: {apart}. The joint fit costs most in {most}; which of them is "
            "wrong, or what the model lacks, cannot be told from these measurements."
        )


def agreement(
    objective: JointObjective,
    names: Sequence[str],
    best: Search,
    method: Method,
    noise_freedom: float,
    measured: Sequence[Float[np.ndarray, "_"]],
) -> Agreement:
    """Compare the measurements of a joint fit by chi-square.

    Each is fitted alone, from the joint minimum. Which one to leave out is found by the linear model of the
    joint fit, so that the cost is that of one fit more; only if they disagree, the joint fits without the two
    likeliest ones follow.

    Parameters
    ----------
    objective
        At the final resolution.
    names
        Of the measurements.
    best
        The joint minimum.
    method
        Of the fits.
    noise_freedom
        Degrees of freedom of the noise, if it is an estimate.
    measured
        Values of each measurement.
    """
    programs = CompiledJointObjective(objective)
    at = programs.linearised(best.unit)
    assert at.jacobian is not None
    ends = np.cumsum([part.n_points for part in objective.parts])
    rows = np.split(at.residual, ends)
    blocks = np.split(at.jacobian, ends)
    bases = np.split(_basis(at.jacobian), ends)
    leverages = [float(np.sum(basis**2)) for basis in bases[:-1]]
    budget = Budget(SearchLimits(goal_loss=_MET))
    parts = []
    for i, name in enumerate(names):
        own = objective.positions[i]
        alone = search(method, programs.parts[i], best.unit[own], budget)
        parts.append(
            PartMisfit(
                name=name,
                points=objective.parts[i].n_points,
                chi_square=float(rows[i] @ rows[i]),
                leverage=leverages[i],
                chi_square_alone=min(alone.loss, float(rows[i] @ rows[i])),
                parameters_alone=_rank(blocks[i]),
                chi_square_held_out=_held_out(rows[i], bases[i]),
            )
        )
    compared = Comparison(tuple(parts), len(objective.prior_mean), noise_freedom)
    everything = range(len(parts))
    total = compared.of(float(best.loss), _rank(at.jacobian), everything)
    if not total.disagrees or len(parts) < 3:
        return total
    candidates = sorted(
        everything, key=lambda i: _lowest_by_linear_model(rows, blocks, i) + parts[i].chi_square_alone
    )
    found = [_without(objective, compared, i, best, method, measured[i]) for i in candidates[:_CANDIDATES]]
    agreeing = [one for one in found if one is not None]
    # Two that can be left out instead of each other cannot be told apart.
    if len(agreeing) != 1:
        return total
    return dataclasses.replace(total, outlier=agreeing[0])


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Compares the chi-square of joint fits with the measurements alone.

    Parameters
    ----------
    parts
        The measurements.
    n_priors
        Number of priors, each of which determines a parameter, too.
    noise_freedom
        Degrees of freedom of the noise, if it is an estimate.
    """

    parts: tuple[PartMisfit, ...]
    n_priors: int
    noise_freedom: float

    def with_parameters(self, loss: float, degrees_of_freedom: int) -> float | None:
        """Probability of the disagreement that is left with further parameters; None without freedom."""
        if degrees_of_freedom < 1:
            return None
        apart = max(loss - sum(part.chi_square_alone for part in self.parts), 0.0)
        return float(probability_above(apart / self.scale, degrees_of_freedom, self.noise_freedom))

    @property
    def scale(self) -> float:
        """Chi-square per degree of freedom of the measurements alone, at least 1."""
        alone = sum(part.chi_square_alone for part in self.parts)
        spare = sum(part.points - part.parameters_alone for part in self.parts)
        return max(alone / spare, 1.0) if spare > 0 else 1.0

    def of(self, loss: float, rank: int, chosen: Sequence[int]) -> Agreement:
        """Agreement of some measurements, of their joint minimum and the parameters that it determines."""
        some = dataclasses.replace(self, parts=tuple(self.parts[i] for i in chosen))
        apart = max(loss - sum(part.chi_square_alone for part in some.parts), 0.0)
        freedom = sum(part.parameters_alone for part in some.parts) + self.n_priors - rank
        probability = some.with_parameters(loss, freedom)
        return Agreement(apart, max(freedom, 0), some.scale, probability, some.parts)


def _chance(probability: float) -> str:
    """A probability that may be too small for a float."""
    return f"p = {rounded(probability, 2)}" if probability > 0 else "p < 1e-300"


def _without(
    objective: JointObjective,
    compared: Comparison,
    left_out: int,
    best: Search,
    method: Method,
    measured: Float[np.ndarray, " points"],
) -> Outlier | None:
    """The joint fit without a measurement: that measurement as an outlier if the others agree."""
    others = [i for i in range(len(objective.parts)) if i != left_out]
    programs = CompiledJointObjective(objective.only(others))
    refit = search(method, programs, best.unit)
    if refit.triangle is None or not refit.outcome.converged:
        return None
    rest = compared.of(refit.loss, _rank(refit.triangle), others)
    if rest.probability is not None and rest.probability < AGREE:
        return None
    assert refit.gradient is not None
    deviation = covariance(refit.triangle, refit.unit, refit.gradient).deviation
    shared = np.zeros(len(deviation), bool)
    shared[objective.positions[left_out]] = True
    known = shared & np.isfinite(deviation) & (deviation > 0)
    if not known.any():
        return None
    pulls = np.where(known, np.abs(best.unit - refit.unit) / np.where(known, deviation, 1.0), -1.0)
    position = int(np.argmax(pulls))
    name = objective.free[position]
    slope = abs(float(objective.scale.slope(refit.unit)[position]))
    own = objective.positions[left_out]
    # Parameters of this measurement alone keep their values: the others say nothing of them.
    unit = np.where(np.isfinite(deviation) & (deviation > 0), refit.unit, best.unit)
    predicted = CompiledJointObjective(objective).parts[left_out].predicted(unit[own])
    positive = bool(np.all(measured > 0) and np.all(predicted > 0))
    return Outlier(
        name=compared.parts[left_out].name,
        probability_without=1.0 if rest.probability is None else rest.probability,
        parameter=name,
        value=objective.numbers(best.unit)[name],
        value_without=objective.numbers(refit.unit)[name],
        standard_error_without=float(deviation[position]) * slope,
        offset=float(np.mean(measured / predicted - 1)) if positive else None,
    )


def _lowest_by_linear_model(
    rows: Sequence[Float[np.ndarray, "_"]],
    blocks: Sequence[Float[np.ndarray, "_ parameters"]],
    left_out: int,
) -> float:
    """Chi-square that all but one measurement would reach by a linear step from the joint minimum."""
    residual = np.concatenate([one for i, one in enumerate(rows) if i != left_out])
    jacobian = np.concatenate([one for i, one in enumerate(blocks) if i != left_out])
    basis = _basis(jacobian)
    along = basis.T @ residual
    return float(residual @ residual - along @ along)


def _basis(jacobian: Float[np.ndarray, "rows parameters"]) -> Float[np.ndarray, "rows rank"]:
    """Orthonormal basis of what the parameters can change."""
    norms = np.linalg.norm(jacobian, axis=0)
    left, singular, _ = np.linalg.svd(jacobian / np.where(norms > 0, norms, 1.0), full_matrices=False)
    return left[:, singular > _UNKNOWN * max(singular[0], np.finfo(float).tiny)]


def _rank(jacobian: Float[np.ndarray, "rows parameters"]) -> int:
    """Number of combinations of parameters that residuals determine better than the ranges of these."""
    return int(np.sum(np.linalg.svd(jacobian, compute_uv=False) > 1.0))


def _held_out(residual: Float[np.ndarray, " rows"], basis: Float[np.ndarray, "rows rank"]) -> float | None:
    """R' (1 - H)^-1 r of a measurement's block H of the hat matrix, whose basis is given."""
    left, singular, _ = np.linalg.svd(basis, full_matrices=False)
    rest = 1 - singular**2
    if np.min(rest, initial=1.0) < _DETERMINED_ELSEWHERE:
        return None
    return float(residual @ residual + np.sum((left.T @ residual) ** 2 * singular**2 / rest))
