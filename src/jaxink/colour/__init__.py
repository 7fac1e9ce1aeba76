"""Colours: what an observer sees of a fitted ink, here and in other arrangements."""

from jaxink.colour.arrangement import Arrangement
from jaxink.colour.at_points import ColoursAtPoints, colours_at_points
from jaxink.colour.cie import difference, display_code, illuminant_spectrum, matching_functions
from jaxink.colour.coordinates import Colour
from jaxink.colour.fitted import FittedColours, colours_of_sample, fitted_colours
from jaxink.colour.geometry import Geometry
from jaxink.colour.hiding import HIDING, Drawdown, drawdown
from jaxink.colour.kubelka_munk import TwoFlux, two_flux, two_flux_errors
from jaxink.colour.of_sample import GEOMETRIES, ParameterCovariance, SampleSpectra, wavelengths_of
from jaxink.colour.shown import colours_if_any, shown_colour
from jaxink.colour.viewing import Illuminant, Viewing, read_card, read_illuminant

__all__ = [
    "Arrangement",
    "Colour",
    "ColoursAtPoints",
    "Drawdown",
    "FittedColours",
    "GEOMETRIES",
    "Geometry",
    "HIDING",
    "Illuminant",
    "ParameterCovariance",
    "SampleSpectra",
    "TwoFlux",
    "Viewing",
    "colours_at_points",
    "colours_if_any",
    "colours_of_sample",
    "difference",
    "display_code",
    "drawdown",
    "fitted_colours",
    "illuminant_spectrum",
    "matching_functions",
    "read_card",
    "read_illuminant",
    "shown_colour",
    "two_flux",
    "two_flux_errors",
    "wavelengths_of",
]
