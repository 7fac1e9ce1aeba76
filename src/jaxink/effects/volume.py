"""Effects of the volume: particles, absorption and phase function of the ink."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from jaxink.effects.case import Case
from jaxink.effects.constants import DeclaredConstant
from jaxink.effects.kinds import DividingEffect, Effect, ReadingEffect, SampleEffect
from jaxink.effects.sample_edits import freed, with_changed_layer, with_parameters
from jaxink.sample import Layer, Parameter, Population, Sample

_NOT_MIE = "the ink is not made of Mie particles, so nothing of the kind has a parameter"


@dataclasses.dataclass(frozen=True)
class _MieTerm(SampleEffect):
    """A further number of a Mie ink that is zero at the declared model."""

    layer: str

    key: ClassVar[str]
    maximum: ClassVar[float] = 1.0
    unit: ClassVar[str] = ""

    @classmethod
    def of_mie_ink(cls, case: Case) -> tuple[Effect, ...] | str:
        """For a Mie ink that does not have it."""
        mie = [ink for ink in case.inks if ink.phase_function == "mie" and ink.radius_table is None]
        if not mie:
            return _NOT_MIE
        if case.each(f"{mie[0].name}.{cls.key}"):
            return f"{mie[0].name}.{cls.key} is declared already"
        return (cls(mie[0].name),)

    @property
    def terms(self):
        """The number itself."""
        return (Parameter(f"{self.layer}.{self.key}", 0.0, True, 0.0, self.maximum, self.unit),)

    def extend(self, sample: Sample) -> Sample:
        """With the number."""
        return with_parameters(sample, self.strength)


class StructureFactor(_MieTerm):
    """Particles so dense that they scatter dependently (hard spheres, Percus and Yevick 1958)."""

    name, usual, key = "structure_factor", 1.0, "structure_factor_weight"
    changes_structure, scales = True, True
    statement = "the particles are too dense to scatter independently"

    @classmethod
    def forms(cls, case: Case):
        """For a Mie ink that does not have it."""
        return cls.of_mie_ink(case)

    @property
    def settings(self):
        """The whole factor."""
        return ({self.strength.name: 1.0},)


class Polydispersity(_MieTerm):
    """The particles' sizes are log-normal; the strength is the variance of ln(radius)."""

    name, usual, key, maximum = "polydispersity", 0.07, "radius_variance_ln", 0.25
    changes_structure, scales = True, True
    statement = "the particles are not of one size"

    @classmethod
    def forms(cls, case: Case):
        """For a Mie ink that does not have it."""
        return cls.of_mie_ink(case)

    @property
    def settings(self):
        """A tenth and a third of the radius."""
        return tuple({self.strength.name: v} for v in (0.01, 0.09))


@dataclasses.dataclass(frozen=True)
class SecondPopulation(SampleEffect):
    """A second kind of particles, of the same material and another size."""

    layer: str
    index: float

    name, changes_structure = "second_population", True
    statement = "there are particles of a second size"

    @classmethod
    def forms(cls, case: Case):
        """For a Mie ink with one kind."""
        ink = case.inks[0]
        if ink.phase_function != "mie":
            return _NOT_MIE + "; second_lobe stands for a second kind of particles"
        names = case.each(f"{ink.name}.particle_index")
        if ink.populations or not names:
            return "there are several kinds of particles already, or their index has a dispersion"
        return (cls(ink.name, case.declared(names[0])),)

    @property
    def terms(self):
        """Volume fraction and radius."""
        stem = f"{self.layer}.second"
        return (
            Parameter(f"{stem}.volume_fraction", 0.0, True, 0.0, 0.3),
            Parameter(f"{stem}.radius_nm", 1000.0, True, 20.0, 3000.0, "nm", scale="log"),
        )

    @property
    def settings(self):
        """Small and large ones."""
        share, radius = (t.name for t in self.terms)
        return ({share: 0.01, radius: 60.0}, {share: 0.005, radius: 600.0}, {share: 0.01, radius: 2000.0})

    def extend(self, sample: Sample) -> Sample:
        """With a second population."""
        stem = f"{self.layer}.second"
        constants = {"particle_index": self.index, "particle_absorption_index": 0.0}
        new = (Parameter(f"{stem}.{key}", value) for key, value in constants.items())
        changed = with_changed_layer(sample, self.layer, populations=(Population("second"),))
        return with_parameters(changed, *self.terms, *new)


@dataclasses.dataclass(frozen=True)
class DepthGradient(DividingEffect):
    """The ink scatters more towards one side; two halves."""

    layer: str

    name, sign, usual = "depth_gradient", 0, 0.5
    changes_structure, scales = True, True
    statement = "the ink's scattering changes with depth"
    terms = (Parameter("depth_gradient.slope", 0.0, True, -1.5, 1.5),)
    # Half as much more.
    settings = ({"depth_gradient.slope": 0.5},)

    @classmethod
    def forms(cls, case: Case):
        """For an ink that light passes, with one concentration for all wavelengths."""
        ink = case.inks[0]
        if ink.opaque or ink.populations:
            return "the ink is opaque, or has several kinds of particles"
        if any(n.startswith(f"{ink.name}.") and "@" in n for n in case.sample.parameters):
            return "the ink has a parameter for each wavelength, which its halves could not follow"
        if f"{ink.name}.{_concentration(ink)}" not in case.sample.parameters:
            return "the ink has no concentration of its own that could change with depth"
        if ink.roughness and len(ink.roughness) > 1:
            return "the ink has two rough faces"
        return (cls(ink.name),)

    def extend(self, sample: Sample) -> Sample:
        """Two halves, whose concentrations follow the strength; all else follows the declared layer."""
        position = next(k for k, one in enumerate(sample.layers) if one.name == self.layer)
        ink = sample.layers[position]
        halves, new = [], [self.strength]
        for part, sign, face in (("upper", "-", "front_roughness"), ("lower", "+", "back_roughness")):
            name = f"{self.layer}_{part}"
            rough = tuple(
                dataclasses.replace(r, name=f"{name}.{r.face}") for r in ink.roughness if r.face == face
            )
            halves.append(dataclasses.replace(ink, name=name, roughness=rough))
            formulas = {
                _concentration(ink): f"{{}} * (1 {sign} depth_gradient.slope / 2)",
                "thickness_um": "{} / 2",
            }
            for own in [p for p in sample.parameters if p.startswith(f"{self.layer}.")]:
                rest = own.split(".", 1)[1]
                if rest.split(".")[0] in ("front_roughness", "back_roughness") and not rest.startswith(face):
                    continue
                tie = formulas.get(rest, "{}").format(own)
                new.append(_tied(sample.parameters[own], f"{name}.{rest}", tie))
        layers = (*sample.layers[:position], *halves, *sample.layers[position + 1 :])
        return with_parameters(dataclasses.replace(sample, layers=layers), *new)


def _concentration(ink: Layer) -> str:
    """Key of the parameter that the number of scatterers goes with."""
    return "volume_fraction" if ink.phase_function == "mie" else "scattering_per_mm"


def _tied(parameter: Parameter, name: str, tie: str) -> Parameter:
    """A parameter like another one, whose value is a formula."""
    free_of_limits = {"free": False, "prior": None, "minimum": -np.inf, "maximum": np.inf}
    return dataclasses.replace(parameter, name=name, value=np.nan, tie=tie, **free_of_limits)


class InkAbsorption(_MieTerm):
    """The binder of a Mie ink absorbs."""

    name, key, maximum, unit = "ink_absorption", "binder_absorption_per_mm", 50.0, "1/mm"
    statement = "the binder of the ink absorbs"

    @classmethod
    def forms(cls, case: Case):
        """For a Mie ink; others have a coefficient of their own, free or fixed."""
        ink = case.inks[0]
        if ink.phase_function == "mie":
            return cls.of_mie_ink(case)
        names = case.each(f"{ink.name}.absorption_per_mm") or case.each(
            f"{ink.name}.single_scattering_albedo"
        )
        if any(case.sample.parameters[n].free for n in names):
            return "the absorption of the ink is a free parameter already"
        name = f"{ink.name}.absorption_per_mm"
        if name not in names:
            return "the ink's albedo is declared, of which absorption is a part"
        declared = case.declared(name)
        return (_DeclaredAbsorption(freed(case.sample, name, declared, declared + 50.0)),)


class _DeclaredAbsorption(DeclaredConstant):
    """The same of an ink with coefficients."""

    name, sign, group = "ink_absorption", 1, "volume"
    statement = "the ink absorbs more than declared"


@dataclasses.dataclass(frozen=True)
class SecondLobe(SampleEffect):
    """A second lobe of the phase function."""

    layer: str

    name, usual = "second_lobe", 0.1
    statement = "the phase function has a second lobe"

    @classmethod
    def forms(cls, case: Case):
        """For a Henyey-Greenstein ink."""
        ink = case.inks[0]
        if ink.phase_function != "henyey_greenstein":
            return "the phase function is not Henyey and Greenstein's"
        return (cls(ink.name),)

    @property
    def terms(self):
        """Share of the scattering in it, and its asymmetry."""
        return (
            Parameter(f"{self.layer}.second_weight", 0.0, True, 0.0, 0.6),
            Parameter(f"{self.layer}.second_asymmetry_parameter", -0.4, True, -0.9, 0.97),
        )

    @property
    def settings(self):
        """Asymmetries."""
        return tuple({self.terms[1].name: g} for g in (-0.8, -0.4, 0.0, 0.4, 0.8, 0.95))

    def extend(self, sample: Sample) -> Sample:
        """With two terms."""
        changed = with_changed_layer(sample, self.layer, phase_function="two_term_henyey_greenstein")
        return with_parameters(changed, *self.terms)


@dataclasses.dataclass(frozen=True)
class ShadowHiding(ReadingEffect):
    """Near the source no particle sees the shadow of another (Hapke).

    The strength B0 multiplies the reflected BSDF by 1 + B0 / (1 + tan(psi / 2) / h), psi the angle from the
    source; all of it instead of its first order, which it overstates for bright samples.
    """

    name, group, usual = "shadow_hiding", "volume", 0.2
    statement = "the reflection is enhanced around the source, as by hidden shadows"

    terms = (
        Parameter("shadow_hiding.amplitude", 0.0, True, 0.0, 1.0),
        Parameter("shadow_hiding.width", 0.05, True, 0.01, 0.4, scale="log"),
    )
    settings = tuple({"shadow_hiding.width": width} for width in (0.03, 0.1, 0.3))

    @classmethod
    def forms(cls, case: Case):
        """If reflection was measured near the source."""
        reflects = ~case.scene.is_transmission
        near = np.asarray(case.scene.from_retro_deg)[reflects]
        if not np.any(near < 20):
            return "no point in reflection lies within 20 degrees of the source"
        return (cls(),)

    def change(self, predicted, values, field):
        """See the class."""
        lobe = 1 / (1 + jnp.tan(jnp.deg2rad(field.scene.from_retro_deg) / 2) / values["shadow_hiding.width"])
        reflects = ~field.scene.is_transmission
        return predicted * (1 + values["shadow_hiding.amplitude"] * lobe * reflects)


VOLUME = (
    StructureFactor,
    Polydispersity,
    SecondPopulation,
    DepthGradient,
    InkAbsorption,
    SecondLobe,
    ShadowHiding,
)
