"""Parameters that share a directional derivative, because no residual depends on two of them.

A parameter given at one wavelength affects the residuals of that wavelength alone. The derivatives by one
such parameter of each wavelength follow from a single derivative along their common direction. The cost of a
Jacobian is then proportional to the number of wavelengths, not to its square.
"""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from itertools import combinations, count

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxink.fitting.objective import Objective


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
        own = objective.model.own_wavelengths([name for name in names if name is not None])
        colour = colours(names, own, _joined(objective))
        assigned = np.flatnonzero([name is not None for name in names])
        n_colours = 1 + int(max(colour[assigned], default=0))
        at_once = objective.directions_at_once or n_colours
        n_runs = -(-n_colours // at_once)
        seeds = np.zeros((n_runs * at_once, len(names)))
        seeds[colour[assigned], assigned] = 1.0
        own_nm = np.array([own.get(name or "", np.nan) for name in names])
        if not own and len(assigned) == len(names):
            return cls(seeds, colour, None, own_nm, n_runs)
        return cls(seeds, colour, _affected(objective, own_nm), own_nm, n_runs)

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


def colours(
    names: Sequence[str | None], own: Mapping[str, float], joined: Collection[tuple[int, int]] = ()
) -> Int[np.ndarray, " parameters"]:
    """Colours, from 0, of parameters of which some affect their own wavelength only; 0 for None.

    Parameters
    ----------
    names
        The parameters.
    own
        Wavelength by name.
    joined
        Pairs of positions, ascending, of parameters of different wavelengths that share a residual.
    """
    shared = [name for name in names if name is not None and name not in own]
    number: dict[str | None, int] = {name: i for i, name in enumerate(shared)}
    taken: dict[float, set[int]] = defaultdict(set)
    neighbours: dict[int, list[int]] = defaultdict(list)
    for first, second in joined:
        neighbours[second].append(first)
    for i, name in enumerate(names):
        if name is not None and name in own:
            excluded = taken[own[name]] | {number[names[k]] for k in neighbours[i]}
            number[name] = next(c for c in count(len(shared)) if c not in excluded)
            taken[own[name]].add(number[name])
    return np.array([0 if name is None else number[name] for name in names])


def _joined(objective: Objective) -> list[tuple[int, int]]:
    """Positions of two parameters that one term beside those of the points depends on."""
    rows = [np.flatnonzero(row) for row in objective.prior_weights]
    return [(int(a), int(b)) for row in rows for a, b in combinations(row, 2)]


def _affected(
    objective: Objective, own_nm: Float[np.ndarray, " parameters"]
) -> Bool[np.ndarray, "rows parameters"]:
    """Whether the residual of a point, or a term beside those of the points, depends on a parameter."""
    everywhere = np.isnan(own_nm) & [name is not None for name in objective.variables]
    of_points = objective.model.wavelength_of_point_nm[:, None] == own_nm
    of_priors = np.zeros((len(objective.prior_mean), len(own_nm)), bool)
    of_priors[:, : objective.prior_weights.shape[1]] = objective.prior_weights != 0
    return np.concatenate([of_points, of_priors]) | everywhere
