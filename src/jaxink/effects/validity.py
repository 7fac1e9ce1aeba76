"""How far the models of effects can be trusted: the range of their values, and errors of their own."""

from collections.abc import Iterable, Mapping

import jax.numpy as jnp
import numpy as np

from jaxink.effects.kinds import Effect
from jaxink.effects.surfaces import WaveSurface
from jaxink.sample import Parameter, Sample
from jaxink.surfaces import LARGEST_SLOPE, KCorrelation

# Distance from the end of a range, as a share of the range, that counts as the end.
_AT_END = 1e-4
# Root mean squares. The share of light seen in a limited field is off by so much
# (docs/validation/time-to-answer.md); of facets, an allowance below what photons followed one by one resolve
# (docs/validation/monte-carlo.md).
_OF_FACETS, _OF_LATERAL_LOSS = 1e-3, 2.5e-3


def invalidity(effect: Effect, values: Mapping[str, float], wavelengths_nm: Iterable[float]) -> str:
    """Why fitted values do not mean what the effect says; empty if they may.

    Parameters
    ----------
    effect
        The effect.
    values
        Of its terms at least.
    wavelengths_nm
        Of the measurement.
    """
    reasons = [_at_end(term, values[term.name]) for term in effect.terms if term.name in values]
    if isinstance(effect, WaveSurface):
        reasons.append(_steep(effect, values, wavelengths_nm))
    return " and ".join(filter(None, reasons))


def _at_end(term: Parameter, value: float) -> str:
    """Ends at which nothing, or all of the area, has the property are possible states."""
    width = _AT_END * (term.maximum - term.minimum)
    ends = [end for end in (term.minimum, term.maximum) if end != 0 and not (end == 1 and not term.unit)]
    if not any(abs(value - end) <= min(width, _AT_END * abs(end)) for end in ends):
        return ""
    return f"{term.name} is at the end of its range ({value:.4g}{' ' if term.unit else ''}{term.unit})"


def _steep(effect: WaveSurface, values: Mapping[str, float], wavelengths_nm: Iterable[float]) -> str:
    """Frequencies that scatter into the outer half-space are too steep for perturbation theory."""
    height, length, exponent = (values[term.name] for term in effect.terms)
    # Light in air; longer frequencies scatter at grazing incidence only.
    highest = jnp.asarray(1000.0 / np.min(list(wavelengths_nm)))
    spectrum = KCorrelation(*map(jnp.asarray, (height**2, length, exponent)))
    slope = float(jnp.sqrt(spectrum.slope_variance_below(highest)))
    if slope <= LARGEST_SLOPE:
        return ""
    return f"its root mean square slope is {slope:.2g}, where the theory allows {LARGEST_SLOPE:g}"


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
