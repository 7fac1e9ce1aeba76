"""What an effect can inspect before it decides how it may change the model."""

import dataclasses

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.effects.scene import Scene
from jaxink.sample import Layer, Sample


@dataclasses.dataclass(frozen=True)
class Case:
    """A sample and its measurement.

    Parameters
    ----------
    sample
        As declared, with the effects found so far.
    scene
        Directions and wavelengths of the measured points.
    noise
        Smallest relative standard deviation of a point.
    accuracy
        Largest relative error of the discretisation.
    """

    __repr__ = brief_repr

    sample: Sample
    scene: Scene
    noise: float = 0.0
    accuracy: float = np.inf

    @property
    def inks(self) -> tuple[Layer, ...]:
        """The scattering layers."""
        return tuple(layer for layer in self.sample.layers if layer.scatters)

    @property
    def plates(self) -> tuple[Layer, ...]:
        """The clear layers."""
        return tuple(layer for layer in self.sample.layers if not layer.scatters)

    @property
    def is_opaque(self) -> bool:
        """Whether no light is transmitted."""
        return self.sample.layers[-1].opaque

    def declared(self, name: str) -> float:
        """Value of a parameter of the sample."""
        return float(self.sample.parameters.values_with({})[name])

    def each(self, name: str) -> tuple[str, ...]:
        """Full names of a parameter: one, one for each wavelength, or none."""
        return tuple(n for n in self.sample.parameters if n.split("@")[0] == name)
