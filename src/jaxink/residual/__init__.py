"""The shape of a residual: how much of it lies in few smooth, reciprocal modes, and what breaks symmetry."""

from jaxink.residual.modes import modes_for
from jaxink.residual.points import ResidualPoints
from jaxink.residual.shape import ResidualShape, residual_shape
from jaxink.residual.shares import ModeShare, OrderShare, ScanShare
from jaxink.residual.symmetry import Asymmetry

__all__ = [
    "Asymmetry",
    "ModeShare",
    "OrderShare",
    "ResidualPoints",
    "ResidualShape",
    "ScanShare",
    "modes_for",
    "residual_shape",
]
