"""The parts of a residual that no isotropic, reciprocal sample has.

Both are differences of two residuals at directions at which the model is equal, so that no smooth function of
the directions that keeps the symmetry contributes, however fine its structure.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.special import fdtrc

from jaxink.measurement import ANGLE_TOLERANCE_DEG, angle_labels
from jaxink.residual.modes import zernike_radial
from jaxink.residual.points import ResidualPoints

# Where there is no point.
_NOWHERE_DEG = -90.0
# Highest order of the modes of a difference.
_MOST_ORDER = 4
# Fewest pairs for each mode.
_PAIRS_PER_MODE = 2
_SURE = 1e-3


@dataclass(frozen=True)
class Asymmetry:
    """The smooth part of the differences between residuals that must be equal.

    Parameters
    ----------
    kind
        ``"mirror"``: +phi and -phi, or at normal incidence two opposite directions; ``"reciprocal"``: source
        and detector exchanged, in reflection.
    pairs, modes
        Number of differences, and of modes fitted to them.
    chi_square
        What the modes carry of the chi-square of the differences, which is part of the residual's.
    p_value
        Probability of as much for independent differences of any common noise (F test); None if there are too
        few pairs.
    relative_rms
        Root mean square of the fitted part, as a relative deviation of one reading from the mean of both.
    theta_i_deg, theta_o_deg, phi_deg
        Where that deviation is largest.
    largest
        The deviation there.
    """

    kind: str
    pairs: int
    modes: int
    chi_square: float
    p_value: float | None
    relative_rms: float
    theta_i_deg: float
    theta_o_deg: float
    phi_deg: float
    largest: float

    @property
    def is_significant(self) -> bool:
        """Whether the smooth part is more than noise."""
        return self.p_value is not None and self.p_value < _SURE


def asymmetries(points: ResidualPoints) -> tuple[Asymmetry, ...]:
    """Both kinds, as far as the data have pairs."""
    kinds = {"mirror": (_mirror_partner, _odd_modes), "reciprocal": (_reciprocal_partner, _exchange_modes)}
    found = []
    for kind, (partner, modes) in kinds.items():
        a, b = _pairs(points, partner(points))
        if a.size:
            found.append(_asymmetry(kind, points, a, b, modes))
    return tuple(found)


def _asymmetry(kind: str, points: ResidualPoints, a, b, modes: Callable) -> Asymmetry:
    """Half the difference of each pair, fitted by antisymmetric modes."""
    half = (points.relative[a] - points.relative[b]) / 2
    sigma = np.hypot(points.relative_sigma[a], points.relative_sigma[b]) / 2
    columns = np.stack(list(modes(points, a)), axis=1)
    factors = _scan_factors(points, a, b)
    whitened = np.concatenate([half / sigma, np.zeros(factors.shape[1])])
    matrix = np.vstack([columns / sigma[:, None], np.zeros((factors.shape[1], columns.shape[1]))])
    if factors.size:
        nuisance = np.vstack([factors / sigma[:, None], np.eye(factors.shape[1])])
        span = np.linalg.qr(nuisance)[0]
        whitened, matrix = (x - span @ (span.T @ x) for x in (whitened, matrix))
    coefficients, _, rank, _ = np.linalg.lstsq(matrix, whitened, rcond=1e-6)
    fitted = matrix @ coefficients
    carried, total = float(fitted @ fitted), float(whitened @ whitened)
    rest, freedom = max(total - carried, 1e-300), a.size - int(rank)
    p_value = None
    if rank and a.size >= _PAIRS_PER_MODE * rank + 1:
        p_value = float(fdtrc(rank, freedom, carried / rank / (rest / freedom)))
    values = columns @ coefficients
    top = int(np.argmax(np.abs(values)))
    sign = 1 if values[top] >= 0 else -1
    at = a[top] if sign > 0 else b[top]
    return Asymmetry(
        kind=kind,
        pairs=a.size,
        modes=int(rank),
        chi_square=carried,
        p_value=p_value,
        relative_rms=float(np.sqrt(np.mean(values**2))),
        theta_i_deg=float(points.theta_i_deg[at]),
        theta_o_deg=float(points.theta_o_deg[at]),
        phi_deg=float(points.phi_deg[at]),
        largest=float(abs(values[top])),
    )


def _scan_factors(points: ResidualPoints, a, b) -> Float[np.ndarray, "pairs scans"]:
    """Effect of the unknown factors of scans, at one standard deviation each, on half the differences."""
    between = np.flatnonzero(points.scan[a] != points.scan[b])
    if points.scan_relative == 0 or not between.size:
        return np.zeros((a.size, 0))
    scans = np.unique(points.scan[np.concatenate([a[between], b[between]])])
    first, second = (points.scan[i][:, None] == scans for i in (a, b))
    return points.scan_relative * (first.astype(float) - second) / 2


def _mirror_partner(points: ResidualPoints) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles of the mirror images; of opposite directions at normal incidence in the plane."""
    flat = points.near_plane & (points.theta_i_deg <= ANGLE_TOLERANCE_DEG)
    phi = np.where(flat, 180.0 - points.phi_deg, -points.phi_deg)
    return points.theta_i_deg, points.theta_o_deg, phi


def _reciprocal_partner(points: ResidualPoints) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles with source and detector exchanged; none in transmission, where it enters the other face."""
    theta_i = np.where(points.is_transmission, _NOWHERE_DEG, points.theta_o_deg)
    return theta_i, points.theta_i_deg, points.phi_deg


def _labels(points: ResidualPoints, partner) -> Int[np.ndarray, "2 points"]:
    """Numbers of the setting of each point and of its partner, equal for equal settings."""
    own = points.theta_i_deg, points.theta_o_deg, points.phi_deg
    theta_i, theta_o, phi = (np.concatenate(angles) for angles in zip(own, partner, strict=True))
    polar = angle_labels(np.concatenate([theta_i, theta_o])).reshape(2, -1)
    turned = np.mod(phi, 360.0)
    azimuth = angle_labels(np.where(turned > 360 - ANGLE_TOLERANCE_DEG, 0.0, turned))
    azimuth[theta_o <= ANGLE_TOLERANCE_DEG] = -1
    wavelength = np.rint(points.wavelength_nm * 1e6)
    columns = [np.tile(points.is_transmission, 2), np.tile(wavelength, 2), *polar, azimuth]
    _, label = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    return label.reshape(2, -1)


def _pairs(points: ResidualPoints, partner) -> tuple[np.ndarray, np.ndarray]:
    """Positions of pairs, each pair once; the first of repeated readings stands for them."""
    mine, wanted = _labels(points, partner)
    first = np.full(max(mine.max(), wanted.max()) + 1, -1)
    first[mine[::-1]] = np.arange(len(points))[::-1]
    a = np.flatnonzero((first[mine] == np.arange(len(points))) & (first[wanted] >= 0) & (wanted != mine))
    pairs = np.unique(np.sort(np.stack([a, first[wanted[a]]]), axis=0), axis=1)
    # Along the normal all azimuths are one direction, of which each reading is compared once.
    for column in (0, 1):
        pairs = pairs[:, np.unique(pairs[column], return_index=True)[1]]
    return pairs[0], pairs[1]


def _odd_modes(points: ResidualPoints, at) -> Iterator[np.ndarray]:
    """Modes of the relative change that are odd in phi, and for tilts at normal incidence."""
    of_i, of_o = (np.sin(np.deg2rad(angle[at])) for angle in (points.theta_i_deg, points.theta_o_deg))
    phi = np.deg2rad(points.phi_deg[at])
    flat = points.near_plane[at] & (points.theta_i_deg[at] <= ANGLE_TOLERANCE_DEG)
    odd = {order: np.where(flat, 0.0, np.sin(order * phi)) for order in range(1, _MOST_ORDER + 1)}
    yield np.where(flat, of_o * np.cos(phi), 0.0)
    for order in (1, 2):
        yield odd[order] * of_o**order
    for order, azimuth in odd.items():
        for n in range(order, _MOST_ORDER + 1, 2):
            for m in range(order, _MOST_ORDER + 1, 2):
                yield azimuth * zernike_radial(n, order, of_i) * zernike_radial(m, order, of_o)


def _exchange_modes(points: ResidualPoints, at) -> Iterator[np.ndarray]:
    """Modes that change sign if source and detector are exchanged."""
    of_i, of_o = (np.sin(np.deg2rad(angle[at])) for angle in (points.theta_i_deg, points.theta_o_deg))
    phi = np.deg2rad(points.phi_deg[at])
    for order in range(3):
        for n in range(order, _MOST_ORDER + 1, 2):
            for m in range(order, n, 2):
                n_i, n_o, m_i, m_o = (zernike_radial(k, order, x) for k in (n, m) for x in (of_i, of_o))
                yield np.cos(order * phi) * (n_i * m_o - m_i * n_o)
