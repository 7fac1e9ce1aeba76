"""Directions, channels, refractive indices, smooth interfaces and the optics of a layer."""

from jaxink.optics.channels import CLOSE, ChannelGrid
from jaxink.optics.directions import Directions, scattering_cosines
from jaxink.optics.fresnel import (
    fresnel_reflectance,
    polarised_reflectance,
    propagating_cosine,
    refracted_cosine,
)
from jaxink.optics.layers import (
    OPAQUE_OPTICAL_THICKNESS,
    ClearLayer,
    ScatteringLayer,
    TruncatedOptics,
    delta_m,
)
from jaxink.optics.phase_function import PhaseFunction, ScatteringMatrix

__all__ = [
    "CLOSE",
    "OPAQUE_OPTICAL_THICKNESS",
    "ChannelGrid",
    "ClearLayer",
    "Directions",
    "PhaseFunction",
    "ScatteringLayer",
    "ScatteringMatrix",
    "TruncatedOptics",
    "delta_m",
    "fresnel_reflectance",
    "polarised_reflectance",
    "propagating_cosine",
    "refracted_cosine",
    "scattering_cosines",
]
