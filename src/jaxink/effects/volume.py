"""Effects of the volume: particles, absorption and phase function of the ink."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from jaxink.effects.case import Case
from jaxink.effects.constants import DeclaredConstant
from jaxink.effects.kinds import DividingEffect, Effect, Inapplicable, ReadingEffect, SampleEffect
from jaxink.effects.sample_edits import freed, ink_of, with_changed_layer, with_parameters
from jaxink.errors import InputRefusedError
from jaxink.sample import Layer, Parameter, Population, Sample, terms_of

_NOT_BY_ALBEDO = "the ink consists of Mie particles, whose phase function follows from their size"
_LOBE_SLOPE = "depth_gradient.asymmetry_slope"
_NOT_MIE = Inapplicable("the ink does not consist of Mie particles, so it has no such parameter")


@dataclasses.dataclass(frozen=True)
class _MieTerm(SampleEffect):
    """An additional parameter of a Mie ink that is zero in the declared model."""

    layer: str

    changes_particles: ClassVar[bool] = True
    key: ClassVar[str]
    maximum: ClassVar[float] = 1.0
    unit: ClassVar[str] = ""

    @classmethod
    def of_mie_ink(cls, case: Case) -> tuple[Effect, ...] | str:
        """The form for a Mie ink that lacks the parameter."""
        mie = [ink for ink in case.inks if ink.phase_function == "mie" and ink.radius_table is None]
        if not mie:
            return _NOT_MIE
        if case.each(f"{mie[0].name}.{cls.key}"):
            return Inapplicable(f"{mie[0].name}.{cls.key} is already declared")
        return (cls(mie[0].name),)

    @property
    def terms(self):
        return (Parameter(f"{self.layer}.{self.key}", 0.0, True, 0.0, self.maximum, self.unit),)

    def extend(self, sample: Sample) -> Sample:
        return with_parameters(sample, self.strength)


class StructureFactor(_MieTerm):
    """Particles dense enough to scatter dependently (hard spheres, Percus and Yevick 1958)."""

    name, usual, key = "structure_factor", 1.0, "structure_factor_weight"
    changes_structure, scales = True, True
    statement = "the particles are too dense to scatter independently"
    numbered = (
        "the particles are too dense to scatter independently, with {structure_factor_weight%} of the change "
        "that hard spheres of their volume fraction cause"
    )

    @classmethod
    def forms(cls, case: Case):
        return cls.of_mie_ink(case)

    @property
    def settings(self):
        return ({self.strength.name: 1.0},)


class Polydispersity(_MieTerm):
    """The particle radii are log-normally distributed; the strength is the variance of ln(radius)."""

    name, usual, key, maximum = "polydispersity", 0.07, "radius_variance_ln", 0.25
    changes_structure, scales = True, True
    statement = "the particles have a distribution of sizes"
    numbered = (
        "the particles have a distribution of sizes, with a variance of ln(radius) of {radius_variance_ln}"
    )

    @classmethod
    def forms(cls, case: Case):
        return cls.of_mie_ink(case)

    @property
    def settings(self):
        """Standard deviations of a tenth and a third of the radius."""
        return tuple({self.strength.name: v} for v in (0.01, 0.09))


@dataclasses.dataclass(frozen=True)
class SecondPopulation(SampleEffect):
    """A second population of particles, of the same material and another size."""

    layer: str
    index: float

    name, changes_structure, changes_particles = "second_population", True, True
    statement = "there are particles of a second size"
    numbered = (
        "there are particles of a second size, with a radius of {radius_nm} "
        "and a volume fraction of {volume_fraction}"
    )

    @classmethod
    def forms(cls, case: Case):
        ink = case.inks[0]
        if ink.phase_function != "mie":
            return _NOT_MIE + "; second_lobe represents a second kind of particles"
        names = case.each(f"{ink.name}.particle_index")
        if ink.populations or not names:
            return Inapplicable(
                "there are already several kinds of particles, or their index has a dispersion"
            )
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
        share, radius = (t.name for t in self.terms)
        return ({share: 0.01, radius: 60.0}, {share: 0.005, radius: 600.0}, {share: 0.01, radius: 2000.0})

    def extend(self, sample: Sample) -> Sample:
        stem = f"{self.layer}.second"
        constants = {"particle_index": self.index, "particle_absorption_index": 0.0}
        new = (Parameter(f"{stem}.{key}", value) for key, value in constants.items())
        changed = with_changed_layer(sample, self.layer, populations=(Population("second"),))
        return with_parameters(changed, *self.terms, *new)


@dataclasses.dataclass(frozen=True)
class DepthGradient(DividingEffect):
    """The ink scatters more towards one side; represented by two halves.

    A sample file may also declare that the asymmetry parameter changes with depth. A diagnosis does not look
    for that: the linear screen expects more of it than it explains where other effects are missing.
    """

    layer: str

    name, may_be_negative, usual = "depth_gradient", True, 0.5
    changes_structure, scales = True, True
    statement = "the ink's scattering changes with depth"
    numbered = "the back half of the ink scatters more than the front half, by {slope%} of their mean"
    terms = terms_of("depth_gradient")[:1]
    # Half as much again.
    settings = ({"depth_gradient.slope": 0.5},)

    @classmethod
    def forms(cls, case: Case):
        ink = case.inks[0]
        return _why_undividable(case.sample, ink) or (cls(ink.name),)

    @classmethod
    def of_sample(cls, sample, layer=None):
        ink = ink_of(sample, cls.name, layer)
        if reason := _why_undividable(sample, ink):
            raise InputRefusedError(f"[effects.depth_gradient] cannot divide '{ink.name}': {reason}.")
        lobe = sample.parameters.get(_LOBE_SLOPE)
        changes = lobe is not None and (lobe.free or lobe.tie is not None or lobe.value != 0)
        if changes and f"{ink.name}.asymmetry_parameter" not in sample.parameters:
            raise InputRefusedError(
                f"effects.{_LOBE_SLOPE}: '{ink.name}' has no asymmetry_parameter; only its concentration can "
                "change with depth. Leave the key out."
            )
        return cls(ink.name)

    def extend(self, sample: Sample) -> Sample:
        """Two halves, which differ by the slopes; all else is tied to the declared layer."""
        position = next(k for k, one in enumerate(sample.layers) if one.name == self.layer)
        ink = sample.layers[position]
        halves, new = [], [self.strength, Parameter(_LOBE_SLOPE, 0.0)]
        for part, sign, face in (("upper", "-", "front_roughness"), ("lower", "+", "back_roughness")):
            name = f"{self.layer}_{part}"
            rough = tuple(
                dataclasses.replace(r, name=f"{name}.{r.face}") for r in ink.roughness if r.face == face
            )
            halves.append(dataclasses.replace(ink, name=name, roughness=rough))
            backward = f"(1 - {{0}}) * (1 {sign} {_LOBE_SLOPE} / 2)"
            formulas = {
                _concentration(ink): f"{{0}} * (1 {sign} depth_gradient.slope / 2)",
                "thickness_um": "{0} / 2",
                # (1 - g) / (1 + g) varies, so that g stays between -1 and 1.
                "asymmetry_parameter": f"(1 + {{0}} - {backward}) / (1 + {{0}} + {backward})",
            }
            for own in [p for p in sample.parameters if p.startswith(f"{self.layer}.")]:
                rest = own.split(".", 1)[1]
                if rest.split(".")[0] in ("front_roughness", "back_roughness") and not rest.startswith(face):
                    continue
                tie = formulas.get(rest, "{0}").format(own)
                new.append(_tied(sample.parameters[own], f"{name}.{rest}", tie))
        layers = (*sample.layers[:position], *halves, *sample.layers[position + 1 :])
        return with_parameters(dataclasses.replace(sample, layers=layers), *new)


@dataclasses.dataclass(frozen=True)
class SurfaceLayer(DividingEffect):
    """An opaque ink scatters differently next to its face: a layer of its own, which scatters by one lobe.

    Where only the albedo of a body matters, a gradient of concentration changes nothing; one of the albedo or
    of the phase function does.
    """

    layer: str

    name, usual = "surface_layer", 0.3
    changes_structure, scales = True, True
    statement = "the ink scatters differently next to its face"
    numbered = (
        "the ink scatters differently next to its face, in a layer of optical thickness {optical_thickness} "
        "with an asymmetry parameter of {asymmetry_parameter} and an albedo of {single_scattering_albedo}"
    )
    terms = terms_of("surface_layer")
    settings = tuple(
        {"surface_layer.optical_thickness": 0.1, "surface_layer.asymmetry_parameter": g}
        for g in (-0.4, 0.3, 0.7)
    )

    @classmethod
    def forms(cls, case: Case):
        ink = case.inks[0]
        return _why_without_surface_layer(case.sample, ink) or (cls(ink.name),)

    @classmethod
    def of_sample(cls, sample, layer=None):
        ink = ink_of(sample, cls.name, layer)
        if reason := _why_without_surface_layer(sample, ink):
            raise InputRefusedError(f"[effects.surface_layer] cannot divide '{ink.name}': {reason}.")
        return cls(ink.name)

    def extend(self, sample: Sample) -> Sample:
        """The layer in front of the rest of the ink, whose front face it takes over."""
        ink = next(one for one in sample.layers if one.name == self.layer)
        name = f"{ink.name}_surface"
        depth, asymmetry, albedo = (t.name for t in self.terms)
        # Its optical thickness is its thickness in um, with an extinction coefficient of 1/um.
        ties = {
            "refractive_index": f"{ink.name}.refractive_index",
            "thickness_um": depth,
            "scattering_per_mm": f"1000 * {albedo}",
            "absorption_per_mm": f"1000 * (1 - {albedo})",
            "asymmetry_parameter": asymmetry,
        }
        tied = (Parameter(f"{name}.{k}", np.nan, False, -np.inf, np.inf, "", tie) for k, tie in ties.items())
        upper = Layer(name, "scattering", "henyey_greenstein", roughness=ink.roughness)
        position = sample.layers.index(ink)
        rest = dataclasses.replace(ink, roughness=())
        layers = (*sample.layers[:position], upper, rest, *sample.layers[position + 1 :])
        return with_parameters(dataclasses.replace(sample, layers=layers), *self.terms, *tied)


def _why_without_surface_layer(sample: Sample, ink: Layer) -> str:
    """Why an ink cannot have a surface layer; empty if it can."""
    if not ink.opaque:
        return Inapplicable("the ink is not opaque; depth_gradient represents a change with depth")
    if ink.phase_function == "mie":
        return _NOT_BY_ALBEDO
    if f"{ink.name}.refractive_index" not in sample.parameters:
        return Inapplicable("the ink's index depends on the wavelength")
    return ""


def _why_undividable(sample: Sample, ink: Layer) -> str:
    """Why an ink cannot be divided into halves; empty if it can."""
    if ink.opaque or ink.populations:
        return Inapplicable(
            "the ink is opaque (then surface_layer is tested), or has several kinds of particles"
        )
    if any(n.startswith(f"{ink.name}.") and "@" in n for n in sample.parameters):
        return Inapplicable("the ink has parameters given by wavelength, which its halves cannot share")
    if f"{ink.name}.{_concentration(ink)}" not in sample.parameters:
        return Inapplicable("the ink has no parameter for its concentration that could vary with depth")
    if ink.roughness and len(ink.roughness) > 1:
        return Inapplicable("the ink has two rough faces")
    return ""


def _concentration(ink: Layer) -> str:
    """Key of the parameter proportional to the number of scatterers."""
    return "volume_fraction" if ink.phase_function == "mie" else "scattering_per_mm"


def _tied(parameter: Parameter, name: str, tie: str) -> Parameter:
    """A copy of a parameter under another name, with a formula as its value."""
    return dataclasses.replace(
        parameter, name=name, value=np.nan, tie=tie, free=False, prior=None, minimum=-np.inf, maximum=np.inf
    )


class InkAbsorption(_MieTerm):
    """The binder of a Mie ink absorbs."""

    name, key, maximum, unit = "ink_absorption", "binder_absorption_per_mm", 50.0, "1/mm"
    statement = "the binder of the ink absorbs"
    numbered = "the binder of the ink absorbs, with a coefficient of {binder_absorption_per_mm}"

    @classmethod
    def forms(cls, case: Case):
        ink = case.inks[0]
        if ink.phase_function == "mie":
            return cls.of_mie_ink(case)
        names = case.each(f"{ink.name}.absorption_per_mm") or case.each(
            f"{ink.name}.single_scattering_albedo"
        )
        if any(case.sample.parameters[n].free for n in names):
            return Inapplicable("the absorption of the ink is already a free parameter")
        name = f"{ink.name}.absorption_per_mm"
        if any(d.name == name for d in case.sample.dispersions):
            return Inapplicable("the absorption of the ink follows a law with parameters of its own")
        if name not in names:
            return Inapplicable("the ink's albedo is declared, which includes absorption")
        declared = case.declared(name)
        return (_DeclaredAbsorption(freed(case.sample, name, declared, declared + 50.0)),)


class _DeclaredAbsorption(DeclaredConstant):
    """The same for an ink with declared coefficients."""

    name, may_be_negative, group = "ink_absorption", False, "volume"
    statement = "the ink absorbs more than declared"


@dataclasses.dataclass(frozen=True)
class SecondLobe(SampleEffect):
    """A second lobe of the phase function."""

    layer: str

    name, usual = "second_lobe", 0.1
    statement = "the phase function has a second lobe"
    numbered = (
        "{second_weight%} of the scattering is in a second lobe, with "
        "an asymmetry parameter of {second_asymmetry_parameter}"
    )

    @classmethod
    def forms(cls, case: Case):
        ink = case.inks[0]
        if ink.phase_function != "henyey_greenstein":
            return Inapplicable("the phase function is not a Henyey-Greenstein function")
        return (cls(ink.name),)

    @property
    def terms(self):
        """Share of the scattering in it, and its asymmetry parameter."""
        return (
            Parameter(f"{self.layer}.second_weight", 0.0, True, 0.0, 0.6),
            Parameter(f"{self.layer}.second_asymmetry_parameter", -0.4, True, -0.9, 0.97),
        )

    @property
    def settings(self):
        return tuple({self.terms[1].name: g} for g in (-0.8, -0.4, 0.0, 0.4, 0.8, 0.95))

    def extend(self, sample: Sample) -> Sample:
        changed = with_changed_layer(sample, self.layer, phase_function="two_term_henyey_greenstein")
        return with_parameters(changed, *self.terms)


@dataclasses.dataclass(frozen=True)
class ShadowHiding(ReadingEffect):
    """Particles hide their shadows in the direction of the source (Hapke).

    The strength B0 multiplies the reflected BSDF by 1 + B0 / (1 + tan(psi / 2) / h), where psi is the angle
    from the source. It multiplies all of it instead of single scattering only, which is an overestimate for
    bright samples.
    """

    name, group, usual = "shadow_hiding", "volume", 0.2
    statement = "reflection is enhanced around the source by shadow hiding"
    numbered = (
        "reflection is enhanced around the source by shadow hiding, by {amplitude%} with a width of {width}"
    )
    terms = terms_of("shadow_hiding")
    settings = tuple({"shadow_hiding.width": width} for width in (0.03, 0.1, 0.3))

    @classmethod
    def forms(cls, case: Case):
        reflects = ~case.scene.is_transmission
        near = np.asarray(case.scene.from_retro_deg)[reflects]
        if not np.any(near < 20):
            return "no point in reflection is within 20 degrees of the source"
        return (cls(),)

    def change(self, predicted, values, field):
        lobe = 1 / (1 + jnp.tan(jnp.deg2rad(field.scene.from_retro_deg) / 2) / values["shadow_hiding.width"])
        reflects = ~field.scene.is_transmission
        return predicted * (1 + values["shadow_hiding.amplitude"] * lobe * reflects)


VOLUME = (
    StructureFactor,
    Polydispersity,
    SecondPopulation,
    DepthGradient,
    SurfaceLayer,
    InkAbsorption,
    SecondLobe,
    ShadowHiding,
)
