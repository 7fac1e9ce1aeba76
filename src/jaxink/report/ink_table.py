"""Effect of a diagnosis on the exported BSDF."""

import itertools
from typing import TYPE_CHECKING

from jaxink.effects import Effect
from jaxink.errors import InputRefusedError
from jaxink.ink import TableComparison, apart_from_the_ink, compare_tables
from jaxink.plots import drawn_wavelengths
from jaxink.sample import EFFECTS, Sample

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis


def inside_change(diagnosis: "Diagnosis") -> TableComparison | str:
    """Tables of the ink by the declared model and by the corrected one, or a sentence why there are none."""
    if not diagnosis.steps:
        return "No effect was added, so the ink is that of the declared model."
    wavelengths = drawn_wavelengths(diagnosis)
    try:
        return compare_tables(diagnosis.declared.sample, diagnosis.corrected.sample, wavelengths)
    except InputRefusedError as problem:
        return f"The ink's BSDF inside the plate cannot be tabulated: {problem}"


def is_in_table(effect: Effect, sample: Sample) -> bool:
    """Whether an effect is a property of the ink, which is all that an ink table contains."""
    if effect.name in EFFECTS:
        return effect.name not in itertools.chain(*apart_from_the_ink(sample))
    layer = effect.strength.name.split(".")[0]
    # The face between plate and ink may be declared by the plate.
    return effect.name == "rough_contact" or any(one.name == layer and one.scatters for one in sample.layers)


def inside_sentences(diagnosis: "Diagnosis") -> list[str]:
    """Which of the added effects the tables contain."""
    sample = diagnosis.corrected.sample
    within = [step.effect for step in diagnosis.steps if is_in_table(step.form, sample)]
    without = [step.effect for step in diagnosis.steps if not is_in_table(step.form, sample)]
    lines = []
    if within:
        lines.append(f"The corrected table includes {', '.join(within)} and the parameters fitted with it.")
    if without:
        lines.append(
            f"The table contains only the ink, and therefore not {', '.join(without)}; the ink's parameters "
            "are those fitted with it."
        )
    return lines
