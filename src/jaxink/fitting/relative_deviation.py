"""Relative deviation of a measurement from a model, measured / model - 1, as pages and tables show it."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from jaxink.fitting.figures_of_merit import ScanMerit, rms
from jaxink.measurement import GonioData

# Of angles in degrees and wavelengths in nm.
_SAME = 1e-3


class Deviation(NamedTuple):
    """Root mean square and mean of measured / model - 1; above 0 where the measurement is larger."""

    rms: float
    mean: float


def deviation(
    measured: Float[np.ndarray, " points"], predicted: Float[np.ndarray, " points"]
) -> Deviation | None:
    """Of some points; None if a value is not positive."""
    if not (np.all(measured > 0) and np.all(predicted > 0)):
        return None
    relative = measured / predicted - 1
    return Deviation(rms(relative), float(np.mean(relative)))


def deviation_of_scan(
    data: GonioData, predicted: Float[np.ndarray, " points"], scan: ScanMerit
) -> Deviation | None:
    """Of the used points of one scan; `predicted` at all used points. None also if the data lack the scan."""
    used = data.used
    here = data.is_transmission[used] == (scan.side == "T")
    here &= np.isclose(data.wavelength_nm[used], scan.wavelength_nm, rtol=0, atol=_SAME)
    here &= np.isclose(data.theta_i_deg[used], scan.theta_i_deg, rtol=0, atol=_SAME)
    return deviation(data.bsdf_per_sr[used][here], predicted[here]) if here.any() else None
