"""Fluorescence of an ink: light absorbed at some wavelengths is emitted at longer ones."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.effects.case import Case
from jaxink.effects.kinds import Couplings, EmittingEffect
from jaxink.effects.sample_edits import ink_of
from jaxink.errors import InputRefusedError
from jaxink.model import ForwardModel
from jaxink.sample import EFFECTS, Parameter, Sample

_YIELD = "fluorescence.quantum_yield"
_BELOW = "fluorescence.absorption_below_per_mm"
# Of a screen's setting.
_TYPICAL_YIELD = 0.1
# Share of the photons at the leading wavelength of a setting; the others have equal parts of the rest, so
# that a refit starts inside their ranges.
_LEADING = 0.7
# Absorption of light below all wavelengths: only its product with the yield is determined.
_UNMEASURED_PER_MM = 100.0
# Largest numbers of exciting bands and, of each, leading wavelengths that are tried.
_MOST_BANDS, _MOST_LEADING = 6, 4


@dataclasses.dataclass(frozen=True)
class Fluorescence(EmittingEffect):
    """An ink emits part of the photons that it absorbs at longer wavelengths.

    Each of the wavelengths stands for a band; all bands are equally wide. A band excites emission at longer
    wavelengths only, so that a photon is emitted once (no cascade).

    Parameters
    ----------
    layer
        The ink.
    wavelengths_nm
        Those of the sample file, ascending.
    illumination
        Wavelengths in nm and relative powers per nm of the light on the sample if the detector resolves
        wavelengths; None if the light has one wavelength and the detector is sensitive to all.
    n_exciting
        Bands that excite, the shortest ones; 0: light of shorter wavelengths; None: as the parameters say.
    """

    layer: str
    wavelengths_nm: tuple[float, ...]
    illumination: tuple[tuple[float, ...], tuple[float, ...]] | None
    n_exciting: int | None = None

    name, group, usual = "fluorescence", "wave optics", 0.05
    statement = "the ink fluoresces"

    @property
    def numbered(self):
        total = "the ink fluoresces with a quantum yield of {quantum_yield%}"
        if self.n_exciting is None:
            # Too many numbers for a sentence.
            return ""
        if len(self.terms) == 1:
            return total
        return f"{total}; the shares of the photons that no shorter wavelength has are {{emission%}}"

    @classmethod
    def forms(cls, case: Case):
        """Those without and with light below the wavelengths, for each number of exciting bands."""
        found = _fluorescence(case.sample, None)
        if isinstance(found, str):
            return found
        n = len(found.wavelengths_nm)
        # A broadband detector also sees what is emitted beyond the longest wavelength.
        last = n - 1 if found.is_resolved else n
        bands = np.unique(np.linspace(1, last, min(_MOST_BANDS, last)).round().astype(int)).tolist()
        if found.is_resolved and found.unmeasured_photons > 0:
            bands = [0, *bands]
        forms = tuple(dataclasses.replace(found, n_exciting=k) for k in bands)
        return forms or "light emitted at wavelengths longer than those measured is not seen"

    @classmethod
    def of_sample(cls, sample, layer=None):
        found = _fluorescence(sample, layer)
        if isinstance(found, str):
            raise InputRefusedError(f"[effects.fluorescence]: {found}.")
        return found

    @property
    def form(self):
        return {"layer": self.layer}

    @property
    def is_resolved(self):
        return self.illumination is not None

    @property
    def carrier(self):
        """All forms are cases of it, by the values of its parameters."""
        return dataclasses.replace(self, n_exciting=None)

    @property
    def terms(self):
        """The yield, and in a form what is free beside it: the emission at longer wavelengths."""
        numbers = EFFECTS["fluorescence"].numbers

        def parameter(key, value, free, wave=None):
            q, at = numbers[key], "" if wave is None else f"@{wave:g}"
            return Parameter(f"fluorescence.{key}{at}", value, free, q.lowest, q.highest, q.unit)

        strength, waves = parameter("quantum_yield", 0.0, True), self.wavelengths_nm
        if self.n_exciting is not None:
            # A broadband detector does not see where light is emitted; what is left has the last wavelength.
            emitting = waves[self.n_exciting : -1] if self.is_resolved else ()
            return strength, *(parameter("emission", 0.5, True, wave) for wave in emitting)
        return (
            strength,
            *(parameter("excitation", 0.0, False, wave) for wave in waves),
            *(parameter("emission", 1.0, False, wave) for wave in waves),
            parameter("absorption_below_per_mm", 0.0, False),
        )

    @property
    def settings(self):
        """A typical yield with most light at one of the wavelengths; equal shares if unresolved."""
        if self.n_exciting is None:
            return ({_YIELD: _TYPICAL_YIELD},)
        emitting = range(self.n_exciting, len(self.wavelengths_nm))
        n = len(emitting)
        if not self.is_resolved:
            return (self._setting(np.full(n, 1 / max(n, 1))),)
        leading = np.unique(np.linspace(0, n - 1, min(_MOST_LEADING, n)).round().astype(int))
        bands = np.full((n, n), (1 - _LEADING) / max(n - 1, 1))
        np.fill_diagonal(bands, _LEADING if n > 1 else 1.0)
        return tuple(self._setting(bands[k]) for k in leading)

    def _setting(self, shares: Float[np.ndarray, " emitting"]) -> dict[str, float]:
        """Values of all parameters for shares of the photons emitted at each wavelength that may emit."""
        waves, n_exciting = self.wavelengths_nm, self.n_exciting or 0
        every = np.concatenate([np.zeros(n_exciting), shares])
        left = np.cumsum(every[::-1])[::-1]
        emission = np.where(left > 0, every / np.where(left > 0, left, 1.0), 0.0)
        excitation = (np.arange(len(waves)) < n_exciting).astype(float)
        values = {_YIELD: _TYPICAL_YIELD, _BELOW: 0.0 if n_exciting else _UNMEASURED_PER_MM}
        for key, column in (("excitation", excitation), ("emission", emission)):
            values |= {f"fluorescence.{key}@{w:g}": float(x) for w, x in zip(waves, column, strict=True)}
        return values

    def couplings(self, values):
        """Photons absorbed, times yield and emission, over those incident at the wavelength read."""
        nm = np.array(self.wavelengths_nm)
        longer = nm[:, None] < nm
        emission = _shares(self._each("emission", values))
        excitation = values[_YIELD] * self._each("excitation", values)
        nowhere = jnp.zeros(len(nm))
        if self.illumination is None:
            # What is emitted nowhere else is longer than all wavelengths.
            lost = jnp.zeros((len(nm), len(nm))).at[:, -1].set(1 - jnp.sum(emission))
            energy = np.where(longer, nm[:, None] / nm, 0.0)
            return Couplings(excitation[:, None] * (energy * emission + lost), nowhere)
        photons = nm * np.interp(nm, *self.illumination)
        seen = np.where(photons > 0, 1 / np.where(photons > 0, photons, 1.0), 0.0)
        absorbed = excitation[:, None] * photons[:, None] * longer * (emission * seen)
        below = values[_YIELD] * values[_BELOW] * self.unmeasured_photons
        return Couplings(absorbed, below * emission * seen)

    @property
    def unmeasured_photons(self) -> float:
        """Photons of the illumination below all bands, in units of those of a band with unit power per nm."""
        nm = np.array(self.wavelengths_nm)
        width = float(np.mean(np.diff(nm)))
        given, power = (np.array(column) for column in self.illumination or ((), ()))
        fine = np.linspace(min([*given, nm[0]]), nm[0] - width / 2, 201)
        if fine[0] >= fine[-1]:
            return 0.0
        return float(np.trapezoid(fine * np.interp(fine, given, power), fine)) / width

    def _each(self, key: str, values: Mapping[str, Any]) -> Float[Array, " wavelengths"]:
        """Values of a parameter that has one for each wavelength, or one for all."""
        name = f"fluorescence.{key}"
        found = (values[f"{name}@{w:g}"] if name not in values else values[name] for w in self.wavelengths_nm)
        return jnp.stack([jnp.asarray(value, float) for value in found])


def _shares(emission: Float[Array, " wavelengths"]) -> Float[Array, " wavelengths"]:
    """Share of all photons that each wavelength has, from its share of those that no shorter one has."""
    left = jnp.cumprod(1 - emission)
    return emission * jnp.concatenate([jnp.ones(1), left[:-1]])


def _fluorescence(sample: Sample, layer: str | None) -> Fluorescence | str:
    """The effect for the instrument of a sample, or what is missing."""
    if sample.detector_mode is None:
        return "the detector is not described: add instrument.detector_mode to the sample file"
    resolved = sample.detector_mode == "spectrometer"
    if resolved and sample.illumination is None:
        return "the exciting illumination is unknown: add instrument.illumination to the sample file"
    if not sample.wavelengths_nm or (resolved and len(sample.wavelengths_nm) < 2):
        return "wavelength_nm of the sample file must name the wavelengths that excite and are emitted"
    if sample.beam_diameter_mm is not None or "instrument.beam_diameter_mm" in sample.parameters:
        return "emitted light that leaves outside the field of view is not computed"
    ink = ink_of(sample, "fluorescence", layer)
    if ink.opaque:
        return "the ink is opaque, so that depths at different wavelengths cannot be compared"
    return Fluorescence(ink.name, sample.wavelengths_nm, sample.illumination if resolved else None)


class Emission(eqx.Module):
    """Emission of an effect in all directions of a forward model.

    Parameters
    ----------
    effect
        The effect.
    layers
        Positions of the layers that emit: the effect's, or the parts into which another effect divides it.
    model
        The forward model in all its directions at each of the effect's wavelengths.
    row
        Position of each direction, at its own wavelength, among the points of that model.
    """

    __repr__ = brief_repr

    effect: EmittingEffect = eqx.field(static=True)
    layers: tuple[int, ...] = eqx.field(static=True)
    model: ForwardModel
    row: Int[np.ndarray, " points"]

    def bsdf(self, values) -> Float[Array, " points"]:
        """Emitted light at the directions, 1/sr, from the values of all parameters."""
        profiles = self.model.depth_profiles(self.layers, values)
        couplings = self.effect.couplings(values)
        if self.effect.is_resolved:
            found = profiles.emitted(*couplings)
        else:
            found = profiles.emitted_in_all(couplings.absorbed)
        return self.model.emitted_at_points(found)[self.row]


def emission_of(effect: EmittingEffect, whole: Sample, divided: Sample, directions, make) -> Emission | None:
    """Emission of an effect; None if the sample lacks the layer.

    Parameters
    ----------
    effect
        The effect.
    whole, divided
        The sample before and after effects that divide layers.
    directions
        Columns of the directions: incidence, polar angle, azimuth, wavelength, side.
    make
        Forward model of the sample, from such columns.

    Raises
    ------
    InputRefusedError
        A direction has a wavelength that the effect does not know.
    """
    known = {layer.name for layer in whole.layers} - {effect.layer}
    parts = [
        k
        for k, layer in enumerate(divided.layers)
        if layer.name == effect.layer
        or (layer.name not in known and layer.name.startswith(f"{effect.layer}_"))
    ]
    if effect.layer not in {layer.name for layer in whole.layers}:
        return None
    waves, wave = np.array(effect.wavelengths_nm), np.asarray(directions[3], float)
    if not np.all(np.isin(wave, waves)):
        other = wave[~np.isin(wave, waves)][0]
        raise InputRefusedError(
            f"[effects.{effect.name}]: the emission at {other:g} nm is unknown; it is described at the "
            "wavelengths of wavelength_nm only."
        )
    repeated = [np.tile(column, waves.size) for column in directions]
    repeated[3] = np.repeat(waves, wave.size)
    row = np.searchsorted(waves, wave) * wave.size + np.arange(wave.size)
    return Emission(effect, tuple(parts), make(*repeated), row)
