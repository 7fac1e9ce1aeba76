"""Renderings of a fitted ink: its sheet, which is a table, beside its volume."""

from jaxink.render.bodies import BODIES, Body, FlatPlate, Sphere, Torus
from jaxink.render.booth import Booth
from jaxink.render.booth_figure import save_booth_figure
from jaxink.render.booth_rendering import BoothEffort, BoothRendering, render_booth
from jaxink.render.guide import Guide
from jaxink.render.guide_figure import save_guide_figure
from jaxink.render.lightguide import Effort, GuideRendering, render_guide
from jaxink.render.mitsuba_session import require_mitsuba
from jaxink.render.printed_plate import PrintedPlate
from jaxink.render.rendered_ink import RenderedInk

__all__ = [
    "BODIES",
    "Body",
    "Booth",
    "BoothEffort",
    "BoothRendering",
    "Effort",
    "FlatPlate",
    "Guide",
    "GuideRendering",
    "PrintedPlate",
    "RenderedInk",
    "Sphere",
    "Torus",
    "render_booth",
    "render_guide",
    "require_mitsuba",
    "save_booth_figure",
    "save_guide_figure",
]
