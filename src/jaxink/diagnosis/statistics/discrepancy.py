"""The smooth part of a residual: a Gaussian process over the angles, orthogonal to the parameters."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from jaxink.diagnosis.statistics.candidate import ScreenOptions
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.projection import Projection
from jaxink.diagnosis.statistics.tangent_cone import TangentCone
from jaxink.display.brief import brief_repr

# Correlation lengths tried in the direction of view; those in the other variables are fixed.
_LENGTHS_DEG = (5.0, 12.0, 30.0)
_INCIDENCE_DEG = 20.0
_LN_WAVELENGTH = 0.2
# Variances tried, in units of the noise.
_VARIANCES = np.geomspace(1e-3, 1e7, 41)
# A smooth kernel on some hundreds of directions has hardly a larger rank.
_MOST_RANK = 150
_LEFT_OUT = 1e-3


@dataclass(frozen=True)
class SmoothPart:
    """The smooth part of a residual.

    Parameters
    ----------
    values
        Conditional mean of the process at the points, in standard deviations of the noise.
    noise_power
        Mean square of each value for pure noise.
    share
        Structured share of the residual's mean square: 1 - (|r - values|^2 / f) / (|r|^2 / n), where n is the
        number of points minus parameters, and f is n minus the degrees of freedom of the smoothing. About 0
        for noise, unlike the plain ratio of the sums.
    variance
        Of the process, in units of the noise; 0 if that is most likely.
    length_deg
        Most likely correlation length in the direction of view.
    p_value
        Probability of at least this likelihood for pure noise, by simulation.
    """

    __repr__ = brief_repr

    values: Float[np.ndarray, " points"]
    noise_power: Float[np.ndarray, " points"]
    share: float
    variance: float
    length_deg: float
    p_value: float


def smooth_part(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
) -> SmoothPart:
    """Fit a Gaussian process with kernel P K P, orthogonal to the parameters.

    The two sides of the plate are independent. The test of variance > 0 is at the boundary, and over several
    lengths, so its null law is simulated.

    Parameters
    ----------
    residual, jacobian, points, at_bound, options
        See `find_structure`.

    References
    ----------
    Kennedy, O'Hagan 2001 JRSS B 63, 425; Tuo, Wu 2015 Ann. Stat. 43, 2331; Plumlee 2017 JASA 112, 1274.
    """
    options = ScreenOptions() if options is None else options
    cone = TangentCone.of(jacobian, at_bound)
    projection = cone.projection(cone.active(residual[None, :])[0])
    vectors = np.vstack([residual[None, :], options.noise(residual.size)])
    each, modes = [], []
    for length in _LENGTHS_DEG:
        mode = _modes(points, length, projection)
        modes.append(mode)
        each.append(_likelihood_gain((vectors @ mode.vectors) ** 2, mode.square))
    gains = np.stack(each, axis=1)
    best = gains.max(axis=(1, 2))
    p_value = (1 + int(np.sum(best[1:] >= best[0]))) / (1 + options.n_bootstrap)
    left = projection.remove(residual)[: len(points)]
    at_length, at_variance = np.unravel_index(np.argmax(gains[0]), gains[0].shape)
    if best[0] <= 0:
        nothing = np.zeros(len(points))
        return SmoothPart(nothing, nothing, 0.0, 0.0, _LENGTHS_DEG[at_length], p_value)
    mode, variance = modes[at_length], float(_VARIANCES[at_variance])
    kept = variance * mode.square / (1 + variance * mode.square)
    values = (mode.vectors @ (kept * (mode.vectors.T @ residual)))[: len(points)]
    freedom = len(points) - projection.basis.shape[1]
    rest = np.sum((left - values) ** 2) / max(freedom - np.sum(kept * (2 - kept)), 1.0)
    share = max(0.0, 1 - float(rest / (np.sum(left**2) / max(freedom, 1))))
    noise_power = np.sum((mode.vectors[: len(points)] * kept) ** 2, axis=1)
    return SmoothPart(values, noise_power, share, variance, _LENGTHS_DEG[at_length], p_value)


def misfit_deviation(
    smooth: SmoothPart,
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
) -> Float[np.ndarray, " parameters"]:
    """Standard deviation of the bias of each parameter due to the misfit of the model.

    The part of a misfit that the parameters cannot reproduce is visible; the part that they can reproduce
    biases them. Both are taken as parts of one Gaussian process. The result is nan for a parameter at a
    bound.

    Parameters
    ----------
    smooth
        The process found in the residual.
    jacobian, points, at_bound
        See `find_structure`.

    References
    ----------
    Kennedy, O'Hagan 2001 JRSS B 63, 425; Brynjarsdottir, O'Hagan 2014 Inverse Problems 30, 114007.
    """
    inside = np.full(jacobian.shape[1], True) if at_bound is None else at_bound == 0
    columns = jacobian[:, inside]
    root = _kernel_root(points, smooth.length_deg)
    length = np.linalg.norm(columns, axis=0)
    length = np.where(length > 0, length, 1.0)
    padded = np.zeros((jacobian.shape[0], root.shape[1]))
    padded[: len(points)] = root
    shift = np.linalg.lstsq(columns / length, padded, rcond=None)[0] / length[:, None]
    deviation = np.full(jacobian.shape[1], np.nan)
    deviation[inside] = np.sqrt(smooth.variance * np.sum(shift**2, axis=1))
    return deviation


def _likelihood_gain(power, square):
    """Twice the log likelihood ratio against no process, shape (vectors, variances)."""
    ratio = _VARIANCES[:, None] * square
    return power @ (ratio / (1 + ratio)).T - np.sum(np.log1p(ratio), axis=1)


@dataclass(frozen=True)
class _Modes:
    """Eigenvectors of P K P and its eigenvalues."""

    vectors: Float[np.ndarray, "rows modes"]
    square: Float[np.ndarray, " modes"]


def _modes(points: Points, length_deg, projection: Projection) -> _Modes:
    """Modes from a low-rank root of K."""
    root = _kernel_root(points, length_deg)
    padded = np.zeros((projection.basis.shape[0], root.shape[1]))
    padded[: len(points)] = root
    rest = projection.remove(padded)
    square, vectors = np.linalg.eigh(rest.T @ rest)
    kept = square > 1e-10 * square[-1]
    return _Modes(rest @ (vectors[:, kept] / np.sqrt(square[kept])), square[kept])


def _kernel_root(points: Points, length_deg) -> np.ndarray:
    """F with F F^T close to the kernel, by pivoted Cholesky factorisation.

    References
    ----------
    Harbrecht, Peters, Schneider 2012 Appl. Num. Math. 62, 428.
    """
    chord = 2 * np.sin(np.deg2rad(length_deg) / 2)
    place = np.column_stack(
        [
            points.direction / chord,
            points.theta_i_deg / _INCIDENCE_DEG,
            np.log(points.wavelength_nm) / _LN_WAVELENGTH,
        ]
    )
    left = np.ones(len(points))
    root = np.zeros((len(points), min(_MOST_RANK, len(points))))
    for column in range(root.shape[1]):
        pivot = int(np.argmax(left))
        if left[pivot] < _LEFT_OUT:
            return root[:, :column]
        kernel = np.exp(-0.5 * np.sum((place - place[pivot]) ** 2, axis=1))
        kernel *= points.is_transmission == points.is_transmission[pivot]
        root[:, column] = (kernel - root[:, :column] @ root[pivot, :column]) / np.sqrt(left[pivot])
        left = np.maximum(left - root[:, column] ** 2, 0.0)
    return root
