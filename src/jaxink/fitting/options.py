"""Options of a fit."""

import dataclasses

from jaxink.errors import require_integer, require_kind, require_one_of
from jaxink.fitting.objective import OBJECTIVES
from jaxink.solver.accuracy import DEFAULT_ACCURACY, require_accuracy
from jaxink.solver.config import SolverConfig
from jaxink.solver.layer_response import LAYER_METHODS

METHODS = ("gradient", "simplex")


@dataclasses.dataclass(frozen=True)
class FitOptions:
    """Options of a fit.

    Parameters
    ----------
    method
        ``gradient``, or ``simplex`` (Nelder-Mead) as the baseline.
    objective
        ``chi_square``, ``absolute``, ``relative`` or ``logarithmic``.
    n_starts
        Number of starts of the gradient-based fit: that of the sample, and random ones.
    scan
        Whether to scan a free parameter along which the misfit has many minima (the particle radius), and to
        start from the lowest ones instead of the sample's own start.
    seed
        Of the random starts.
    profile
        ``auto``: for parameters that are weakly determined according to the covariance; ``all``; or ``none``.
    accuracy
        Largest relative error of the BSDF due to the discretisation. The resolution is chosen for it at the
        start, and again at the solution; if that requires a higher one, the fit continues with it.
    layer_method
        As of `SolverConfig`.
    config
        Resolution of the solver, instead of that for the accuracy.
    """

    method: str = "gradient"
    objective: str = "chi_square"
    n_starts: int = 1
    scan: bool = True
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
        require_integer("n_starts", self.n_starts, 1, 10_000)
        require_integer("seed", self.seed, 0)
        if self.config is not None:
            require_kind("config", self.config, SolverConfig)
