"""Effects of the solver's resolution."""

import dataclasses
from typing import ClassVar

from jaxink.effects.case import Case
from jaxink.effects.kinds import FinerDiscretisation
from jaxink.sample import terms_of
from jaxink.solver import SolverConfig

# Share of the noise of a point below which no realistic number of points reveals an error.
_FAR_BELOW = 0.05


@dataclasses.dataclass(frozen=True)
class _HalfAsManyAgain(FinerDiscretisation):
    """The solver's resolution is too low; strength 1 is a step to one and a half times as many."""

    refined_sizes: ClassVar[tuple[str, ...]]
    may_be_negative = True

    @classmethod
    def forms(cls, case: Case):
        if case.accuracy < _FAR_BELOW * case.noise:
            return (
                f"the relative error of the discretisation is at most {case.accuracy:g}, too small to be "
                f"detected with a noise of {case.noise:.2g} or more for each point"
            )
        return (cls(),)

    @property
    def terms(self):
        return terms_of(self.name)

    @property
    def settings(self):
        return ({self.strength.name: 1.0},)

    def refined(self, config: SolverConfig) -> SolverConfig:
        finer = {size: round(1.5 * getattr(config, size)) for size in self.refined_sizes}
        return dataclasses.replace(config, **finer)


class SolverStreams(_HalfAsManyAgain):
    """Too few streams."""

    name, refined_sizes = "solver_streams", ("nodes_escaping", "nodes_trapped")
    statement = "the solver has too few streams"


class SolverMoments(_HalfAsManyAgain):
    """Too few moments of the phase function."""

    name, refined_sizes = "solver_moments", ("n_moments",)
    statement = "the solver uses too few moments of the phase function"


class SolverOrders(_HalfAsManyAgain):
    """Too few azimuthal orders."""

    name, refined_sizes = "solver_orders", ("n_orders",)
    statement = "the solver has too few azimuthal orders"


NUMERICS = (SolverStreams, SolverMoments, SolverOrders)
