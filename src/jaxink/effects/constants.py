"""Effects of declared constants: a number that the sample file gives as fixed is wrong."""

import dataclasses

from jaxink.effects.case import Case
from jaxink.effects.kinds import Effect, SampleEffect
from jaxink.effects.sample_edits import freed, with_parameters
from jaxink.sample import Layer, Parameter, Sample


@dataclasses.dataclass(frozen=True)
class DeclaredConstant(SampleEffect):
    """A number that the sample file gives as fixed is wrong; the strength is its distance from there."""

    term: Parameter

    sign, group = 0, "constant"

    @property
    def terms(self):
        """The number itself."""
        return (self.term,)

    def extend(self, sample: Sample) -> Sample:
        """The structure for a number that is not what was declared: where indices differ, channels do."""
        return with_parameters(sample, self.term)

    @classmethod
    def of(cls, case: Case, layer: Layer | None, key: str, limits) -> tuple[Effect, ...] | str:
        """The form for a number of a layer, or why there is none; `limits` gives its range by its value."""
        name = None if layer is None else f"{layer.name}.{key}"
        if name is None or name not in case.sample.parameters:
            return "the sample has no such number, or one for each wavelength"
        if case.sample.parameters[name].free:
            return f"{name} is free already"
        return (cls(freed(case.sample, name, *limits(case.declared(name)))),)


def _index_limits(declared):
    return max(1.0, declared - 0.35), declared + 0.35


def _factor_limits(declared):
    return declared / 4, declared * 4


class _Index(DeclaredConstant):
    """A refractive index; if it may vary, there are more optical channels, which all of them share."""

    changes_structure, shared_program, scales = True, "indices", True

    @property
    def settings(self):
        """A step to the side where there is room for it."""
        return ({self.term.name: self.term.value + 0.02},)


class BinderIndex(_Index):
    """Refractive index of the ink's binder."""

    name, usual = "binder_index", 0.03
    statement = "the refractive index of the binder is not the declared one"

    @classmethod
    def forms(cls, case):
        """Of the first ink."""
        return cls.of(case, case.inks[0], "refractive_index", _index_limits)


class PlateIndex(_Index):
    """Refractive index of the plate."""

    name, usual = "plate_index", 0.02
    statement = "the refractive index of the plate is not the declared one"

    @classmethod
    def forms(cls, case):
        """If there is a plate."""
        return cls.of(case, next(iter(case.plates), None), "refractive_index", _index_limits)


class PlateAbsorption(DeclaredConstant):
    """Absorption of the plate."""

    name, sign, usual = "plate_absorption", 1, 0.01
    statement = "the plate absorbs more than declared"

    @classmethod
    def forms(cls, case):
        """If there is a plate."""
        plate = next(iter(case.plates), None)
        return cls.of(case, plate, "absorption_per_mm", lambda declared: (declared, declared + 5.0))


class InkThickness(DeclaredConstant):
    """Thickness of the ink."""

    name = "ink_thickness"
    statement = "the ink is not as thick as declared"

    @classmethod
    def forms(cls, case):
        """Unless it is opaque."""
        return cls.of(case, case.inks[0], "thickness_um", _factor_limits)


class PlateThickness(DeclaredConstant):
    """Thickness of the plate."""

    name = "plate_thickness"
    statement = "the plate is not as thick as declared"

    @classmethod
    def forms(cls, case):
        """If it changes the BSDF: the plate absorbs, or light is lost sideways."""
        plate = next(iter(case.plates), None)
        if plate is None:
            return "there is no plate"
        absorbs = case.declared(f"{plate.name}.absorption_per_mm") > 0
        if not absorbs and case.sample.beam_diameter_mm is None:
            return (
                "the plate neither absorbs nor does the detector miss light, so its thickness has no effect"
            )
        return cls.of(case, plate, "thickness_mm", _factor_limits)


CONSTANTS = (BinderIndex, PlateIndex, PlateAbsorption, InkThickness, PlateThickness)
