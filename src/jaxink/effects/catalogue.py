"""The versioned catalogue of effects that a diagnosis considers."""

import dataclasses

from jaxink.display.brief import brief_repr
from jaxink.effects.case import Case
from jaxink.effects.constants import CONSTANTS
from jaxink.effects.geometry import GEOMETRY
from jaxink.effects.instrument import INSTRUMENT
from jaxink.effects.kinds import Effect
from jaxink.effects.numerics import NUMERICS
from jaxink.effects.surfaces import RELIEF, SURFACES
from jaxink.effects.volume import VOLUME
from jaxink.effects.waves import WAVES

CATALOGUE_VERSION = 3
# Effects act in this order; the report lists them in it.
CATALOGUE: tuple[type[Effect], ...] = (
    *INSTRUMENT,
    *SURFACES,
    *RELIEF,
    *VOLUME,
    *GEOMETRY,
    *CONSTANTS,
    *WAVES,
    *NUMERICS,
)


@dataclasses.dataclass(frozen=True)
class Listed:
    """Forms in which effects may be present in a case, and why the others cannot be tested."""

    __repr__ = brief_repr

    forms: tuple[Effect, ...]
    not_testable: dict[str, str]


def effects_for(case: Case, catalogue: tuple[type[Effect], ...] = CATALOGUE) -> Listed:
    """The effects of a catalogue that may be present in a case."""
    forms: list[Effect] = []
    not_testable = {}
    for effect in catalogue:
        found = effect.forms(case)
        if isinstance(found, str):
            not_testable[effect.name] = found
        else:
            forms.extend(found)
    return Listed(tuple(forms), not_testable)
