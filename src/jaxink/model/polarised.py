"""What polarisation changes in the BSDF of a sample."""

from collections.abc import Mapping

from jaxtyping import Array, Float

from jaxink.model.build import StackBuilder
from jaxink.optics import Directions
from jaxink.sample import Sample
from jaxink.solver import polarised_excess

_KNOWN = ("mie", "rayleigh")


def why_not_polarised(sample: Sample) -> str:
    """Why it is not known how a sample polarises light; empty if it is."""
    unknown = [layer.name for layer in sample.layers if layer.scatters and layer.phase_function not in _KNOWN]
    if not unknown:
        return ""
    return f"the phase function of '{unknown[0]}' says nothing of polarisation; Mie and Rayleigh particles do"


def excess_at(
    builder: StackBuilder, values: Mapping, wavelength_nm, directions: Directions
) -> Float[Array, " pairs"]:
    """Polarised minus scalar BSDF at one wavelength, 1/sr; rough interfaces count as smooth."""
    stack = builder.stack(values, wavelength_nm)
    return polarised_excess(stack, builder.scattering_matrices(values, wavelength_nm), directions)
