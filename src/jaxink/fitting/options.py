"""Options of a fit."""

import dataclasses
from collections.abc import Mapping

from jaxink.display.brief import brief_repr
from jaxink.errors import (
    InputRefusedError,
    require_by_name,
    require_integer,
    require_kind,
    require_one_of,
    require_positive,
)
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.limits import SearchLimits
from jaxink.fitting.method import Method
from jaxink.fitting.objective import OBJECTIVES
from jaxink.solver import DEFAULT_ACCURACY, LAYER_METHODS, SolverConfig, require_accuracy


@dataclasses.dataclass(frozen=True)
class FitOptions:
    """Options of a fit.

    Parameters
    ----------
    method
        ``gradient``: jaxink's own; ``simplex`` (Nelder-Mead) is the baseline. The others, of scipy and of
        optimistix, are for comparison; their names are the keys of `jaxink.fitting.METHODS`.
    objective
        ``chi_square``, ``absolute``, ``relative``, ``logarithmic``, ``intensity`` or ``photometric``.
    starts
        Number of starts: that of the sample, and random ones. The result tells how many of them ended in
        which minimum.
    scan
        Whether to scan a free parameter along which the misfit has many minima (the particle radius) by the
        gradient method, and to start from the lowest ones instead of the sample's own start. None: before
        the gradient method only.
    max_steps
        Largest number of steps of each search.
    max_evaluations
        Largest number of evaluations of the model by the scan and all searches together, of which a Jacobian
        is one.
    max_seconds
        Longest run time of the scan and all searches together, without compilation. If neither this nor
        another limit is given, a search is limited to 200 steps, or to 2000 evaluations by a method without
        derivatives. Profile likelihoods, which follow a search that has converged, are not limited.
    goal
        Root mean square residual at which to stop: the RMSD of the objective, in 1/sr for ``absolute`` and a
        fraction for ``relative`` and ``logarithmic``; in standard deviations of the noise for ``chi_square``.
    simplex_steps
        Of the simplex: how far its first corner along a parameter is from the start, by name, in the unit of
        the parameter, and the other way if that is out of its range. By default scipy's step, 5 % of the
        distance of the start from the lower end of the range.
    seed
        Of the random starts, and of methods that draw random numbers.
    profile
        ``auto``: for parameters that are weakly determined according to the covariance, the 6 weakest if
        there are more; ``all``; or ``none``.
    accuracy
        Largest relative error of the BSDF due to the discretisation. The resolution is chosen for it at the
        start, and again at the solution; if that requires a higher one, the fit continues with it.
    layer_method
        See `SolverConfig`.
    config
        Resolution of the solver, instead of that for the accuracy.
    """

    __repr__ = brief_repr

    method: str = "gradient"
    objective: str = "chi_square"
    starts: int = 1
    scan: bool | None = None
    max_steps: int | None = None
    max_evaluations: int | None = None
    max_seconds: float | None = None
    goal: float | None = None
    simplex_steps: Mapping[str, float] | None = None
    seed: int = 0
    profile: str = "auto"
    accuracy: float = DEFAULT_ACCURACY
    layer_method: str = "fastest"
    config: SolverConfig | None = None

    def __post_init__(self):
        for name, allowed in (
            ("method", METHODS),
            ("objective", OBJECTIVES),
            ("profile", ("auto", "all", "none")),
            ("layer_method", ("fastest", *LAYER_METHODS)),
        ):
            require_one_of(name, getattr(self, name), allowed)
        require_accuracy(self.accuracy)
        require_integer("starts", self.starts, 1, 10_000)
        require_integer("seed", self.seed, 0)
        for name in ("max_steps", "max_evaluations"):
            if getattr(self, name) is not None:
                require_integer(name, getattr(self, name), 1)
        for name in ("max_seconds", "goal"):
            if getattr(self, name) is not None:
                require_positive(name, getattr(self, name))
        if self.simplex_steps is not None:
            self._require_steps(self.simplex_steps)
        if self.config is not None:
            require_kind("config", self.config, SolverConfig)

    def _require_steps(self, steps: Mapping[str, float]) -> None:
        require_by_name("simplex_steps", steps, {"ink.scattering_per_mm": 10})
        if self.method != "simplex":
            raise InputRefusedError(
                f"simplex_steps are given, but method is '{self.method}'; choose method 'simplex', or leave "
                "them out."
            )
        for name, step in steps.items():
            require_positive(f"simplex_steps of {name}", step)

    def make_method(self) -> Method:
        """The method of the searches."""
        return METHODS[self.method](self.seed)

    @property
    def scans_first(self) -> bool:
        """Whether a scan precedes the searches if a free parameter calls for it."""
        return self.method == "gradient" if self.scan is None else self.scan

    def limits(self, n_points: int) -> SearchLimits:
        """Limits of the searches of a fit.

        Parameters
        ----------
        n_points
            Number of fitted points, over which chi-square is averaged.
        """
        goal_loss = None
        if self.goal is not None:
            goal_loss = self.goal**2 * (n_points if self.objective == "chi_square" else 1)
        return SearchLimits(self.max_steps, self.max_evaluations, self.max_seconds, goal_loss)
