"""A model of readings with the effects that a sample declares."""

import dataclasses
from collections.abc import Collection, Mapping

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxink.effects.augmented import carriers, extend
from jaxink.effects.carried import CarriedModel
from jaxink.effects.kinds import Effect, SampleEffect, ScalingEffect
from jaxink.errors import InputRefusedError
from jaxink.measurement import Readings
from jaxink.model import ReadingsModel
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig


class AugmentedReadings(CarriedModel):
    """Predicts readings of a sample with effects that change the sample, or scale what is read.

    Parameters
    ----------
    main
        Model of the sample with the effects that change it.
    scaling
        Effects that scale the readings.
    is_transmission
        Side of each reading.
    """

    main: ReadingsModel
    scaling: tuple[ScalingEffect, ...] = eqx.field(static=True)
    is_transmission: Bool[np.ndarray, " readings"]

    @property
    def wavelength_of_point_nm(self) -> Float[np.ndarray, " readings"]:
        """Wavelength of each reading."""
        return self.main.wavelength_of_point_nm

    @property
    def n_stacks(self) -> int:
        """See `ReadingsModel`."""
        return self.main.n_stacks

    def own_wavelengths(self, names: Collection[str]) -> dict[str, float]:
        """See `ReadingsModel`."""
        return self.main.own_wavelengths(names)

    def bsdf(self, values: Mapping | None = None) -> Float[Array, " readings"]:
        """Predicted values of the readings; see `ReadingsModel.bsdf`."""
        values = self.sample.parameters.values_with({} if values is None else values)
        predicted = self.main.bsdf(values)
        for effect in self.scaling:
            predicted = predicted * effect.factor(values, self.is_transmission)
        return predicted


def readings_model(
    sample: Sample,
    readings: Readings,
    config: SolverConfig | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    layer_method: str = "fastest",
    effects: tuple[Effect, ...] = (),
) -> ReadingsModel | AugmentedReadings:
    """Model of readings, with the effects that the sample declares, and others.

    Parameters
    ----------
    sample
        The sample.
    readings
        What is read.
    config, accuracy, layer_method
        See `ReadingsModel`.
    effects
        Further effects.

    Raises
    ------
    InputRefusedError
        The sample cannot be predicted, or declares an effect of which only a BSDF is known.
    """
    effects = carriers(sample, effects)
    if not effects:
        return ReadingsModel(sample, readings, config, accuracy, layer_method)
    known = tuple(effect for effect in effects if isinstance(effect, SampleEffect | ScalingEffect))
    if len(known) < len(effects):
        names = ", ".join(effect.name for effect in effects if effect not in known)
        raise InputRefusedError(
            f"the sample declares effects ({names}) with which only a BSDF can be predicted; leave them out "
            "for readings of other instruments."
        )
    extended = dataclasses.replace(extend(sample, known), effects=())
    main = ReadingsModel(extended, readings, config, accuracy, layer_method)
    scaling = tuple(effect for effect in known if isinstance(effect, ScalingEffect))
    return AugmentedReadings(main, scaling, readings.is_transmission)
