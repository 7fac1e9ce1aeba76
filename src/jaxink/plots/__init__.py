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
    from jaxink.plots.figure import DPI, PageFigure, blank_figure
    from jaxink.plots.fit_figures import fit_pages
    from jaxink.plots.lobe_figures import lobe_figure, table_lobe_figure
    from jaxink.plots.overview import overview_figure
    from jaxink.plots.picture_files import Page, pictures
    from jaxink.plots.progress import progress_figure
    from jaxink.plots.scan_views import (
        FROM_INSIDE,
        MOST_WAVELENGTHS,
        SIDES,
        drawn_wavelengths,
        fit_wavelengths,
        is_simulated,
        measurement_name,
        overview_words,
        residual_words,
        used_wavelengths,
        wavelength_words,
        worst_wavelength,
    )
    from jaxink.plots.spectra import spectrum_figure

_HOMES = {
    "jaxink.plots.comparison": ("comparison_figure",),
    "jaxink.plots.corner": ("corner_figure",),
    "jaxink.plots.diagnosis_pages": (
        "CaptionedFigure",
        "diagnosis_figures",
    ),
    "jaxink.plots.drawdown": ("drawdown_figure",),
    "jaxink.plots.figure": (
        "DPI",
        "PageFigure",
        "blank_figure",
    ),
    "jaxink.plots.fit_figures": ("fit_pages",),
    "jaxink.plots.lobe_figures": (
        "lobe_figure",
        "table_lobe_figure",
    ),
    "jaxink.plots.overview": ("overview_figure",),
    "jaxink.plots.picture_files": (
        "Page",
        "pictures",
    ),
    "jaxink.plots.progress": ("progress_figure",),
    "jaxink.plots.scan_views": (
        "FROM_INSIDE",
        "MOST_WAVELENGTHS",
        "SIDES",
        "drawn_wavelengths",
        "fit_wavelengths",
        "is_simulated",
        "measurement_name",
        "overview_words",
        "residual_words",
        "used_wavelengths",
        "wavelength_words",
        "worst_wavelength",
    ),
    "jaxink.plots.spectra": ("spectrum_figure",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(
    [
        "FIGURE_FOLDER",
        "cut_figure",
        "figures",
        "residual_map",
        "residual_shape_figure",
        "save_figures",
        *_HOME_OF,
    ]
)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'jaxink.plots' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
