"""Light emitted by a layer, added to the BSDF of a sample."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.effects.kinds import EmittingEffect
from jaxink.errors import InputRefusedError
from jaxink.model.forward import ForwardModel
from jaxink.sample import Sample


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
