"""Single scattering: phase functions, and the Mie series of a sphere."""

from jaxink.particles.independent_series import difference_from_miepython
from jaxink.particles.mie import DEFAULT_MAX_SIZE_PARAMETER, MieCoefficients, mie_coefficients
from jaxink.particles.mixture import (
    MixtureCoefficients,
    SpherePopulation,
    mixture_coefficients,
    mixture_matrix,
)
from jaxink.particles.phase_function import (
    PHASE_FUNCTIONS,
    HenyeyGreenstein,
    LegendreSeries,
    PhaseFunction,
    Rayleigh,
    TabulatedByAngle,
    TabulatedByMoments,
    TwoTermHenyeyGreenstein,
)
from jaxink.particles.size_distribution import REACH, discrete, log_normal, monodisperse, sizes_needed

__all__ = [
    "DEFAULT_MAX_SIZE_PARAMETER",
    "REACH",
    "HenyeyGreenstein",
    "LegendreSeries",
    "MieCoefficients",
    "MixtureCoefficients",
    "PHASE_FUNCTIONS",
    "PhaseFunction",
    "SpherePopulation",
    "Rayleigh",
    "TabulatedByAngle",
    "TabulatedByMoments",
    "TwoTermHenyeyGreenstein",
    "difference_from_miepython",
    "discrete",
    "log_normal",
    "mie_coefficients",
    "mixture_coefficients",
    "mixture_matrix",
    "monodisperse",
    "sizes_needed",
]
