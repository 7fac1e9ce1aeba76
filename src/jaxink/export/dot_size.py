"""How large a printed dot must be for its sheet: light leaves through the rim, which a sheet lacks.

The rim of a round dot of diameter D and thickness h is 4 h / D times as large as its footprint, and takes
light from the ink as an absorber would. Per incident power, the light that leaves through it is

    X = (h / D) f w / sqrt(1 + w tau* / c),

where w is the mean length of the way of light in a wide layer, in thicknesses, and tau* = mu_s (1 - g) h. The
root says that scattering replaces what the rim has taken, the more slowly the more often light is scattered.

A share u of X goes up into the plate, the rest to the other side. In a wide layer, parts of X would have been
scattered into the plate and to the other side. These follow from the derivatives of both totals by the
absorption coefficient, since the rim takes what an absorber would take: X a w_R / w, w_R = -dR / d(mu_a h).
Here a = tau* / (tau* + mu_a h), as light at the rim goes sideways and must be scattered before it leaves.
The errors of a sheet are the differences. Light that passes the rim before it was scattered does not count as
scattered there.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from jaxink.export.medium import Medium
from jaxink.numerics.precision import computing
from jaxink.solver import SolverConfig, hemispherical_power, regular_power

_CONFIG, _NODES = SolverConfig(16, 12, 48, 1), 12
# Absorbed optical thickness added for derivatives; below the other number, the way is the sum of these.
_STEP, _LEAST_ABSORBED = 5e-4, 1e-4


class Rim(NamedTuple):
    """Constants of the rule, fitted to paths through dots by ``benchmarks.validation.render.dot_size``.

    Parameters
    ----------
    leak
        f, what leaves through the rim over the power there if little is scattered.
    upwards
        u, share of it that enters the plate.
    scatterings
        c, number of reduced scatterings above which the rim takes light faster than it is replaced.
    """

    leak: float
    upwards: float
    scatterings: float


RIM = Rim(0.406, 0.170, 2.57)


class SheetError(NamedTuple):
    """Relative errors of a sheet times diameter over thickness: the sheet's light less that of the dot.

    Parameters
    ----------
    returned
        Of the light that is scattered back into the plate.
    sent_out
        Of the light that is scattered to the other side.
    """

    returned: float
    sent_out: float


@dataclasses.dataclass(frozen=True)
class WideLayer:
    """What an ink does with light from the plate, far from its rim.

    Parameters
    ----------
    scattered
        Shares of the incident power that are scattered into the plate and to the other side, shape ``(2,)``.
    ways
        Their derivatives by the absorbed optical thickness, with the sign changed, shape ``(2,)``.
    way, unscattered_way
        Mean length of the way of light in the ink, and of its part before the first scattering, in
        thicknesses.
    reduced_thickness, absorbed_thickness
        Reduced optical thickness mu_s (1 - g) h, and mu_a h.
    """

    scattered: Float[np.ndarray, " 2"]
    ways: Float[np.ndarray, " 2"]
    way: float
    unscattered_way: float
    reduced_thickness: float
    absorbed_thickness: float

    @classmethod
    def of(cls, medium: Medium, wavelength: int = 0, theta_deg: float | None = None) -> "WideLayer":
        """Of a medium.

        Parameters
        ----------
        medium
            The ink; its faces are taken as smooth.
        wavelength
            Index of the wavelength.
        theta_deg
            Angle of incidence inside the plate; None: equal radiance from all directions.
        """
        thickness_mm = medium.thickness_um / 1000
        absorbed = float(medium.absorption_per_mm[wavelength]) * thickness_mm
        scattered = float(medium.scattering_per_mm[wavelength]) * thickness_mm
        here, near, far = (_powers(medium, wavelength, k * _STEP, theta_deg) for k in range(3))
        slopes = (3 * here - 4 * near + far) / (2 * _STEP)
        is_clear = absorbed < _LEAST_ABSORBED
        return cls(
            scattered=here[:2],
            ways=slopes[:2],
            way=float(slopes.sum() if is_clear else (1 - here.sum()) / absorbed),
            unscattered_way=float(1 - here[2]) / (scattered + absorbed),
            reduced_thickness=scattered * (1 - float(medium.asymmetry[wavelength])),
            absorbed_thickness=absorbed,
        )


def _powers(
    medium: Medium, wavelength: int, added: float, theta_deg: float | None
) -> Float[np.ndarray, " 3"]:
    """Shares scattered into the plate, scattered to the other side, and regular, with absorption added."""
    if theta_deg is None:
        node, weight = np.polynomial.legendre.leggauss(_NODES)
        sines, weights = np.sqrt((node + 1) / 2), weight / 2
    else:
        sines, weights = np.sin(np.deg2rad([theta_deg])), np.ones(1)
    absorption = medium.absorption_per_mm + added / (medium.thickness_um / 1000)
    changed = dataclasses.replace(medium, absorption_per_mm=absorption)
    with computing():
        stack = changed.stack(wavelength)
        totals = np.asarray(hemispherical_power(stack, sines, _CONFIG)) @ weights
        regular = np.asarray(regular_power(stack, sines)) @ weights
    return np.append(totals - regular, regular.sum())


def sheet_error(layer: WideLayer, rim: Rim = RIM) -> SheetError:
    """Errors of a sheet, from what the ink does far from the rim."""
    scatterings = layer.way * layer.reduced_thickness
    taken = rim.leak * layer.way / np.sqrt(1 + scatterings / rim.scatterings)
    turned = layer.reduced_thickness / (layer.reduced_thickness + layer.absorbed_thickness)
    missed = taken * turned * layer.ways / layer.way
    leaving = taken * (1 - layer.unscattered_way / layer.way)
    excess = missed - leaving * np.array([rim.upwards, 1 - rim.upwards])
    return SheetError(*(excess / layer.scattered).tolist())
