"""Other minima of the model with all effects, from those of the declared model along its rugged parameter."""

from jaxink.diagnosis.search.stage import Stage
from jaxink.diagnosis.search.workbench import Solution
from jaxink.effects import invalidity


def rival_minima(stage: Stage) -> tuple[Solution, ...]:
    """Fits of the model from every other minimum that the fit of the declared sample has found, lowest first.

    Parameters
    ----------
    stage
        The model with all effects.

    Returns
    -------
    tuple of Solution
        Those that have converged at values which mean what they say; empty if the declared misfit has one
        minimum.
    """
    setup, here = stage.setup, stage.solution
    most = setup.policy.converged_jacobians
    found = [stage.bench.fit(here.values | there, here.free, max_jacobians=most) for there in setup.rivals]
    wavelengths = setup.scene.wavelength_nm
    sound = [
        one
        for one in found
        if one.search.outcome.converged
        and not any(invalidity(effect, one.values, wavelengths) for effect in stage.accepted)
    ]
    return tuple(sorted(sound, key=lambda one: one.chi_square))
