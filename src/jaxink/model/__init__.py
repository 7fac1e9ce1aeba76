"""Predicted BSDF of a sample at the points of a measurement."""

from jaxink.model.build import StackBuilder, structure_of
from jaxink.model.checks import wavelengths_without_values
from jaxink.model.forward import ForwardModel, evaluate, why_not_polarised
from jaxink.model.readings import ReadingsModel
from jaxink.model.sample_model import SampleModel
from jaxink.model.size_classes import mie_sizes
from jaxink.model.volume import LayerCoefficients, volume_scattering

__all__ = [
    "ForwardModel",
    "LayerCoefficients",
    "ReadingsModel",
    "SampleModel",
    "StackBuilder",
    "evaluate",
    "mie_sizes",
    "structure_of",
    "volume_scattering",
    "wavelengths_without_values",
    "why_not_polarised",
]
