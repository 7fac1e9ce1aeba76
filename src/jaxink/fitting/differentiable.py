"""The compiled residual of an objective as a function that others differentiate and compile again."""

from collections.abc import Callable

import jax
import numpy as np

from jaxink.fitting.compiled import CompiledPrograms


def differentiable(programs: CompiledPrograms) -> Callable:
    """Residual and prediction of an objective, with the objective's own Jacobian as derivative.

    The Jacobian enters as one matrix, traced once for all uses, with a direction for each colour of the
    parameters; differentiating anew would trace and compile the residual each time.

    Parameters
    ----------
    programs
        Of the objective.

    Returns
    -------
    Callable
        Function of the unit variables and of (arrays, colouring) of a `CompiledObjective`.
    """

    @jax.custom_jvp
    def in_box(unit, given):
        return programs.traced_alone(given[0], unit)

    @in_box.defjvp
    def _(primals, tangents):
        unit, (arrays, colouring) = primals
        residual, predicted, slopes = programs.traced_with_slopes(arrays, unit, colouring.seeds)
        nothing = np.zeros(predicted.shape)
        return (residual, predicted), (colouring.expand(slopes) @ tangents[0], nothing)

    return in_box
