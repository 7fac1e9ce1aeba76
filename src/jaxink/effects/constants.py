"""Effects of declared constants: a value that the sample file fixes is wrong."""

import dataclasses

from jaxink.effects.case import Case
from jaxink.effects.kinds import Effect, Inapplicable, SampleEffect
from jaxink.effects.sample_edits import freed, with_parameters
from jaxink.sample import Layer, Parameter, Sample


@dataclasses.dataclass(frozen=True)
class DeclaredConstant(SampleEffect):
    """A value that the sample file fixes is wrong; the strength is the distance from it."""

    term: Parameter

    may_be_negative, group = True, "constant"

    @property
    def terms(self):
        return (self.term,)

    def extend(self, sample: Sample) -> Sample:
        """Free the parameter, so that layers whose indices may differ have channels of their own."""
        return with_parameters(sample, self.term)

    @classmethod
    def of(cls, case: Case, layer: Layer | None, key: str, limits) -> tuple[Effect, ...] | str:
        """The form for a parameter of a layer, or why there is none; `limits` maps its value to its range."""
        name = None if layer is None else f"{layer.name}.{key}"
        if name is None or name not in case.sample.parameters:
            return Inapplicable("the sample has no such parameter, or gives it by wavelength")
        if case.sample.parameters[name].free:
            return Inapplicable(f"{name} is already free")
        return (cls(freed(case.sample, name, *limits(case.declared(name)))),)


def _index_limits(declared):
    return max(1.0, declared - 0.35), declared + 0.35


def _factor_limits(declared):
    return declared / 4, declared * 4


class _Index(DeclaredConstant):
    """A refractive index; freeing it adds optical channels, which all indices share."""

    changes_structure, shared_program, scales = True, "indices", True

    @property
    def settings(self):
        """An arbitrary step."""
        return ({self.term.name: self.term.value + 0.02},)


class BinderIndex(_Index):
    """Refractive index of the ink's binder."""

    name, usual = "binder_index", 0.03
    statement = "the refractive index of the binder differs from the declared value"

    @classmethod
    def forms(cls, case):
        return cls.of(case, case.inks[0], "refractive_index", _index_limits)


class PlateIndex(_Index):
    """Refractive index of the plate."""

    name, usual = "plate_index", 0.02
    statement = "the refractive index of the plate differs from the declared value"

    @classmethod
    def forms(cls, case):
        return cls.of(case, next(iter(case.plates), None), "refractive_index", _index_limits)


class PlateAbsorption(DeclaredConstant):
    """Absorption of the plate."""

    name, may_be_negative, usual = "plate_absorption", False, 0.01
    statement = "the plate absorbs more than declared"

    @classmethod
    def forms(cls, case):
        plate = next(iter(case.plates), None)
        return cls.of(case, plate, "absorption_per_mm", lambda declared: (declared, declared + 5.0))


class InkThickness(DeclaredConstant):
    """Thickness of the ink."""

    name = "ink_thickness"
    statement = "the thickness of the ink differs from the declared value"

    @classmethod
    def forms(cls, case):
        return cls.of(case, case.inks[0], "thickness_um", _factor_limits)


class PlateThickness(DeclaredConstant):
    """Thickness of the plate."""

    name = "plate_thickness"
    statement = "the thickness of the plate differs from the declared value"

    @classmethod
    def forms(cls, case):
        plate = next(iter(case.plates), None)
        if plate is None:
            return Inapplicable("there is no plate")
        absorbs = case.declared(f"{plate.name}.absorption_per_mm") > 0
        if not absorbs and case.sample.beam_diameter_mm is None:
            return Inapplicable(
                "the plate does not absorb and no light is lost laterally, so its thickness has no effect"
            )
        return cls.of(case, plate, "thickness_mm", _factor_limits)


CONSTANTS = (BinderIndex, PlateIndex, PlateAbsorption, InkThickness, PlateThickness)
