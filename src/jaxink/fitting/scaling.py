"""Variables between 0 and 1 for parameters between their minimum and maximum."""

from typing import overload

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxink.display.brief import brief_repr
from jaxink.sample import Parameter

# Below this share of a range the scale is linear instead of logarithmic: a range from 0 (or to 1) cannot be
# logarithmic throughout, and one over many decades would mostly resolve its smallest values.
_EVEN_SHARE = 0.01
# Ranges narrower than this ratio have a linear scale.
_NARROW = 3.0


class UnitScale(eqx.Module):
    """Monotone maps of the unit interval onto the ranges of parameters, with finite slopes at both ends.

    Parameters
    ----------
    minimum, maximum
        Ranges, shape ``(parameters,)``.
    even
        True for a linear scale.
    origin, first, ratio
        Otherwise a parameter is origin + first * ratio^u, with u in [0, 1].
    """

    __repr__ = brief_repr

    minimum: Float[np.ndarray, " parameters"]
    maximum: Float[np.ndarray, " parameters"]
    even: Bool[np.ndarray, " parameters"]
    origin: Float[np.ndarray, " parameters"]
    first: Float[np.ndarray, " parameters"]
    ratio: Float[np.ndarray, " parameters"]

    @classmethod
    def of(cls, parameters: tuple[Parameter, ...]) -> "UnitScale":
        """Scale of parameters, from their minimum, maximum and scale."""
        rows = []
        for p in parameters:
            near, far, pole, sign = {
                "log": (p.minimum, p.maximum, 0.0, 1.0),
                "one_minus": (1 - p.maximum, 1 - p.minimum, 1.0, -1.0),
                "linear": (1.0, 1.0, 0.0, 1.0),
            }[p.scale]
            offset = _EVEN_SHARE * far if near < _EVEN_SHARE * far else 0.0
            if near < 0 or far < _NARROW * near:
                rows.append((True, 0.0, 1.0, 1.0))
                continue
            origin = pole - sign * offset
            start, end = (p.minimum - origin, p.maximum - origin)
            rows.append((False, origin, start, end / start))
        return cls(
            np.array([p.minimum for p in parameters]),
            np.array([p.maximum for p in parameters]),
            *(np.array(column) for column in zip(*rows, strict=True)),
        )

    @overload
    def to_physical(self, unit: Float[Array, " parameters"]) -> Float[Array, " parameters"]: ...
    @overload
    def to_physical(self, unit: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " parameters"]: ...
    def to_physical(
        self, unit: Float[Array | np.ndarray, " parameters"]
    ) -> Float[Array | np.ndarray, " parameters"]:
        """Parameters for variables in [0, 1]; the ends map to minimum and maximum."""
        curved = self.origin + self.first * self.ratio**unit
        straight = self.minimum + unit * (self.maximum - self.minimum)
        # numpy arrays need no compilation.
        where = np.where if isinstance(unit, np.ndarray) else jnp.where
        return where(self.even, straight, curved)

    def to_unit(self, physical: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " parameters"]:
        """Variables in [0, 1] for parameters."""
        share = np.where(self.even, 2.0, (physical - self.origin) / self.first)
        curved = np.log(share) / np.log(np.where(self.even, 2.0, self.ratio))
        straight = (physical - self.minimum) / (self.maximum - self.minimum)
        return np.where(self.even, straight, curved)

    def slope(
        self, unit: Float[Array | np.ndarray, " parameters"]
    ) -> Float[Array | np.ndarray, " parameters"]:
        """Derivative of the parameters with respect to the variables."""
        curved = self.first * self.ratio**unit * np.log(self.ratio)
        where = np.where if isinstance(unit, np.ndarray) else jnp.where
        return where(self.even, self.maximum - self.minimum, curved)
