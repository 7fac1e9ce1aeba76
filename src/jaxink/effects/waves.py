"""Effects of waves and spectra, and of the solver's own discretisation."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from jaxink.effects.effect import Case, Effect, with_parameters
from jaxink.sample import Dispersion, Parameter, Sample
from jaxink.solver.config import SolverConfig

# Excitation and emission of optical brighteners.
_EXCITED_NM, _EMITTED_NM = (320.0, 420.0), (420.0, 500.0)
# Of the noise of a point, what no number of points at hand makes visible.
_FAR_BELOW = 0.05
# A film beyond this many wavelengths shows no fringes at the resolution of a goniometer.
_THICKEST_UM = 10.0


@dataclasses.dataclass(frozen=True)
class Fluorescence(Effect):
    """W1: light of short waves comes back longer, flat in angle; a brightener's bands.

    The strength is the share of the exciting light that is emitted, Lambertian, on each side.
    """

    spectrum: tuple[tuple[float, ...], tuple[float, ...]] | None

    name, group, keys = "fluorescence", "waves", ("E12",)
    usual = 0.05
    statement = "the sample fluoresces"
    terms = (Parameter("fluorescence.share", 0.0, True, 0.0, 1.0),)

    @classmethod
    def forms(cls, case: Case):
        """Where the lamp and what the detector sees are known."""
        sample = case.sample
        if sample.detector_mode is None:
            return "the sample file does not say what the detector sees: give instrument.detector_mode"
        if sample.detector_mode == "spectrometer" and sample.illumination is None:
            return "the sample file does not give the illumination that excites: give instrument.illumination"
        form = cls(sample.illumination if sample.detector_mode == "spectrometer" else None)
        seen = form.gain(np.asarray(case.scene.wavelength_nm))
        if not np.any(seen > 0):
            return "no wavelength of the measurement lies where a brightener would be seen"
        return (form,)

    def gain(self, wavelength_nm):
        """Emitted light that is seen at a wavelength, over the light that falls on the sample there."""
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


@dataclasses.dataclass(frozen=True)
class CoherentBackscatter(Effect):
    """W2: waves that go the same way to and fro add up towards the source."""

    name, group = "coherent_backscatter", "waves"
    usual = 0.3
    statement = "reflection is enhanced in a narrow cone around the source, coherently"
    terms = (
        Parameter("coherent_backscatter.enhancement", 0.0, True, 0.0, 1.0),
        Parameter("coherent_backscatter.half_width_deg", 0.5, True, 0.05, 2.5, "deg", scale="log"),
    )

    @classmethod
    def forms(cls, case: Case):
        """Where reflection was measured near the source."""
        near = np.asarray(case.scene.from_retro_deg)[~np.asarray(case.scene.is_transmission)]
        if not np.any(near < 4.0):
            return "no point in reflection lies within 4 degrees of the source"
        return (cls(),)

    @property
    def settings(self):
        """Widths."""
        return tuple({self.terms[1].name: width} for width in (0.3, 1.0, 2.5))

    def change(self, predicted, values, field):
        """Return y = f (1 + s / (1 + psi / w)^2), the diffusion approximation's line."""
        angle = field.scene.from_retro_deg / values[self.terms[1].name]
        line = 1 / (1 + angle) ** 2 * ~field.scene.is_transmission
        return predicted * (1 + values[self.terms[0].name] * line)


@dataclasses.dataclass(frozen=True)
class Polarisation(Effect):
    """W3: light is polarised, the solver is scalar."""

    name, group, sign = "polarisation", "waves", 0
    statement = "polarisation matters"

    @classmethod
    def forms(cls, case: Case):
        """Not before there is a vector solver."""
        return "the solver is scalar; a vector solver would be needed"


@dataclasses.dataclass(frozen=True)
class BinderDispersion(Effect):
    """W4: the binder's index depends on the wavelength, Cauchy's B."""

    layer: str
    declared: float
    middle_um: float

    name, group, sign, own_program, is_scalable = "dispersion", "waves", 0, True, True
    usual = 0.005
    statement = "the refractive index of the binder depends on the wavelength"
    terms = (Parameter("dispersion.b_um2", 0.0, True, -0.02, 0.04, "um^2"),)

    @classmethod
    def forms(cls, case: Case):
        """Where several wavelengths were measured, and the index is one number."""
        waves = np.unique(case.scene.wavelength_nm)
        name = f"{case.inks[0].name}.refractive_index"
        if waves.size < 2:
            return "one wavelength was measured"
        if name not in case.sample.parameters or not case.sample.parameters[name].is_fixed:
            return "the ink's index is free, or has a dispersion already"
        return (cls(case.inks[0].name, case.declared(name), float(np.mean(waves)) / 1000),)

    @property
    def settings(self):
        """As of a common binder."""
        return ({"dispersion.b_um2": 0.005},)

    def extend(self, sample: Sample) -> Sample:
        """Cauchy's formula that has the declared index at the mean wavelength."""
        name = f"{self.layer}.refractive_index"
        formula = Dispersion(name, "cauchy", 1.0, 4.0)
        ties = {
            "a": f"{self.declared} - dispersion.b_um2 * {self.middle_um**-2}",
            "b_um2": "dispersion.b_um2",
        }
        tied = (Parameter(f"{name}.{k}", np.nan, False, -np.inf, np.inf, "", tie) for k, tie in ties.items())
        changed = dataclasses.replace(sample, dispersions=(*sample.dispersions, formula))
        return with_parameters(changed, self.terms[0], *tied, Parameter(f"{name}.c_um4", 0.0))


@dataclasses.dataclass(frozen=True)
class Interference(Effect):
    """W5: a thin smooth layer shows fringes in its reflection."""

    thickness_um: float
    index: float

    name, group = "interference", "waves"
    usual = 0.05
    statement = "a thin layer shows interference"
    terms = (
        Parameter("interference.amplitude", 0.0, True, 0.0, 0.5),
        Parameter("interference.phase_rad", 0.0, True, -np.pi, np.pi, "rad"),
    )

    @classmethod
    def forms(cls, case: Case):
        """Where a layer is thin."""
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

    @property
    def settings(self):
        """Phases."""
        return tuple({"interference.phase_rad": phase} for phase in (0.0, 1.57, 3.14, -1.57))

    def change(self, predicted, values, field):
        """Return y = f (1 + s cos(4 pi n d cos(theta) / lambda + phase)) in reflection."""
        scene = field.scene
        sine = jnp.sin(jnp.deg2rad(scene.theta_o_deg)) / self.index
        way = 2 * self.index * self.thickness_um * jnp.sqrt(1 - sine**2)
        fringe = jnp.cos(2 * jnp.pi * way / (scene.wavelength_nm / 1000) + values["interference.phase_rad"])
        return predicted * (1 + values["interference.amplitude"] * fringe * ~scene.is_transmission)


@dataclasses.dataclass(frozen=True)
class _Finer(Effect):
    """M: the discretisation is too coarse; the strength 1 is the step to one half as fine again."""

    sign, own_program, group = 0, True, "numerics"
    size = ""

    @classmethod
    def forms(cls, case: Case):
        """Where the accuracy that was asked for is not far below the noise."""
        if case.accuracy < _FAR_BELOW * case.noise:
            return (
                f"the discretisation errs by {case.accuracy:g} at most, the noise of a point is "
                f"{case.noise:.2g} or more: its errors cannot be seen"
            )
        return (cls(),)

    @property
    def terms(self):
        """Share of the step."""
        return (Parameter(f"{self.name}.share", 0.0, True, -3.0, 3.0),)

    @property
    def settings(self):
        """The whole step."""
        return ({self.terms[0].name: 1.0},)

    def other(self, sample: Sample) -> Sample:
        """The same sample."""
        return sample

    def refined(self, config: SolverConfig) -> SolverConfig:
        """Half as many again."""
        sizes = ("nodes_escaping", "nodes_trapped") if self.size == "nodes" else (self.size,)
        return dataclasses.replace(config, **{s: round(1.5 * getattr(config, s)) for s in sizes})


class SolverStreams(_Finer):
    """M1: too few streams."""

    name, size = "solver_streams", "nodes"
    statement = "the solver has too few streams"


class SolverMoments(_Finer):
    """M2: the phase function is cut off too early."""

    name, size = "solver_moments", "n_moments"
    statement = "the solver cuts the phase function off too early"


class SolverOrders(_Finer):
    """M3: too few azimuthal orders."""

    name, size = "solver_orders", "n_orders"
    statement = "the solver has too few azimuthal orders"


WAVES = (
    Fluorescence,
    CoherentBackscatter,
    Polarisation,
    BinderDispersion,
    Interference,
    SolverStreams,
    SolverMoments,
    SolverOrders,
)
