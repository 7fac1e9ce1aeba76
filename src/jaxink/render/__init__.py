"""Renderings of a fitted ink: its sheet, which is a table, beside its volume."""

from jaxink.render.booth import Booth
from jaxink.render.guide import Guide
from jaxink.render.guide_figure import save_guide_figure
from jaxink.render.lightguide import Effort, GuideRendering, render_guide
from jaxink.render.mitsuba_session import require_mitsuba
from jaxink.render.printed_plate import PrintedPlate
from jaxink.render.rendered_ink import RenderedInk
from jaxink.render.sphere import SphereEffort, SphereRendering, render_sphere
from jaxink.render.sphere_figure import save_sphere_figure

__all__ = [
    "Booth",
    "Effort",
    "Guide",
    "GuideRendering",
    "PrintedPlate",
    "RenderedInk",
    "SphereEffort",
    "SphereRendering",
    "render_guide",
    "render_sphere",
    "require_mitsuba",
    "save_guide_figure",
    "save_sphere_figure",
]
