"""What the experimenter knows of a sample; no JAX is needed to read it."""

from jaxink.sample.archive import sample_from_dict, sample_to_dict
from jaxink.sample.description import Layer, Noise, Roughness, Sample, load_sample, parse_sample
from jaxink.sample.parameters import Parameter, ParameterTable, Prior

__all__ = [
    "Layer",
    "Noise",
    "Parameter",
    "ParameterTable",
    "Prior",
    "Roughness",
    "Sample",
    "load_sample",
    "parse_sample",
    "sample_from_dict",
    "sample_to_dict",
]
