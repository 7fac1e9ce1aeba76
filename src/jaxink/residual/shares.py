"""What single modes, orders and scans have of a residual."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from jaxink.residual.modes import Mode


@dataclass(frozen=True)
class ModeShare:
    """A mode that a residual contains.

    Parameters
    ----------
    mode
        The mode.
    chi_square
        Decrease in chi-square when it was added to those before it.
    wavelength_nm
        Mean wavelength of each band.
    amplitude, standard_error
        In each band: relative deviation of the measurement from the model at grazing angles, with all modes
        fitted together; nan where the free parameters reproduce the mode.
    """

    mode: Mode
    chi_square: float
    wavelength_nm: Float[np.ndarray, " bands"]
    amplitude: Float[np.ndarray, " bands"]
    standard_error: Float[np.ndarray, " bands"]


class OrderShare(NamedTuple):
    """All modes up to an order: how many amplitudes they have, and the chi-square that they carry."""

    order: int
    amplitudes: int
    chi_square: float


class ScanShare(NamedTuple):
    """One incidence, side and wavelength: chi-square of the residual and without the modes, and their rms."""

    side: str
    theta_i_deg: float
    wavelength_nm: float
    points: int
    chi_square: float
    chi_square_left: float
    relative_rms: float


class CarriedShare(NamedTuple):
    """How much of the excess of chi-square the chosen modes carry, and all modes up to each order.

    ``smooth`` is the share of the excess that varies smoothly with direction, on whatever scale; None if it
    is not known.
    """

    n_considered: int
    excess: float
    share: float
    orders: tuple[OrderShare, ...]
    smooth: float | None = None

    def of_order(self, order: OrderShare) -> float:
        """Share of the excess that all modes up to an order carry."""
        return float(np.clip((order.chi_square - order.amplitudes) / self.excess, 0, 1))
