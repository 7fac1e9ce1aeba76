"""What the experimenter knows about a sample; reading it does not need JAX."""

from jaxink.measurement import Noise
from jaxink.sample.archive import sample_from_dict, sample_to_dict
from jaxink.sample.declared_effects import DeclaredEffect
from jaxink.sample.description import Backing, Layer, Sample
from jaxink.sample.dispersion import Dispersion
from jaxink.sample.parameters import Parameter, ParameterTable, Prior, Smoothness
from jaxink.sample.populations import Population
from jaxink.sample.reading import load_sample, parse_sample
from jaxink.sample.roughness import Roughness
from jaxink.sample.writing import sample_text

__all__ = [
    "Backing",
    "DeclaredEffect",
    "Dispersion",
    "Layer",
    "Noise",
    "Parameter",
    "ParameterTable",
    "Population",
    "Prior",
    "Smoothness",
    "Roughness",
    "Sample",
    "load_sample",
    "parse_sample",
    "sample_from_dict",
    "sample_text",
    "sample_to_dict",
]
