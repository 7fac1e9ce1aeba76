"""Figures of fits, diagnoses and ink tables; matplotlib is imported on demand, its global state unchanged."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from jaxink.plots.fit_figures import (
    FIGURE_FOLDER,
    cut_figure,
    figures,
    residual_map,
    residual_shape_figure,
    save_figures,
)

if TYPE_CHECKING:
    from jaxink.plots.comparison import comparison_figure
    from jaxink.plots.corner import corner_figure
    from jaxink.plots.diagnosis_pages import CaptionedFigure, diagnosis_figures
    from jaxink.plots.drawdown import drawdown_figure
    from jaxink.plots.lobe_figures import lobe_figure, table_lobe_figure
    from jaxink.plots.overview import overview_figure
    from jaxink.plots.progress import progress_figure
    from jaxink.plots.spectra import spectrum_figure

# Their modules import matplotlib.
_LATER = {
    "CaptionedFigure": "diagnosis_pages",
    "comparison_figure": "comparison",
    "corner_figure": "corner",
    "diagnosis_figures": "diagnosis_pages",
    "drawdown_figure": "drawdown",
    "lobe_figure": "lobe_figures",
    "overview_figure": "overview",
    "progress_figure": "progress",
    "spectrum_figure": "spectra",
    "table_lobe_figure": "lobe_figures",
}

__all__ = [
    "FIGURE_FOLDER",
    "CaptionedFigure",
    "comparison_figure",
    "corner_figure",
    "cut_figure",
    "diagnosis_figures",
    "drawdown_figure",
    "figures",
    "lobe_figure",
    "overview_figure",
    "progress_figure",
    "residual_map",
    "residual_shape_figure",
    "save_figures",
    "spectrum_figure",
    "table_lobe_figure",
]


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module 'jaxink.plots' has no attribute {name!r}")
    return getattr(import_module(f"jaxink.plots.{_LATER[name]}"), name)


def __dir__() -> list[str]:
    return __all__
