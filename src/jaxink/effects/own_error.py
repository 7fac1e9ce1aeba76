"""Errors that are allowed for the models of some effects, as a share of the BSDF."""

from jaxink.sample import Sample

# Root mean squares. The share of light seen in a limited field is off by so much
# (docs/validation/time-to-answer.md); of facets, an allowance below what photons followed one by one resolve
# (docs/validation/monte-carlo.md).
_OF_FACETS, _OF_LATERAL_LOSS = 1e-3, 2.5e-3


def own_error(sample: Sample) -> float:
    """Root mean square relative error allowed for a sample's model, beyond that of the discretisation.

    A residual of this size is no sign of anything that is missing.

    Parameters
    ----------
    sample
        With all its effects.

    Returns
    -------
    float
        0 for plane layers between smooth faces, seen in whole.
    """
    has_facets = any(rough.density is not None for layer in sample.layers for rough in layer.roughness)
    of_field = _OF_LATERAL_LOSS if sample.detector_diameter_mm is not None else 0.0
    return max(_OF_FACETS if has_facets else 0.0, of_field)
