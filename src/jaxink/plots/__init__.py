"""Figures of a fit result; matplotlib is imported on demand and its global state is not changed."""

from jaxink.plots.fit_figures import FIGURE_FOLDER, cut_figure, figures, residual_map, save_figures

__all__ = ["FIGURE_FOLDER", "cut_figure", "figures", "residual_map", "save_figures"]
