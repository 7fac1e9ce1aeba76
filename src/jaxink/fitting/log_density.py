"""The posterior density of the free parameters, for samplers and optimisers of one's own."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError, no_such_name, require_by_name, shown
from jaxink.fitting.fitted_parameters import FittedCovariance
from jaxink.fitting.objective import Objective
from jaxink.numerics.precision import require_float64

# Standard deviation, in the logit of the share of the range, of a parameter without a standard error; that of
# a uniform distribution over the range is 1.8.
_WIDE = 1.5
# A fitted value at a bound is moved inside by this share of the range.
_INSIDE = 1e-4
# Smallest eigenvalue of a correlation matrix relative to the largest, so that its root has an inverse.
_LEAST = 1e-12


class LogDensity(eqx.Module):
    """Logarithm of likelihood times priors, a differentiable function of the free parameters.

    The likelihood is that of normally distributed readings with the covariance of the fit: independent
    standard deviations and a factor common to each scan, proportional to the prediction, whose determinant is
    included. A weight of the sample file divides the covariance of its points. Parameters without a prior
    have a constant one over their range. The density is not divided by the evidence.

    Samplers need coordinates without bounds, correlations or scales: `from_whitened` maps them to values, so
    that the posterior is close to a standard normal distribution where the fit's covariance describes it.

    Parameters
    ----------
    objective
        Chi-square of the measurement.
    centre, root
        Fitted values in logits of the share of the range, and a square root of their covariance.
    held
        Names and values of the parameters that are fixed or tied.
    """

    objective: Objective
    centre: Float[np.ndarray, " parameters"]
    root: Float[np.ndarray, "parameters parameters"]
    held: tuple[tuple[str, float], ...] = eqx.field(static=True)

    __repr__ = brief_repr
    # By identity: arrays have no hash, and `jax.jit` of a method needs one.
    __hash__ = object.__hash__

    @classmethod
    def of(
        cls, objective: Objective, fitted: Mapping[str, float], covariance: FittedCovariance
    ) -> "LogDensity":
        """Density of an objective, with coordinates from the values and the covariance of a fit."""
        unit = objective.scale.to_unit(np.array([fitted[name] for name in objective.free]))
        unit = np.clip(unit, _INSIDE, 1 - _INSIDE)
        # Derivative of the parameters by the logits.
        slope = np.abs(objective.scale.slope(unit)) * unit * (1 - unit)
        known = [objective.free.index(name) for name in covariance.names]
        matrix = np.diag(np.full(unit.size, _WIDE**2))
        matrix[np.ix_(known, known)] = covariance.matrix / np.outer(slope[known], slope[known])
        held = tuple((name, value) for name, value in fitted.items() if name not in objective.free)
        return cls(objective, np.log(unit / (1 - unit)), _root(matrix), held)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters, in order."""
        return self.objective.free

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Range of each free parameter; the density is 0 outside."""
        scale = self.objective.scale
        ends = zip(scale.minimum.tolist(), scale.maximum.tolist(), strict=True)
        return dict(zip(self.free, ends, strict=True))

    def __call__(self, values: Mapping[str, ArrayLike]) -> Float[Array, ""]:
        """Logarithm of the density by the parameters in their units.

        Parameters
        ----------
        values
            Value of every free parameter, by name. Fixed and tied parameters may be there at the values of
            the fit, as in ``result.values``; they are ignored, and tied ones follow their ties.

        Raises
        ------
        InputRefusedError
            The values are not given by name, a free parameter is missing, a name is unknown, or a fixed or
            tied parameter has another value than that of the fit, or one that JAX traces.
        PrecisionError
            If JAX uses 32 bits.
        """
        require_by_name("values", values, dict(zip(self.free, self._fitted(), strict=True)))
        held = dict(self.held)
        for name in values:
            if name in held:
                self._require_held(name, values[name], held[name])
            elif name not in self.free:
                raise InputRefusedError(f"a value is given for {name}, {no_such_name(self.free)}")
        for name in self.free:
            if name not in values:
                raise InputRefusedError(f"{name} has no value; the log density needs every free parameter.")
        require_float64()
        return self._at(jnp.stack([jnp.asarray(values[name], float) for name in self.free]))

    def from_whitened(self, whitened: Float[ArrayLike, " parameters"]) -> dict[str, Float[Array, ""]]:
        """Values of the free parameters from whitened coordinates; zeros give the fitted values."""
        physical = self.objective.scale.to_physical(jax.nn.sigmoid(self._logits(whitened)))
        return {name: physical[i] for i, name in enumerate(self.free)}

    def to_whitened(self, values: Mapping[str, ArrayLike]) -> Float[np.ndarray, " parameters"]:
        """Inverse of `from_whitened`."""
        unit = self.objective.scale.to_unit(np.array([np.asarray(values[n], float) for n in self.free]))
        return np.linalg.solve(self.root, np.log(unit / (1 - unit)) - self.centre)

    def whitened(self, whitened: Float[ArrayLike, " parameters"]) -> Float[Array, ""]:
        """Logarithm of the density by the whitened coordinates, including the Jacobian of the map.

        Raises
        ------
        PrecisionError
            If JAX uses 32 bits.
        """
        require_float64()
        unit, scale = jax.nn.sigmoid(self._logits(whitened)), self.objective.scale
        volume = jnp.log(jnp.abs(scale.slope(unit)) * unit * (1 - unit)).sum()
        return self._at(jnp.asarray(scale.to_physical(unit))) + volume + np.linalg.slogdet(self.root)[1]

    def _require_held(self, name: str, value: ArrayLike, fitted: float) -> None:
        """Reject a value of a fixed or tied parameter that would be ignored although it says something."""
        kind = "fixed" if name in self.objective.names else "tied"
        state = f"{name} is {kind} and was {fitted:g} in the fit"
        if isinstance(value, jax.core.Tracer):
            raise InputRefusedError(
                f"{state}, but JAX traces a value of it, on which the log density does not depend; give the "
                f"free parameters only: {', '.join(self.free)}."
            )
        if not np.allclose(value, fitted, rtol=1e-9, atol=0):
            raise InputRefusedError(
                f"{state}; the log density cannot have it at {shown(value)}: leave it out, or set free = "
                "true for it in the sample file and fit again."
            )

    def _fitted(self) -> list[float]:
        unit = 1 / (1 + np.exp(-self.centre))
        return np.asarray(self.objective.scale.to_physical(unit)).tolist()

    def _logits(self, whitened):
        return self.centre + self.root @ jnp.asarray(whitened)

    def _at(self, physical: Float[Array, " parameters"]) -> Float[Array, ""]:
        goal = self.objective
        rows, predicted = goal.residual_at(physical)
        inside = jnp.all((physical >= goal.scale.minimum) & (physical <= goal.scale.maximum))
        density = -0.5 * jnp.sum(rows**2) - self._log_norm() - 0.5 * self._log_determinant(predicted)
        return jnp.where(inside, density, -jnp.inf)

    def _log_norm(self) -> float:
        """Logarithm of the normalisation by independent noise and by the priors."""
        goal = self.objective
        counted = goal.weight > 0
        deviations = [goal.sigma[counted] / goal.weight[counted], goal.prior_deviation]
        return float(np.sum(np.log(np.sqrt(2 * np.pi) * np.concatenate(deviations))))

    def _log_determinant(self, predicted):
        """Logarithm of the determinants of 1 + q q^T, as in `whiten_scans`."""
        goal = self.objective
        square = (goal.scan_relative * predicted / goal.sigma) ** 2 * (goal.weight > 0)
        return jnp.log1p(jnp.zeros(goal.n_scans).at[goal.scan].add(square)).sum()


def _root(matrix: np.ndarray) -> np.ndarray:
    """A matrix whose product with its transpose is the covariance, with scale and correlations apart."""
    deviation = np.minimum(np.sqrt(np.diag(matrix)), _WIDE)
    wide = np.sqrt(np.diag(matrix))
    values, vectors = np.linalg.eigh(matrix / np.outer(wide, wide))
    return deviation[:, None] * vectors * np.sqrt(np.maximum(values, _LEAST * values[-1]))
