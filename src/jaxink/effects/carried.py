"""What a model with effects takes over from the model of the sample that it contains."""

import abc
from collections.abc import Mapping

import equinox as eqx

from jaxink.display.brief import brief_repr
from jaxink.model import ForwardModel, LayerCoefficients, ReadingsModel
from jaxink.sample import Sample
from jaxink.solver import DEFAULT_ACCURACY, SolverConfig


class CarriedModel(eqx.Module):
    """A model of a sample with effects.

    Parameters
    ----------
    main
        Model of the sample with the effects that change it.
    """

    __repr__ = brief_repr
    # See `SampleModel`.
    __hash__ = object.__hash__

    main: eqx.AbstractVar[ForwardModel | ReadingsModel]

    @property
    def sample(self) -> Sample:
        """The sample with the effects' parameters."""
        return self.main.sample

    @property
    def wavelengths_nm(self) -> tuple[float, ...]:
        """Wavelengths of what is predicted, ascending."""
        return self.main.wavelengths_nm

    @property
    def config(self) -> SolverConfig:
        """Resolution of the solver."""
        return self.main.config

    @abc.abstractmethod
    def bsdf(self, values: Mapping | None = None):
        """What is predicted; ``values`` by name take the place of those of the sample's table."""

    def sizes(
        self, values: Mapping, accuracy: float = DEFAULT_ACCURACY, layer_method: str = "fastest"
    ) -> SolverConfig:
        """See `ForwardModel.sizes`."""
        return self.main.sizes(values, accuracy, layer_method)

    def coefficients(self, values: Mapping | None = None) -> dict[str, LayerCoefficients]:
        """See `ForwardModel.coefficients`."""
        return self.main.coefficients(values)
