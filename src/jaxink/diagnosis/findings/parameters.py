"""Parameter estimates of a model, and which of them its misfit leaves undetermined."""

import numpy as np

from jaxink.diagnosis.search.refit import Estimate, estimates, finite
from jaxink.diagnosis.search.stage import Stage
from jaxink.diagnosis.statistics.discrepancy import SmoothPart, misfit_deviation
from jaxink.diagnosis.statistics.points import Points
from jaxink.display.named_rows import NamedRows


def estimates_of(stage: Stage) -> NamedRows[Estimate]:
    """Free parameters of a stage with their standard errors from noise."""
    return NamedRows(estimates(stage.bench, stage.solution))


def misfit_errors(stage: Stage, points: Points, smooth: SmoothPart) -> dict[str, float | None]:
    """Standard deviation of the bias of each parameter due to the smooth part of the misfit."""
    if smooth.p_value > stage.setup.options.level:
        return {name: 0.0 for name in stage.free}
    shifts = misfit_deviation(smooth, stage.jacobian, points, at_bound=stage.at_bound)
    return {name: finite(shift) for name, shift in zip(stage.free, shifts.tolist(), strict=True)}


def undetermined_parameters(stage: Stage, shifts: dict[str, float | None]) -> tuple[str, ...]:
    """Parameters at a bound, or that misfit and noise may have moved to a bound."""
    names, coverage = [], stage.setup.policy.coverage_errors
    for name, (value, error) in estimates_of(stage).items():
        term, misfit = stage.bench.terms[name], shifts[name]
        room = min(value - term.minimum, term.maximum - value)
        if misfit is None or error is None or coverage * np.hypot(misfit, error) >= room:
            names.append(name)
    return tuple(names)
