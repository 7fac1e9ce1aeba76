"""The plain problems in the forms of optimagic and of FitBenchmarking, which are imported on use."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from benchmarks.optimisers.plain import PlainProblem


def optimagic_problems(
    problem: PlainProblem, numbers: Iterable[int] = range(20)
) -> dict[str, dict[str, Any]]:
    """Problems for `run_benchmark` of `optimagic.benchmarking.run_benchmark`, one for each start.

    Parameters
    ----------
    problem
        The problem.
    numbers
        Of its starts.
    """
    import optimagic as om

    @om.mark.least_squares
    def residual(params):
        return problem.residual(params)

    @om.mark.least_squares
    def jacobian(params):
        return problem.jacobian(params)

    best = problem.best
    solution = {
        "params": np.full(len(problem.lower), np.nan) if best is None else best.unit,
        "value": np.nan if best is None else best.loss,
    }
    return {
        f"{problem.name}-{number}": {
            "inputs": {
                "fun": residual,
                "jac": jacobian,
                "params": problem.starts[number],
                "bounds": om.Bounds(lower=problem.lower, upper=problem.upper),
            },
            "noise_free_fun": residual,
            "solution": solution,
            # Nothing is noisy, but only then are values computed anew for all points of a history, which has
            # none where the Jacobian alone was asked for.
            "noisy": True,
            "start_criterion": float(np.sum(problem.residual(problem.starts[number]) ** 2)),
            "info": {"start": number},
        }
        for number in numbers
    }


def fitbenchmarking_problem(problem: PlainProblem, options: Any = None) -> Any:
    """A `FittingProblem` of FitBenchmarking with all starts: the residual is fitted to zeros.

    Parameters
    ----------
    problem
        The problem.
    options
        Options of FitBenchmarking; None for its defaults.
    """
    from fitbenchmarking.parsing.fitting_problem import FittingProblem
    from fitbenchmarking.utils.options import Options

    rows = len(problem.residual(problem.starts[0]))
    # FitBenchmarking writes names in lower case.
    names = [name.lower() for name in problem.parameters]
    made = FittingProblem(Options() if options is None else options)
    made.name, made.format, made.equation = problem.name, "jaxink", "residual"
    made.function = lambda x, *unit: problem.residual(np.array(unit))[np.asarray(x, int)]
    made.jacobian = lambda x, unit: problem.jacobian(np.asarray(unit))[np.asarray(x, int)]
    made.data_x, made.data_y, made.data_e = np.arange(rows, dtype=float), np.zeros(rows), np.ones(rows)
    made.starting_values = [dict(zip(names, start.tolist(), strict=True)) for start in problem.starts]
    made.set_value_ranges(dict(zip(names, zip(problem.lower, problem.upper, strict=True), strict=True)))
    made.multifit = made.multistart = False
    made.verify()
    return made
