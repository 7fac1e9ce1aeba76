"""What effects that are too weak to be seen would do to the ink's BSDF inside the plate."""

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

from jaxink.diagnosis import HiddenEffect
from jaxink.effects import with_values
from jaxink.errors import InputRefusedError
from jaxink.ink import compare_with_each
from jaxink.plots import drawn_wavelengths

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis

# Tables are made for so many effects, those that shift a parameter most.
_MOST = 5
_COMPONENT = "R_II"


class HiddenChange(NamedTuple):
    """An effect that may hide, and the change of R_II by the parameters that it shifts, rms in per cent."""

    hidden: HiddenEffect
    percent: float


def hidden_changes(diagnosis: "Diagnosis") -> list[HiddenChange] | str:
    """Change of the ink's BSDF back into the plate by each of the leading hidden effects, or why it has none.

    Only what the effect does through the parameters counts; the wavelength is the first that is drawn.
    """
    corrected, leading = diagnosis.corrected, diagnosis.hidden[:_MOST]
    sample, wavelength = corrected.sample, drawn_wavelengths(diagnosis)[0]
    shifted = [
        {
            name: corrected.values[name] + shift
            for name, shift in one.shifts.items()
            if name in corrected.values
        }
        for one in leading
    ]
    others = [
        dataclasses.replace(sample, parameters=with_values(sample.parameters, values)) for values in shifted
    ]
    try:
        changes = compare_with_each(sample, others, (wavelength,)) if others else []
    except InputRefusedError as problem:
        return f"The ink's BSDF inside the plate cannot be tabulated: {problem}"
    found = [
        HiddenChange(hidden, change.of(_COMPONENT).rms_percent)
        for hidden, change in zip(leading, changes, strict=True)
    ]
    return sorted(found, key=lambda one: -one.percent)
