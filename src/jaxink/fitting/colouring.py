"""Parameters that share a directional derivative, because no residual depends on two of them.

A parameter given at one wavelength affects the residuals of that wavelength alone. The derivatives by one
such parameter of each wavelength follow from a single derivative along their common direction. The cost of a
Jacobian is then proportional to the number of wavelengths, not to its square. The colours follow from what
affects what, so that any groups of residuals with parameters of their own are served.
"""

from collections.abc import Sequence
from itertools import count

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxink.fitting.objective import Objective, PredictingModel


class Colouring(eqx.Module):
    """A colour for each parameter; those of one colour affect different residuals.

    Parameters
    ----------
    seeds
        Direction of each colour: 1 for its parameters, shape ``(colours, parameters)``; zeros follow, up to
        whole runs of a program.
    colour
        Colour of each parameter; 0 for one without any.
    affects
        Whether a residual depends on a parameter, shape ``(rows, parameters)``; None if all of them do.
    own_nm
        The only wavelength that a parameter affects; nan if there are several.
    n_runs
        Runs of a program that compute all directions.

    References
    ----------
    Curtis, Powell, Reid 1974 J. Inst. Math. Appl. 13, 117.
    """

    seeds: Float[np.ndarray, "colours parameters"]
    colour: Int[np.ndarray, " parameters"]
    affects: Bool[np.ndarray, "rows parameters"] | None
    own_nm: Float[np.ndarray, " parameters"]
    n_runs: int = eqx.field(static=True)

    @classmethod
    def of(cls, objective: Objective) -> "Colouring":
        """Colouring of the variables of an objective."""
        names = objective.variables
        affects, own_nm = _affected(objective)
        colour = colours(affects)
        assigned = np.flatnonzero([name is not None for name in names])
        n_colours = 1 + int(max(colour[assigned], default=0))
        at_once = objective.directions_at_once or n_colours
        n_runs = -(-n_colours // at_once)
        seeds = np.zeros((n_runs * at_once, len(names)))
        seeds[colour[assigned], assigned] = 1.0
        everything = np.all(np.isnan(own_nm)) and len(assigned) == len(names)
        return cls(seeds, colour, None if everything else affects, own_nm, n_runs)

    def expand_at(
        self, slopes: Float[np.ndarray, " colours"], wavelength_nm: float
    ) -> Float[np.ndarray, " parameters"]:
        """Derivatives, by each parameter, of a number at one wavelength from those along each colour."""
        affects = np.isnan(self.own_nm) | (self.own_nm == wavelength_nm)
        return np.where(affects, slopes[self.colour], 0.0)

    def expand(
        self, slopes: Float[Array | np.ndarray, "rows colours"]
    ) -> Float[Array | np.ndarray, "rows parameters"]:
        """Derivatives by each parameter from those along each colour."""
        columns = slopes[:, self.colour]
        if self.affects is None:
            return columns
        where = np.where if isinstance(columns, np.ndarray) else jnp.where
        return where(self.affects, columns, 0.0)


def colours(affects: Bool[np.ndarray, "rows parameters"]) -> Int[np.ndarray, " parameters"]:
    """Colours, from 0, of which no residual depends on two parameters; the first one free for each in turn.

    Parameters
    ----------
    affects
        Whether a residual depends on a parameter.
    """
    pattern = affects.astype(np.float32)
    meets = pattern.T @ pattern > 0
    colour = np.zeros(affects.shape[1], int)
    for i, others in enumerate(meets):
        taken = set(colour[:i][others[:i]])
        colour[i] = next(c for c in count() if c not in taken)
    return colour


def points_affected(
    model: PredictingModel, names: Sequence[str | None]
) -> tuple[Bool[np.ndarray, "points parameters"], Float[np.ndarray, " parameters"]]:
    """Whether the prediction at a point depends on each parameter; and their only wavelengths, or nan."""
    own = model.own_wavelengths([name for name in names if name is not None])
    own_nm = np.array([own.get(name or "", np.nan) for name in names])
    everywhere = np.isnan(own_nm) & np.array([name is not None for name in names], bool)
    return (model.wavelength_of_point_nm[:, None] == own_nm) | everywhere, own_nm


def _affected(objective: Objective):
    """The same for all residuals: points, and terms beside those of the points."""
    of_points, own_nm = points_affected(objective.model, objective.variables)
    of_priors = np.zeros((len(objective.prior_mean), len(own_nm)), bool)
    declared = objective.prior_weights.shape[1]
    of_priors[:, :declared] = objective.prior_weights != 0
    return np.concatenate([of_points, of_priors]), own_nm
