"""Renderings of a fitted ink: its sheet, which is a table, beside its volume."""

from jaxink.render.guide import Guide
from jaxink.render.guide_figure import save_guide_figure
from jaxink.render.lightguide import Effort, GuideRendering, render_guide
from jaxink.render.rendered_ink import RenderedInk

__all__ = [
    "Effort",
    "Guide",
    "GuideRendering",
    "RenderedInk",
    "render_guide",
    "save_guide_figure",
]
