"""Effects of wave optics and of the spectrum."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from jaxink.effects.case import Case
from jaxink.effects.fluorescence import Fluorescence
from jaxink.effects.kinds import AddedLight, Inapplicable, ReadingEffect, SampleEffect
from jaxink.effects.sample_edits import ink_of, with_parameters
from jaxink.errors import InputRefusedError
from jaxink.model import why_not_polarised
from jaxink.sample import Dispersion, Parameter, Sample, terms_of

# A goniometer does not resolve the fringes of a thicker film.
_THICKEST_UM = 10.0


@dataclasses.dataclass(frozen=True)
class CoherentBackscatter(ReadingEffect):
    """Waves that travel the same path in opposite directions interfere constructively towards the source.

    Akkermans, Wolf, Maynard 1986.
    """

    name, group, usual = "coherent_backscatter", "wave optics", 0.3
    statement = "coherent backscattering enhances reflection in a narrow cone around the source"
    numbered = (
        "coherent backscattering enhances reflection by {enhancement%} in a cone around the source "
        "with a half-width of {half_width_deg}"
    )
    terms = terms_of("coherent_backscatter")
    settings = tuple({"coherent_backscatter.half_width_deg": width} for width in (0.3, 1.0, 2.5))

    @classmethod
    def forms(cls, case: Case):
        near = np.asarray(case.scene.from_retro_deg)[~np.asarray(case.scene.is_transmission)]
        if not np.any(near < 4.0):
            return "no point in reflection is within 4 degrees of the source"
        return (cls(),)

    def change(self, predicted, values, field):
        """Return y = f (1 + s / (1 + psi / w)^2), the line shape of the diffusion approximation."""
        angle = field.scene.from_retro_deg / values[self.terms[1].name]
        line = 1 / (1 + angle) ** 2 * ~field.scene.is_transmission
        return predicted * (1 + values[self.terms[0].name] * line)


@dataclasses.dataclass(frozen=True)
class Polarisation(AddedLight):
    """Scattering and interfaces polarise light, which the solver neglects.

    A strength of 1 is the theory of light scattered twice at most. As higher orders go on in the same sense,
    a thick layer has a larger one.
    """

    name, group, usual = "polarisation", "wave optics", 1.0
    statement = "the scatterers and the interfaces polarise light"
    numbered = "the scatterers and the interfaces polarise light, by {share%} of what two scatterings do"
    terms = terms_of("polarisation")
    settings = ({"polarisation.share": 1.0},)

    @classmethod
    def forms(cls, case: Case):
        return why_not_polarised(case.sample) or (cls(),)

    @classmethod
    def of_sample(cls, sample):
        if reason := why_not_polarised(sample):
            raise InputRefusedError(f"[effects.polarisation] does not suit this sample: {reason}.")
        return cls()

    def added(self, model, values):
        return model.polarised_excess(values)


@dataclasses.dataclass(frozen=True)
class BinderDispersion(SampleEffect):
    """The binder's refractive index depends on the wavelength; the strength is Cauchy's B."""

    layer: str
    middle_nm: float

    name, group, may_be_negative, usual = "dispersion", "wave optics", True, 0.005
    changes_structure, scales = True, True
    statement = "the refractive index of the binder depends on the wavelength"
    numbered = "the refractive index of the binder depends on the wavelength, with Cauchy's B = {b_um2}"
    terms = terms_of("dispersion")
    # Typical of a binder.
    settings = ({"dispersion.b_um2": 0.005},)

    @classmethod
    def forms(cls, case: Case):
        waves = np.unique(case.scene.wavelength_nm)
        name = f"{case.inks[0].name}.refractive_index"
        if waves.size < 2:
            return "only one wavelength was measured"
        if name not in case.sample.parameters or not case.sample.parameters[name].is_fixed:
            return Inapplicable("the ink's index is free, or already has a dispersion")
        return (cls(case.inks[0].name, float(np.mean(waves))),)

    @classmethod
    def of_sample(cls, sample, middle_nm, layer=None):
        ink = ink_of(sample, cls.name, layer)
        index = sample.parameters.get(f"{ink.name}.refractive_index")
        if index is None or not index.is_fixed:
            raise InputRefusedError(
                f"[effects.dispersion] needs a fixed refractive index of '{ink.name}', the same for all "
                "wavelengths."
            )
        return cls(ink.name, middle_nm)

    def extend(self, sample: Sample) -> Sample:
        """Cauchy's formula with the declared index at the mean wavelength."""
        name = f"{self.layer}.refractive_index"
        formula = Dispersion(name, "cauchy", 1.0, 4.0)
        declared = sample.parameters[name].value
        ties = {
            "a": f"{declared} - dispersion.b_um2 * {(self.middle_nm / 1000) ** -2}",
            "b_um2": "dispersion.b_um2",
        }
        tied = (Parameter(f"{name}.{k}", np.nan, False, -np.inf, np.inf, "", tie) for k, tie in ties.items())
        changed = dataclasses.replace(sample, dispersions=(*sample.dispersions, formula))
        return with_parameters(changed, self.terms[0], *tied, Parameter(f"{name}.c_um4", 0.0))


@dataclasses.dataclass(frozen=True)
class Interference(ReadingEffect):
    """A thin smooth layer causes interference fringes in reflection."""

    thickness_um: float
    refractive_index: float

    name, group, usual = "interference", "wave optics", 0.05
    statement = "a thin layer causes interference fringes"
    numbered = "a thin layer causes interference fringes of {amplitude%} with a phase of {phase_rad}"
    terms = terms_of("interference")
    settings = tuple({"interference.phase_rad": phase} for phase in (0.0, 1.57, 3.14, -1.57))

    @classmethod
    def forms(cls, case: Case):
        found = []
        for layer in case.sample.layers:
            if layer.opaque:
                continue
            key, unit = ("thickness_um", 1.0) if layer.scatters else ("thickness_mm", 1000.0)
            thickness = unit * case.declared(f"{layer.name}.{key}")
            names = case.each(f"{layer.name}.refractive_index")
            if 0 < thickness <= _THICKEST_UM and names:
                found.append(cls(thickness, case.declared(names[0])))
        return tuple(found[:1]) or Inapplicable(f"no layer is thinner than {_THICKEST_UM:g} um")

    def change(self, predicted, values, field):
        """Return y = f (1 + s cos(4 pi n d cos(theta) / lambda + phase)) in reflection."""
        scene = field.scene
        sine = jnp.sin(jnp.deg2rad(scene.theta_o_deg)) / self.refractive_index
        way = 2 * self.refractive_index * self.thickness_um * jnp.sqrt(1 - sine**2)
        fringe = jnp.cos(2 * jnp.pi * way / (scene.wavelength_nm / 1000) + values["interference.phase_rad"])
        return predicted * (1 + values["interference.amplitude"] * fringe * ~scene.is_transmission)


WAVES = (Fluorescence, CoherentBackscatter, Polarisation, BinderDispersion, Interference)
