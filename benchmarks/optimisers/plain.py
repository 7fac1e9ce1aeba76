"""The problems as plain functions of numpy arrays, for whoever studies methods of minimisation.

    from benchmarks.optimisers.plain import plain_problem

    one = plain_problem("white_ink_mie-mie-everything")
    scipy.optimize.least_squares(one.residual, one.starts[0], one.jacobian, (one.lower, one.upper))

`benchmarks.optimisers.adapters` has them for optimagic and for FitBenchmarking.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from benchmarks.optimisers.kept import kept
from benchmarks.optimisers.problems import Posed, problems
from benchmarks.optimisers.searches import Bench
from jaxink.numerics.precision import computing


class PlainProblem:
    """Minimise the sum of squares of a residual within bounds.

    Parameters
    ----------
    name
        Of the problem.
    posed
        The problem.
    lines
        The kept searches, of which the lowest is the best known minimum.
    """

    def __init__(self, name: str, posed: Posed, lines: list[dict]):
        self.name = name
        with computing():
            bench = Bench(posed)
        self._compiled, self.starts = bench.compiled, bench.starts
        self.parameters: tuple[str, ...] = posed.objective.free
        self.lower, self.upper = np.zeros(len(self.parameters)), np.ones(len(self.parameters))
        self.multimodal = posed.rugged
        self._ended = min(
            (line for line in lines if line["method"] != "scan" and line["loss"] is not None),
            key=lambda line: line["loss"],
            default=None,
        )

    def residual(self, unit: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " rows"]:
        """Residual at variables within the bounds, which are 0 and 1."""
        with computing():
            return self._compiled.residual(np.asarray(unit, float)).residual

    def jacobian(self, unit: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "rows parameters"]:
        """Its derivatives, exact to rounding."""
        with computing():
            found = self._compiled.linearised(np.asarray(unit, float)).jacobian
        assert found is not None
        return found

    @property
    def best(self) -> "KnownMinimum | None":
        """The best known minimum; None without kept searches."""
        if self._ended is None:
            return None
        return KnownMinimum(np.array(self._ended["unit"]), float(self._ended["loss"]))


@dataclasses.dataclass(frozen=True)
class KnownMinimum:
    """Where the lowest of the kept searches ended, to nine digits.

    Parameters
    ----------
    unit
        Variables.
    loss
        Sum of squares of the residual.
    """

    unit: Float[np.ndarray, " parameters"]
    loss: float


def plain_problem(name: str) -> PlainProblem:
    """A problem by its name, one of the keys of `benchmarks.optimisers.problems.problems`.

    Raises
    ------
    KeyError
        There is no such problem, or its measured data are absent.
    """
    return PlainProblem(name, problems()[name](), kept(name))
