"""What a diagnosis changes in the BSDF that is exported."""

from typing import TYPE_CHECKING

from jaxink.effects import Effect, SampleEffect
from jaxink.errors import InputRefusedError
from jaxink.ink.comparison import TableComparison, compare_tables
from jaxink.plots.diagnosis_figures import drawn_wavelengths

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis


def inside_change(diagnosis: "Diagnosis") -> TableComparison | str:
    """Tables of the ink by the fit of the declared model and by that with what was found.

    Parameters
    ----------
    diagnosis
        The diagnosis.

    Returns
    -------
    TableComparison or str
        The sentence why there are none.
    """
    if not diagnosis.steps:
        return "No effect was added, so the ink is that of the fit of the declared model."
    wavelengths = drawn_wavelengths(diagnosis)
    try:
        return compare_tables(diagnosis.result.sample, diagnosis.refined, wavelengths)
    except InputRefusedError as problem:
        return f"The ink as light inside the plate meets it cannot be tabulated: {problem}"


def is_in_table(effect: Effect) -> bool:
    """Whether an effect itself changes layers or their values, which is all that a table of an ink holds."""
    return isinstance(effect, SampleEffect) and effect.group not in ("instrument", "geometry")


def inside_sentences(diagnosis: "Diagnosis") -> list[str]:
    """What the tables hold of the effects that were added."""
    within = [step.effect for step in diagnosis.steps if is_in_table(step.form)]
    without = [step.effect for step in diagnosis.steps if not is_in_table(step.form)]
    lines = []
    if within:
        lines.append(f"Part of the table after: {', '.join(within)}, and the parameters fitted with it.")
    if without:
        lines.append(
            f"Not itself part of the table, which holds one ink alone: {', '.join(without)}; the ink's "
            "parameters are those fitted with it."
        )
    return lines
