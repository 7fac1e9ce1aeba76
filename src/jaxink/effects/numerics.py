"""Effects of the solver's own discretisation."""

import dataclasses
from typing import ClassVar

from jaxink.effects.case import Case
from jaxink.effects.kinds import FinerDiscretisation
from jaxink.sample import Parameter
from jaxink.solver.config import SolverConfig

# Of the noise of a point, what no number of points at hand makes visible.
_FAR_BELOW = 0.05


@dataclasses.dataclass(frozen=True)
class _HalfAsManyAgain(FinerDiscretisation):
    """The solver's resolution is too low; the strength 1 is the step to one and a half times as many."""

    refined_sizes: ClassVar[tuple[str, ...]]
    sign = 0

    @classmethod
    def forms(cls, case: Case):
        """Unless the requested accuracy is far below the noise."""
        if case.accuracy < _FAR_BELOW * case.noise:
            return (
                f"the discretisation errs by {case.accuracy:g} at most, the noise of a point is "
                f"{case.noise:.2g} or more: its errors cannot be seen"
            )
        return (cls(),)

    @property
    def terms(self):
        """Share of the step."""
        return (Parameter(f"{self.name}.share", 0.0, True, -3.0, 3.0),)

    @property
    def settings(self):
        """The whole step."""
        return ({self.strength.name: 1.0},)

    def refined(self, config: SolverConfig) -> SolverConfig:
        """Half as many again."""
        finer = {size: round(1.5 * getattr(config, size)) for size in self.refined_sizes}
        return dataclasses.replace(config, **finer)


class SolverStreams(_HalfAsManyAgain):
    """Too few streams."""

    name, refined_sizes = "solver_streams", ("nodes_escaping", "nodes_trapped")
    statement = "the solver has too few streams"


class SolverMoments(_HalfAsManyAgain):
    """Too few moments of the phase function."""

    name, refined_sizes = "solver_moments", ("n_moments",)
    statement = "the solver cuts the phase function off too early"


class SolverOrders(_HalfAsManyAgain):
    """Too few azimuthal orders."""

    name, refined_sizes = "solver_orders", ("n_orders",)
    statement = "the solver has too few azimuthal orders"


NUMERICS = (SolverStreams, SolverMoments, SolverOrders)
