"""Effects of a relief: the surface of the body is not plane."""

import dataclasses

import jax

from jaxink.effects.case import Case
from jaxink.effects.kinds import Inapplicable, UnevenSurface
from jaxink.errors import InputRefusedError
from jaxink.sample import Sample
from jaxink.sample.effect_schema import terms_of
from jaxink.surfaces.facet_exchange import FacetExchange
from jaxink.surfaces.relief import facet_averages, mirrored_once, reflected_once, regular_share


@dataclasses.dataclass(frozen=True)
class Relief(UnevenSurface):
    """An opaque ink has a relief of facets that are large against the distances that light travels in it."""

    # Not ``scales``: a face mirrors light into lobes that widen with the variance.
    name = "relief"
    statement = "the surface of the ink is a relief of facets, each of which reflects as the ink does"
    numbered = (
        "the surface of the ink is a relief of facets, each of which reflects as the ink does, with a "
        "variance of the slope of {slope_variance}"
    )
    terms = terms_of("relief")
    settings = tuple({"relief.slope_variance": variance} for variance in (0.005, 0.03, 0.2))

    @classmethod
    def forms(cls, case: Case):
        return _why_without(case.sample) or (cls(),)

    @classmethod
    def of_sample(cls, sample):
        if reason := _why_without(sample):
            raise InputRefusedError(f"[effects.relief] does not suit this sample: {reason}.")
        return cls()

    def shape(self, plane, values):
        """Facets in place of the plane surface: the change by the series, added to the BSDF."""
        variance = values["relief.slope_variance"]
        here = plane.hemisphere
        averages = facet_averages(here.pairs, variance)
        once = reflected_once(here.pairs, here.wave, plane.coefficients, averages, variance)
        exchanged = FacetExchange.of(plane.coefficients, plane.mirror, variance).at(here.theta_deg, here.wave)
        mirrored = mirrored_once(here.pairs, jax.tree.map(lambda x: x[here.wave], plane.mirror), variance)
        bsdf = plane.bsdf + once.facets - once.plane + exchanged + mirrored
        return plane._replace(bsdf=bsdf, regular=plane.regular * regular_share(variance))


def _why_without(sample: Sample) -> str:
    """Why a sample cannot have a relief; empty if it can."""
    layers = sample.layers
    if not (layers[0].scatters and layers[-1].opaque):
        return Inapplicable("a relief is computed for an opaque ink without a plate in front of it")
    if any(layer.roughness for layer in layers):
        return Inapplicable("a face of the ink is declared rough, and both together are not computed")
    if sample.source_half_angle_deg or sample.detector_half_angle_deg:
        return Inapplicable("the source or the detector has a cone, with which a relief is not computed")
    return ""


RELIEF = (Relief,)
