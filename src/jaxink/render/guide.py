"""An edge-lit plate with printed dots on its lower face: sizes and pattern."""

import dataclasses

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError

_FEWEST_DOTS, _MOST_DOTS = 200, 4000


@dataclasses.dataclass(frozen=True)
class Guide:
    """A clear plate, lit through its edge x = 0, with dots of ink on its lower face in a square pattern.

    The plate reaches from 0 to its length in x, from 0 to its width in y and from 0 (lower face) to its
    thickness in z. Each dot is in the middle of a square cell, and radii grow linearly from the first column
    to the last. The lamp covers the edge with constant radiance in every direction. The other three edges
    are mirrors; above and below is air, and beyond it nothing that reflects.

    Parameters
    ----------
    columns, rows
        Numbers of dots along x and along y.
    pitch_mm
        Side of a cell; the plate has the size of all cells.
    thickness_mm
        Thickness of the plate.
    first_radius_mm, last_radius_mm
        Radii of the dots next to the lamp and next to the far edge.
    edge_reflectance
        Reflectance of the three edges that are mirrors.
    """

    columns: int = 20
    rows: int = 12
    pitch_mm: float = 5.0
    thickness_mm: float = 3.0
    first_radius_mm: float = 1.2
    last_radius_mm: float = 1.75
    edge_reflectance: float = 0.95

    def __post_init__(self):
        if not _FEWEST_DOTS <= self.n_dots <= _MOST_DOTS:
            raise InputRefusedError(
                f"the light guide has {self.n_dots} dots ({self.columns} by {self.rows}); it must have "
                f"{_FEWEST_DOTS} to {_MOST_DOTS}."
            )
        if not 0 < min(self.radii_mm) <= max(self.radii_mm) < self.pitch_mm / 2:
            raise InputRefusedError(
                f"the radii of the dots are {self.first_radius_mm:g} to {self.last_radius_mm:g} mm; they "
                f"must be above 0 and below half the pitch, {self.pitch_mm / 2:g} mm."
            )
        if not 0 <= self.edge_reflectance <= 1:
            raise InputRefusedError(
                f"the reflectance of the edges is {self.edge_reflectance:g}; it must be between 0 and 1."
            )

    @property
    def n_dots(self) -> int:
        """Number of dots."""
        return self.columns * self.rows

    @property
    def length_mm(self) -> float:
        """Extent in x, away from the lamp."""
        return self.columns * self.pitch_mm

    @property
    def width_mm(self) -> float:
        """Extent in y, along the lamp."""
        return self.rows * self.pitch_mm

    @property
    def sizes_mm(self) -> tuple[float, float, float]:
        """Extents in x, y and z."""
        return self.length_mm, self.width_mm, self.thickness_mm

    @property
    def radii_mm(self) -> Float[np.ndarray, " columns"]:
        """Radius of the dots of each column."""
        return np.linspace(self.first_radius_mm, self.last_radius_mm, self.columns)

    @property
    def columns_mm(self) -> Float[np.ndarray, " columns"]:
        """Distance of the middle of each column from the lit edge."""
        return (np.arange(self.columns) + 0.5) * self.pitch_mm

    @property
    def coverage(self) -> float:
        """Share of the lower face that is printed."""
        return float(np.mean(np.pi * self.radii_mm**2) / self.pitch_mm**2)

    @property
    def words(self) -> str:
        """The guide in a sentence."""
        size = " x ".join(f"{size:g}" for size in self.sizes_mm)
        return (
            f"plate of {size} mm, lit through the edge x = 0; {self.n_dots} round dots ({self.columns} by "
            f"{self.rows}) in a square pattern with a pitch of {self.pitch_mm:g} mm, radius growing linearly "
            f"from {self.first_radius_mm:g} mm at the lamp to {self.last_radius_mm:g} mm at the far edge "
            f"({100 * self.coverage:.1f} % of the lower face); the other edges reflect "
            f"{100 * self.edge_reflectance:g} % as mirrors"
        )

    def is_printed(self, x_mm: Float[np.ndarray, " n"], y_mm: Float[np.ndarray, " n"]):
        """Whether points of the lower face are on a dot, shape ``(n,)``."""
        column = np.clip((x_mm / self.pitch_mm).astype(int), 0, self.columns - 1)
        dx = x_mm % self.pitch_mm - self.pitch_mm / 2
        dy = y_mm % self.pitch_mm - self.pitch_mm / 2
        return dx**2 + dy**2 < self.radii_mm[column] ** 2

    def is_clear(self, x_mm: Float[np.ndarray, " n"], y_mm: Float[np.ndarray, " n"]):
        """Whether points at the height of the lower face are on it and not on a dot, shape ``(n,)``."""
        within = (x_mm > 0) & (x_mm < self.length_mm) & (y_mm > 0) & (y_mm < self.width_mm)
        return within & ~self.is_printed(x_mm, y_mm)

    def dot_at(
        self, position_mm: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Middle and radius of the dot in whose cell each point is."""
        last = np.array([self.columns, self.rows]) - 1
        cell = np.clip((position_mm[:, :2] / self.pitch_mm).astype(int), 0, last)
        middle = np.column_stack([(cell + 0.5) * self.pitch_mm, np.zeros(len(cell))])
        return middle, self.radii_mm[cell[:, 0]]
