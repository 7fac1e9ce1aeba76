"""The objective of a fit: the residual vector of one measurement."""

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Protocol, TypeVar, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.effects import model_at, tabulated
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.fitting.figures_of_merit import INTENSITIES, factor_of_points
from jaxink.fitting.scaling import UnitScale
from jaxink.measurement import FitNoise, GonioData, noise_of
from jaxink.sample import Parameter, ResidualWeight, Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig

OBJECTIVES: tuple[str, ...] = ("chi_square", "absolute", "relative", "logarithmic", *INTENSITIES)


@partial(jax.jit, static_argnames="n_scans")
def whiten_scans(
    residual: Float[Array, " points"],
    common: Float[Array, " points"],
    scan: Int[Array, " points"],
    n_scans: int,
) -> Float[Array, " points"]:
    """Whiten residuals r of covariance 1 + q q^T within each scan: (1 + q q^T)^(-1/2) r.

    Parameters
    ----------
    residual
        Residuals in units of the independent sigma.
    common
        q: effect of the scan's common factor on each point, in the same units.
    scan
        Number of the scan of each point.
    n_scans
        Number of scans.

    References
    ----------
    Woodbury identity; the symmetric root for a rank-one term is
    1 - (1 - 1/sqrt(1 + q^T q)) q q^T / q^T q.
    """
    square = jnp.zeros(n_scans).at[scan].add(common**2)
    along = jnp.zeros(n_scans).at[scan].add(common * residual)
    root = jnp.sqrt(1 + square)
    # (1 - 1/root) / square, without a division by zero if there is no common factor.
    factor = 1 / (root * (1 + root))
    return residual - common * (factor * along)[scan]


@runtime_checkable
class PredictingModel(Protocol):
    """What a fit needs of a model: a `ForwardModel`, one with effects, or several as one."""

    @property
    def config(self) -> SolverConfig:
        """Resolution of the solver."""

    @property
    def wavelengths_nm(self) -> tuple[float, ...]:
        """Wavelengths of the points, ascending."""

    @property
    def wavelength_of_point_nm(self) -> Float[np.ndarray, " points"]:
        """Wavelength of each point."""

    @property
    def n_stacks(self) -> int:
        """Number of stacks that one prediction solves."""

    def own_wavelengths(self, names: Collection[str]) -> dict[str, float]:
        """See `ForwardModel.own_wavelengths`."""

    def sizes(self, free_values: Mapping, accuracy: float, layer_method: str) -> SolverConfig:
        """See `ForwardModel.sizes`."""

    def bsdf(self, free_values: Mapping) -> Float[Array, " points"]:
        """Predicted BSDF at the points, 1/sr."""


class Objective(eqx.Module):
    """Residuals of a measurement with respect to a forward model, in variables scaled to [0, 1].

    Parameters
    ----------
    model
        Predicts the used points: a `ForwardModel`, or one with effects.
    measured, sigma
        Measured BSDF and its independent standard deviation, 1/sr, shape ``(points,)``.
    scan, n_scans, scan_relative
        Scan of each point, their number, and the standard deviation of their common factors.
    weight
        Square root of the weight of each point, times the factor of `jaxink.fitting.figures_of_merit`.
    scale
        Maps variables in [0, 1] to the free parameters.
    prior_weights, prior_mean, prior_deviation
        Knowledge apart from the measurement: weighted sums of the first parameters, with mean and standard
        deviation.
    constants, names
        Values and names of the parameters of the model that are neither free nor tied.
    kind
        One of `OBJECTIVES`.
    free
        Names of the free parameters.
    """

    __repr__ = brief_repr

    model: PredictingModel
    measured: Float[np.ndarray, " points"]
    sigma: Float[np.ndarray, " points"]
    scan: Int[np.ndarray, " points"]
    weight: Float[np.ndarray, " points"]
    scale: UnitScale
    prior_weights: Float[np.ndarray, "priors declared"]
    prior_mean: Float[np.ndarray, " priors"]
    prior_deviation: Float[np.ndarray, " priors"]
    constants: Float[np.ndarray, " names"]
    scan_relative: Float[np.ndarray, ""]
    names: tuple[str, ...] = eqx.field(static=True)
    n_scans: int = eqx.field(static=True)
    kind: str = eqx.field(static=True)
    free: tuple[str, ...] = eqx.field(static=True)

    def tabulated(self) -> "Objective":
        """The objective for a scan, which evaluates it thousands of times; see `ForwardModel.tabulated`."""
        return eqx.tree_at(lambda o: o.model, self, tabulated(self.model))

    @property
    def n_points(self) -> int:
        """Number of fitted points."""
        return len(self.measured)

    @property
    def n_rows(self) -> int:
        """Length of the residual vector."""
        return len(self.measured) + len(self.prior_mean)

    @property
    def n_stacks(self) -> int:
        """Number of stacks that one residual solves."""
        return self.model.n_stacks

    @property
    def resolution(self) -> SolverConfig:
        """Resolution of the solver."""
        return self.model.config

    def resolution_at(self, values: Mapping[str, float], accuracy: float, layer_method: str) -> SolverConfig:
        """Resolution that an accuracy needs at values of the parameters; never less than the present one."""
        return self.model.config.at_least(self.model.sizes(values, accuracy, layer_method))

    @property
    def variables(self) -> tuple[str | None, ...]:
        """Name of the parameter that each variable stands for; None for one without effect."""
        return self.free

    @property
    def directions_at_once(self) -> int | None:
        """Directional derivatives that one run of a program computes; None for all of a Jacobian."""
        return None

    def values(self, unit: Float[Array, " parameters"]) -> dict[str, Float[Array, ""]]:
        """Physical values of the free parameters from variables in [0, 1]."""
        return self.named(self.scale.to_physical(unit))

    def named(self, physical: Float[Array, " parameters"]) -> dict[str, Float[Array, ""]]:
        """Values by name of the free parameters in their units."""
        return {name: physical[i] for i, name in enumerate(self.free)}

    def given(self, physical: Float[Array, " parameters"]) -> dict[str, Float[Array, ""]]:
        """Values by name of all parameters that are not tied.

        The constants, too, are arguments of a compiled program, which therefore serves other values.
        """
        constants = jnp.asarray(self.constants)
        return {name: constants[i] for i, name in enumerate(self.names)} | self.named(physical)

    def numbers(self, unit: Float[np.ndarray, " parameters"]) -> dict[str, float]:
        """Physical values of the free parameters as plain numbers."""
        # By numpy, which neither compiles nor dispatches anything.
        physical = self.scale.to_physical(np.asarray(unit, float))
        return dict(zip(self.free, physical.tolist(), strict=True))

    def in_noise(
        self, predicted: Float[ArrayLike, " points"], change: Float[ArrayLike, " points"]
    ) -> Float[ArrayLike, " points"]:
        """A change of the prediction in units of the noise, unweighted."""
        # Even if the factor is zero: a compiled program takes it as an argument, whatever its value.
        scaled = change / self.sigma
        return whiten_scans(scaled, self.scan_relative * predicted / self.sigma, self.scan, self.n_scans)

    def residual(
        self, unit: Float[Array, " parameters"]
    ) -> tuple[Float[Array, " rows"], Float[Array, " points"]]:
        """Residual vector, whose sum of squares is minimised, and the prediction, 1/sr.

        The residual has one row for each point, then one for each prior and for each pair of neighbouring
        wavelengths of a parameter with a smoothness; free parameters are scaled to [0, 1]. A row of a point
        is what the objective makes of measured minus predicted; for ``chi_square`` it is in units of the
        noise, and independent of the other points of its scan, whose common factor `whiten_scans` removes.
        """
        return self.residual_at(self.scale.to_physical(unit))

    def residual_at(
        self, physical: Float[Array, " parameters"]
    ) -> tuple[Float[Array, " rows"], Float[Array, " points"]]:
        """As `residual`, from the free parameters in their units."""
        predicted = self.model.bsdf(self.given(physical))
        rows = self.rows(predicted)
        declared = physical[: self.prior_weights.shape[1]]
        prior = (self.prior_mean - self.prior_weights @ declared) / self.prior_deviation
        return jnp.concatenate([rows, prior]), predicted

    def rows(self, predicted: Float[ArrayLike, " points"]) -> Float[Array | np.ndarray, " points"]:
        """Weighted residual of each point for a prediction, 1/sr."""
        return self.weight * self._misfit(predicted)

    def _misfit(self, predicted):
        measured = self.measured
        n = len(measured)
        # Of an intensity, the weights contain the factor of each point.
        if self.kind == "absolute" or self.kind in INTENSITIES:
            return (measured - predicted) * np.sqrt(1 / n)
        if self.kind == "relative":
            return (measured - predicted) / (0.5 * (measured + predicted)) * np.sqrt(1 / n)
        if self.kind == "logarithmic":
            m, s = jnp.log(measured), jnp.log(jnp.maximum(predicted, 1e-300))
            return (m - s) / _away_from_zero(0.5 * (m + s)) * np.sqrt(1 / n)
        return self.in_noise(predicted, measured - predicted)


def _away_from_zero(value):
    """The symmetric mean of logarithms crosses zero at 1/sr; this avoids the division by zero."""
    return jnp.where(value >= 0, 1.0, -1.0) * jnp.maximum(jnp.abs(value), 1e-3)


def make_objective(
    data: GonioData,
    sample: Sample,
    kind: str = "chi_square",
    config=None,
    noise: FitNoise | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    layer_method: str = "fastest",
) -> Objective:
    """Objective for a measurement and a sample.

    Parameters
    ----------
    data
        The measurement; masked points are left out.
    sample
        The sample; its free parameters become the variables.
    kind
        One of `OBJECTIVES`.
    config
        Resolution of the solver; None to choose it for the accuracy.
    noise
        Noise; None for that of `jaxink.measurement.noise_of`.
    accuracy, layer_method
        See `ForwardModel`.

    Raises
    ------
    InputRefusedError
        No point is left, no parameter is free, or the objective cannot take the values.
    """
    require_one_of("objective", kind, OBJECTIVES)
    used = data.used
    if not used.any():
        raise InputRefusedError(
            f"{data.source or 'the measurement'}: the masks exclude every point; nothing can be fitted."
        )
    free = free_of(sample)
    noise = noise_of(data, sample.noise) if noise is None else noise
    require_even_scans(kind, sample.weights)
    require_positive(kind, data.bsdf_per_sr[used], "used points", "mask them")
    model = model_at(sample, data.used_directions, data.reading_order[used], config, accuracy, layer_method)
    names = tuple(p.name for p in free)
    return compose(
        Objective,
        model,
        data,
        sample,
        noise,
        constants_of(model.sample, names),
        kind=kind,
        scale=UnitScale.of(free),
        free=names,
    )


def free_of(sample: Sample) -> tuple[Parameter, ...]:
    """Free parameters of a sample, of which there must be one."""
    free = sample.parameters.free
    if not free:
        raise InputRefusedError(
            "no parameter of the sample is free; set free = true for those to be fitted, or use predict."
        )
    return free


def constants_of(sample: Sample, free: Collection[str]) -> dict[str, float]:
    """Values by name of the parameters that are neither free nor tied."""
    return {name: value for name, value in sample.parameters.untied.items() if name not in free}


def require_positive(kind: str, measured: Float[np.ndarray, " points"], what: str, remedy: str) -> None:
    """Reject values that an objective cannot take."""
    if kind in ("relative", "logarithmic") and np.any(measured <= 0):
        raise InputRefusedError(
            f"the objective '{kind}' needs positive values; {int(np.sum(measured <= 0))} {what} are "
            f"not: {remedy}, or choose chi_square."
        )


ObjectiveT = TypeVar("ObjectiveT", bound=Objective)


def compose(
    form: type[ObjectiveT],
    model: PredictingModel,
    data: GonioData,
    sample: Sample,
    noise: FitNoise,
    constants: Mapping[str, float],
    **fields,
) -> ObjectiveT:
    """Objective of any model of a sample: measured values, noise, weights and priors.

    Parameters
    ----------
    form
        Class of the objective.
    model
        Predicts the used points.
    data, sample, noise
        See `make_objective`; priors are those of the sample's free parameters, which come first.
    constants
        Values by name of the parameters that the variables do not stand for.
    **fields
        The other fields of the class.
    """
    used = data.used
    scan = data.used_scan_index
    weights, mean, deviation = priors_of(sample.parameters.free)
    return form(
        model=model,
        measured=data.bsdf_per_sr[used],
        sigma=np.asarray(noise.sigma_per_sr, float),
        scan=scan,
        weight=np.sqrt(weights_of(data, sample)) * factor_of_points(fields["kind"], data),
        prior_weights=weights,
        prior_mean=mean,
        prior_deviation=deviation,
        constants=np.array(list(constants.values()), float),
        names=tuple(constants),
        scan_relative=np.asarray(noise.scan_relative, float),
        n_scans=int(scan.max()) + 1,
        **fields,
    )


def priors_of(
    free: Sequence[Parameter],
) -> tuple[Float[np.ndarray, "priors declared"], Float[np.ndarray, " priors"], Float[np.ndarray, " priors"]]:
    """Weights, mean and standard deviation of what is known of free parameters and their differences."""
    unit = np.eye(len(free))
    known = [(unit[i], p.prior.mean, p.prior.standard_deviation) for i, p in enumerate(free) if p.prior]
    for i, (one, other) in enumerate(pairwise(free)):
        (stem, _, here), (other_stem, _, there) = one.name.partition("@"), other.name.partition("@")
        if one.smoothness is not None and stem == other_stem:
            steps = abs(float(there) - float(here)) / one.smoothness.over_nm
            known.append((unit[i + 1] - unit[i], 0.0, one.smoothness.change * np.sqrt(steps)))
    weights, mean, deviation = zip(*known, strict=True) if known else ((), (), ())
    return np.array(weights).reshape(-1, len(free)), np.array(mean), np.array(deviation)


def weights_of(data: GonioData, sample: Sample) -> Float[np.ndarray, " points"]:
    """Weight of the squared residual of each used point.

    Raises
    ------
    InputRefusedError
        The measurement lacks a column of weights, or it holds what is no weight; with the column and row.
    """
    weight = np.ones(int(data.used.sum()))
    settings = (data.theta_i_deg, data.theta_o_deg, data.wavelength_nm, data.is_transmission)
    for one in sample.weights:
        chosen = one.chosen(*(values[data.used] for values in settings))
        weight[chosen] *= one.weight
        if one.column is not None:
            weight[chosen] *= _column_of_weights(data, one.column)[chosen]
    return weight


def require_even_scans(kind: str, weights: Sequence[ResidualWeight]) -> None:
    """Reject weights that differ within a scan where its points have a common error.

    Raises
    ------
    InputRefusedError
        For the objective ``chi_square``.
    """
    if kind == "chi_square" and any(weight.differs_within_scans for weight in weights):
        raise InputRefusedError(
            "weights with theta_o_deg or column are for the objectives that do not know the noise "
            f"({', '.join(name for name in OBJECTIVES if name != kind)}); chi_square weighs points by their "
            "noise: state it in [noise] or a column sigma_per_sr, or mask points."
        )


def _column_of_weights(data: GonioData, column: str) -> Float[np.ndarray, " points"]:
    name = data.source or "the measurement"
    if column not in data.extra:
        others = ", ".join(data.extra) or "none"
        raise InputRefusedError(
            f"{name}: has no column '{column}', which weights.column names; it has these: {others}."
        )
    values = data.extra[column][data.used]
    is_number = np.issubdtype(values.dtype, np.number)
    wrong = ~(np.isfinite(values) & (values >= 0)) if is_number else np.ones(len(values), bool)
    if wrong.any():
        first = int(np.argmax(wrong))
        raise InputRefusedError(
            f"{name}, row {data.row[data.used][first]}: {column} is {values[first]}; "
            "a weight is a number, 0 or more."
        )
    return values.astype(float)
