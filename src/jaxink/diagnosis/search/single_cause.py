"""One effect in place of several: before several are believed, each is fitted alone, from every start.

Two unlike effects, one of them weak, may imitate a third one that was never fitted in full: because its
program is costly, because it is degenerate at the minimum of the declared model, or because its refit ended
in another minimum.
"""

from jaxink.diagnosis.search.allowance import Task
from jaxink.diagnosis.search.candidate_refits import converged, polished, refit_by_scan, refit_from
from jaxink.diagnosis.search.cross_validation import CrossValidation
from jaxink.diagnosis.search.refit import Refit, penalty
from jaxink.diagnosis.search.stage import Stage
from jaxink.diagnosis.search.step import Addition, Screening, Step
from jaxink.diagnosis.statistics.candidate import Testability
from jaxink.effects import invalidity
from jaxink.numerics.progress import StepOf


def single_cause(
    screening: Screening, last: Stage, steps: list[Step], cross_validation: CrossValidation, n_points: int
) -> Addition | None:
    """The effect that explains the data alone as well as several do, or None.

    Parameters
    ----------
    screening
        Of the declared model.
    last
        The model with several effects.
    steps
        These effects.
    cross_validation
        Predictions of held-out points.
    n_points
        Number of points.
    """
    stage = screening.stage
    policy, allowance = stage.setup.policy, stage.setup.allowance
    base = stage.bench.base_free
    here = {name: last.solution.values[name] for name in base}
    declared = {name: stage.bench.start[name] for name in base}
    origins = (here, declared, *stage.setup.rivals)
    several = last.solution.chi_square + sum(penalty(step.form, n_points) for step in steps)
    found: list[Refit] = []
    names = [c.name for c in screening.result.candidates if c.status != Testability.NOT]
    for number, name in enumerate(names, start=1):
        if not allowance.permits(Task.SINGLE, [name]):
            continue
        lowest = min([last.solution.chi_square, *(refit.solution.chi_square for refit in found)])
        stage.setup.follow(f"{name} alone", StepOf(number, len(names)), lowest)
        refit_from(stage, screening.directions[name], origins)
        refit = refit_by_scan(stage, screening.directions[name])
        if refit is not None:
            found.append(refit)
            screening.refits[name] = refit
    wavelengths = stage.setup.scene.wavelength_nm
    leading = sorted(found, key=lambda refit: -refit.penalised(n_points))[: policy.most_polished]
    ends = [polished(stage, refit) for refit in leading]
    close = [
        refit
        for refit in ends
        if refit.solution.chi_square + refit.penalty(n_points) <= several + policy.class_delta_chi_square
        and not invalidity(refit.effect, refit.solution.values, wavelengths)
    ]
    if not close:
        return None
    best = max(close, key=lambda refit: refit.penalised(n_points))
    alike = [refit for refit in close if refit.is_like(best, n_points, policy.class_delta_chi_square)]
    members = (best.effect.name, *(refit.effect.name for refit in alike if refit is not best))
    gain = cross_validation.gain(stage, best)
    if gain is None or not gain.improves:
        return None
    end = converged(stage, best)
    return Addition(Step.of(screening, end, members, gain), end)
