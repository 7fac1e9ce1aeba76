"""Rough surfaces: reflection and transmission by facets or by wave optics."""

from jaxink.surfaces.body_series import BodySeries, Coefficients, Mirror
from jaxink.surfaces.facets import FacetExchange, FacetRule, mean_transmittance, projected_area
from jaxink.surfaces.height_map import HeightMap, TabulatedSlopes
from jaxink.surfaces.interface import (
    RoughInterface,
    RoughSizes,
    WaveInterface,
    WaveLobes,
    next_facet,
    rough_interface,
)
from jaxink.surfaces.lobes import reflected_lobe, transmitted_lobe
from jaxink.surfaces.relief import Pairs, facet_averages, mirrored_once, reflected_once, regular_share
from jaxink.surfaces.slopes import (
    DENSITIES,
    LAWS,
    SlopeDensity,
    SlopeLaw,
    SlopeMixture,
    law_name,
    slope_density,
)
from jaxink.surfaces.spectrum import (
    BroadenedSpectrum,
    GaussianSpectrum,
    KCorrelation,
    PowerSpectrum,
    TabulatedSpectrum,
)
from jaxink.surfaces.table import (
    FINE,
    QUICK,
    AngleTable,
    Density,
    IndexTable,
    MixtureTable,
    Piece,
    mixture_table,
    pieces_of,
    rough_table,
)
from jaxink.surfaces.wave_face import WaveFace, kept_regular, wave_interface, wave_lobes
from jaxink.surfaces.wave_optics import scattered_bsdf
from jaxink.surfaces.wave_power import LARGEST_SLOPE, validity
from jaxink.surfaces.wave_surface import AMPLITUDES, WaveSurface, regular_power

__all__ = [
    "AMPLITUDES",
    "DENSITIES",
    "FINE",
    "LARGEST_SLOPE",
    "LAWS",
    "QUICK",
    "AngleTable",
    "BodySeries",
    "BroadenedSpectrum",
    "Coefficients",
    "Density",
    "FacetExchange",
    "FacetRule",
    "GaussianSpectrum",
    "HeightMap",
    "IndexTable",
    "KCorrelation",
    "Mirror",
    "MixtureTable",
    "Pairs",
    "Piece",
    "PowerSpectrum",
    "RoughInterface",
    "RoughSizes",
    "SlopeDensity",
    "SlopeLaw",
    "SlopeMixture",
    "TabulatedSlopes",
    "TabulatedSpectrum",
    "WaveFace",
    "WaveInterface",
    "WaveLobes",
    "WaveSurface",
    "facet_averages",
    "kept_regular",
    "law_name",
    "mean_transmittance",
    "mirrored_once",
    "mixture_table",
    "next_facet",
    "pieces_of",
    "projected_area",
    "reflected_lobe",
    "reflected_once",
    "regular_power",
    "regular_share",
    "rough_interface",
    "rough_table",
    "scattered_bsdf",
    "slope_density",
    "transmitted_lobe",
    "validity",
    "wave_interface",
    "wave_lobes",
]
