"""Effects of wave optics and of the spectrum."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from jaxink.effects.case import Case
from jaxink.effects.kinds import Effect, ReadingEffect, SampleEffect
from jaxink.effects.sample_edits import ink_of, with_parameters
from jaxink.errors import InputRefusedError
from jaxink.sample import Dispersion, Parameter, Sample
from jaxink.sample.effect_schema import terms_of

# Excitation and emission of optical brighteners.
_EXCITED_NM, _EMITTED_NM = (320.0, 420.0), (420.0, 500.0)
# A goniometer does not resolve the fringes of a thicker film.
_THICKEST_UM = 10.0


@dataclasses.dataclass(frozen=True)
class Fluorescence(ReadingEffect):
    """Light of short wavelengths is re-emitted at longer ones, Lambertian, as by an optical brightener.

    The strength is the share of the exciting light that is emitted, half of it on each side.

    Parameters
    ----------
    spectrum
        Wavelengths in nm and relative powers of the illumination if the detector resolves wavelengths; None
        if the illumination has one wavelength and the detector is sensitive to all.
    """

    spectrum: tuple[tuple[float, ...], tuple[float, ...]] | None

    name, group, usual = "fluorescence", "wave optics", 0.05
    statement = "the sample fluoresces"
    terms = terms_of("fluorescence")

    @classmethod
    def forms(cls, case: Case):
        form = _fluorescence(case.sample)
        if isinstance(form, str):
            return form
        seen = form.gain(np.asarray(case.scene.wavelength_nm))
        if not np.any(seen > 0):
            return "no measured wavelength is in the range where a brightener would be visible"
        return (form,)

    @classmethod
    def of_sample(cls, sample):
        form = _fluorescence(sample)
        if isinstance(form, str):
            raise InputRefusedError(f"[effects.fluorescence]: {form}.")
        return form

    @property
    def form(self):
        return {}

    def gain(self, wavelength_nm):
        """Emitted light detected at a wavelength, relative to the light incident on the sample there."""
        wave = np.asarray(wavelength_nm)
        if self.spectrum is None:
            return ((wave >= _EXCITED_NM[0]) & (wave <= _EXCITED_NM[1])).astype(float)
        nm, power = (np.array(column) for column in self.spectrum)
        fine = np.linspace(*_EXCITED_NM, 101)
        exciting = np.trapezoid(np.interp(fine, nm, power, 0.0, 0.0), fine)
        low, high = _EMITTED_NM
        band = np.clip(1 - np.abs(wave - (low + high) / 2) / ((high - low) / 2), 0, None) * 2 / (high - low)
        here = np.interp(wave, nm, power)
        return np.where(here > 0, exciting * band / np.where(here > 0, here, 1.0), 0.0)

    def change(self, predicted, values, field):
        """Return y = f + s g / (2 pi), half of it on each side."""
        waves = field.scene.waves
        gain = jnp.asarray(self.gain(np.array(waves)))
        return predicted + values["fluorescence.share"] / (2 * jnp.pi) * gain[field.scene.wave_of_point]


def _fluorescence(sample: Sample) -> Fluorescence | str:
    """The form for the instrument of a sample, or what is missing."""
    if sample.detector_mode is None:
        return "the detector is not described: add instrument.detector_mode to the sample file"
    if sample.detector_mode == "spectrometer" and sample.illumination is None:
        return "the exciting illumination is unknown: add instrument.illumination to the sample file"
    return Fluorescence(sample.illumination if sample.detector_mode == "spectrometer" else None)


@dataclasses.dataclass(frozen=True)
class CoherentBackscatter(ReadingEffect):
    """Waves that travel the same path in opposite directions interfere constructively towards the source.

    Akkermans, Wolf, Maynard 1986.
    """

    name, group, usual = "coherent_backscatter", "wave optics", 0.3
    statement = "coherent backscattering enhances reflection in a narrow cone around the source"
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


class Polarisation(Effect):
    """Light is polarised, but the solver is scalar; this effect has no kind, because nothing computes it."""

    name, group, sign = "polarisation", "wave optics", 0
    statement = "polarisation matters"

    @classmethod
    def forms(cls, case: Case):
        return "the solver is scalar; a vector solver would be needed"


@dataclasses.dataclass(frozen=True)
class BinderDispersion(SampleEffect):
    """The binder's refractive index depends on the wavelength; the strength is Cauchy's B."""

    layer: str
    middle_nm: float

    name, group, sign, usual = "dispersion", "wave optics", 0, 0.005
    changes_structure, scales = True, True
    statement = "the refractive index of the binder depends on the wavelength"
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
            return "the ink's index is free, or already has a dispersion"
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
        return tuple(found[:1]) or f"no layer is thinner than {_THICKEST_UM:g} um"

    def change(self, predicted, values, field):
        """Return y = f (1 + s cos(4 pi n d cos(theta) / lambda + phase)) in reflection."""
        scene = field.scene
        sine = jnp.sin(jnp.deg2rad(scene.theta_o_deg)) / self.refractive_index
        way = 2 * self.refractive_index * self.thickness_um * jnp.sqrt(1 - sine**2)
        fringe = jnp.cos(2 * jnp.pi * way / (scene.wavelength_nm / 1000) + values["interference.phase_rad"])
        return predicted * (1 + values["interference.amplitude"] * fringe * ~scene.is_transmission)


WAVES = (Fluorescence, CoherentBackscatter, Polarisation, BinderDispersion, Interference)
