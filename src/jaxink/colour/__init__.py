"""Colours: what an observer sees of a fitted ink, here and in other arrangements."""

from jaxink.colour.arrangement import Arrangement
from jaxink.colour.at_points import ColoursAtPoints, colours_at_points
from jaxink.colour.coordinates import Colour
from jaxink.colour.fitted import FittedColours, fitted_colours
from jaxink.colour.geometry import Geometry
from jaxink.colour.hiding import Drawdown, drawdown
from jaxink.colour.of_sample import SampleSpectra
from jaxink.colour.two_flux import TwoFlux, two_flux, two_flux_errors
from jaxink.colour.viewing import Illuminant, Viewing, read_card, read_illuminant

__all__ = [
    "Arrangement",
    "Colour",
    "ColoursAtPoints",
    "Drawdown",
    "FittedColours",
    "Geometry",
    "Illuminant",
    "SampleSpectra",
    "TwoFlux",
    "Viewing",
    "colours_at_points",
    "drawdown",
    "fitted_colours",
    "read_card",
    "read_illuminant",
    "two_flux",
    "two_flux_errors",
]
