"""What the experimenter knows about a sample; reading it does not need JAX."""

from jaxink.measurement import Noise
from jaxink.sample.archive import NULLS, sample_from_dict, sample_to_dict
from jaxink.sample.declared_effects import DeclaredEffect
from jaxink.sample.description import Backing, Layer, Sample
from jaxink.sample.dispersion import Dispersion
from jaxink.sample.document import document_of, text_of
from jaxink.sample.draft import (
    ASYMMETRIES,
    DRAFTED_PHASE_FUNCTIONS,
    ORDERS,
    Draft,
    chosen_wavelengths,
    draft_text,
    lit_order,
)
from jaxink.sample.effect_schema import EFFECTS, defaults_of, terms_of
from jaxink.sample.entries import (
    bounded,
    choice,
    missing,
    only,
    refuse_sample,
    require_version,
    table_of,
    true_or_false,
)
from jaxink.sample.heights import read_map
from jaxink.sample.ink_mixtures import MIXED, require_no_unused
from jaxink.sample.layer_reading import layer_tables
from jaxink.sample.measurement_schema import TOP, WAVELENGTH_NM
from jaxink.sample.parameters import Parameter, ParameterTable, Prior, Smoothness
from jaxink.sample.populations import Population
from jaxink.sample.reading import load_sample, parse_sample, sample_of_document
from jaxink.sample.replacing import AMBIGUOUS, assigned, converted, is_length
from jaxink.sample.residual_weight import ResidualWeight
from jaxink.sample.roughness import Roughness
from jaxink.sample.schema import (
    OPAQUE,
    PHASE_WORDS,
    ROUGHNESS,
    SPECTRA,
    SURROUNDINGS,
    Entry,
    Quantity,
    quoted,
)
from jaxink.sample.turning import OPPOSITE_FACE, opposite_medium, turned_layers, turned_over
from jaxink.sample.writing import sample_text

__all__ = [
    "AMBIGUOUS",
    "ASYMMETRIES",
    "EFFECTS",
    "MIXED",
    "NULLS",
    "OPAQUE",
    "PHASE_WORDS",
    "OPPOSITE_FACE",
    "ORDERS",
    "DRAFTED_PHASE_FUNCTIONS",
    "ROUGHNESS",
    "SPECTRA",
    "SURROUNDINGS",
    "TOP",
    "WAVELENGTH_NM",
    "Backing",
    "DeclaredEffect",
    "Dispersion",
    "Draft",
    "Entry",
    "Layer",
    "Noise",
    "Parameter",
    "ParameterTable",
    "Population",
    "Prior",
    "Quantity",
    "ResidualWeight",
    "Roughness",
    "Sample",
    "Smoothness",
    "assigned",
    "bounded",
    "choice",
    "chosen_wavelengths",
    "converted",
    "defaults_of",
    "document_of",
    "draft_text",
    "is_length",
    "layer_tables",
    "lit_order",
    "load_sample",
    "missing",
    "only",
    "opposite_medium",
    "parse_sample",
    "quoted",
    "read_map",
    "refuse_sample",
    "require_no_unused",
    "require_version",
    "sample_from_dict",
    "sample_of_document",
    "sample_text",
    "sample_to_dict",
    "table_of",
    "terms_of",
    "text_of",
    "true_or_false",
    "turned_layers",
    "turned_over",
]
