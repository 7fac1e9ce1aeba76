"""How strong an effect must be to be seen, the free parameters following it as far as they can."""

from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.stage import Stage


def limit_by_refits(stage: Stage, direction: Direction, limit: float, critical_z: float) -> float:
    """Strength from which on refits of the model leave what a screen calls; the largest where none does.

    The limit of a screen is linear: it does not know how far the free parameters can follow an effect.

    Parameters
    ----------
    stage
        The model without the effect.
    direction
        The effect.
    limit
        Detection limit of the screen, in units of the direction's column.
    critical_z
        Score that is called.

    Returns
    -------
    float
        In units of the column; at least the given limit, unless its range ends before.
    """
    effect, name = direction.effect, direction.effect.strength.name
    if effect.shares_program or not (effect.scales or name not in direction.setting):
        return limit
    bench = stage.own_bench(effect) if effect.own_program else stage.bench
    unit = direction.setting[name] - effect.neutral if name in direction.setting else 1.0
    terms = {t.name: t.value for t in effect.terms}

    def left_at(step):
        there = terms | stage.solution.values | direction.setting | {name: effect.neutral + step * unit}
        truth = bench.predict(there)
        # To the end: what a search has not yet followed is not left.
        return stage.bench.fit(stage.solution.values, stage.free, measured=truth).chi_square

    multiples = stage.setup.policy.limit_multiples
    steps = sorted({min(factor * limit, direction.largest) for factor in multiples}, reverse=True)
    middle = steps[len(steps) // 2]
    # A linear limit leaves the square of the multiple; half of that is near enough.
    if left_at(middle) >= (critical_z * middle / limit) ** 2 / 2:
        return limit
    seen = direction.largest
    for step in steps:
        if not left_at(step) >= critical_z**2:
            break
        seen = step
    return seen
