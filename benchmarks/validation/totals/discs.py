"""Transmittance of stacks of discs against their thickness, each angle with a free scale."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations_with_replacement

import jax
import jax.numpy as jnp
import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares

import jaxink
from benchmarks.validation.totals.layers import ink, rows_of, sizes_for_power

PTFE = "ptfe_discs_rt_uzh", "rt_vs_thickness.csv"
THICKNESS_SIGMA_MM = 0.05
ASYMMETRY, OTHER_ASYMMETRIES = 0.5, (0.0, 0.9)
LOWEST, HIGHEST = np.array([np.log(0.1), 0.0]), np.array([np.log(1e3), 1.0])
# An absorption below this many 1/mm is at its bound.
AT_BOUND_PER_MM = 1e-6


@dataclass(frozen=True)
class Discs:
    """Transmitted shares, shape ``(stacks, angles)``."""

    theta_deg: np.ndarray
    thickness_mm: np.ndarray
    n_discs: np.ndarray
    transmitted: np.ndarray
    sigma: np.ndarray

    def made_of(self) -> tuple[np.ndarray, np.ndarray]:
        """Thicknesses of the single discs, and how many of each a stack holds: those that add up to it."""
        single = self.thickness_mm[self.n_discs == 1]
        counts = []
        for thickness, n in zip(self.thickness_mm, self.n_discs, strict=True):
            chosen = [
                choice
                for choice in combinations_with_replacement(range(single.size), int(n))
                if abs(single[list(choice)].sum() - thickness) < 1e-6
            ]
            if len(chosen) != 1:
                raise SystemExit(f"{n} discs do not add up to {thickness:g} mm in one way only.")
            counts.append(np.bincount(chosen[0], minlength=single.size))
        return single, np.array(counts)


@dataclass(frozen=True)
class DiscFit:
    """One solution.

    ``deviation``: ln(model / measured) with the scale of each angle, of all stacks, fitted or not.
    ``log_determinant``: of the covariance, which differs from model to model.
    """

    parameters: np.ndarray
    standard_errors: np.ndarray
    chi_square: float
    log_determinant: float
    deviation: np.ndarray
    sigma: np.ndarray

    @property
    def deviance(self) -> float:
        """-2 ln of the likelihood, up to a constant."""
        return self.chi_square + self.log_determinant

    @property
    def at_bound(self) -> bool:
        """Whether the absorption ran to 0."""
        return bool(self.parameters[1] < AT_BOUND_PER_MM)


def discs() -> Discs:
    """The data: side T only."""
    rows = [row for row in rows_of(*PTFE) if row["side"] == "T"]

    def column(name):
        return np.array([float(row[name]) for row in rows])

    theta, thickness = np.unique(column("theta_i_deg")), np.unique(column("thickness_mm"))
    shape = thickness.size, theta.size
    order = np.lexsort((column("theta_i_deg"), column("thickness_mm")))
    return Discs(
        theta,
        thickness,
        column("n_discs")[order].reshape(shape)[:, 0].astype(int),
        column("value")[order].reshape(shape),
        column("sigma")[order].reshape(shape),
    )


def predictor(data: Discs, index: float, gaps: bool) -> Callable:
    """Give ln T of all stacks and its derivatives by (ln reduced scattering, absorption), for a given g."""
    counts = data.n_discs if gaps else np.ones_like(data.n_discs)
    sines = np.sin(np.deg2rad(data.theta_deg))

    def pile(x, asymmetry, thickness_mm, n):
        disc = ink(index, jnp.exp(x[0]), x[1], asymmetry, thickness_mm / n)
        # Nothing is absorbed in air: a gap of any width is the same.
        gap = jaxink.ClearLayer(1.0, 0.0)
        return jaxink.Stack((disc, *[gap, disc] * (n - 1)), 1.0, 1.0)

    highest = max(ASYMMETRY, *OTHER_ASYMMETRIES)
    config = sizes_for_power(pile(np.array([2.0, 0.0]), highest, data.thickness_mm[0], 1))

    def ln_t(x, asymmetry):
        found = jnp.zeros(data.transmitted.shape)
        for n in np.unique(counts):
            here = np.flatnonzero(counts == n)

            def at(thickness_mm, n=n):
                return jaxink.hemispherical_power(pile(x, asymmetry, thickness_mm, n), sines, config)[1]

            found = found.at[here].set(jnp.log(jax.vmap(at)(jnp.asarray(data.thickness_mm[here]))))
        return found, found

    both = jax.jit(jax.jacfwd(ln_t, has_aux=True))

    def predict(x, asymmetry):
        slope, value = both(jnp.asarray(x), asymmetry)
        return np.asarray(value), np.asarray(slope)

    return predict


def covariance(data: Discs, slope, x, thickness_errors_mm) -> np.ndarray:
    """Of ln T: the stated sigma, and errors of the thickness, which all angles share."""
    # Thickness counts in the products with the two coefficients only.
    by_ln_thickness = slope[..., 0] + x[1] * slope[..., 1]
    by_thickness = by_ln_thickness / data.thickness_mm[:, None]
    columns = (by_thickness[..., None] * thickness_errors_mm[:, None, :]).reshape(data.transmitted.size, -1)
    return columns @ columns.T + np.diag(((data.sigma / data.transmitted) ** 2).ravel())


class _Weights:
    """Weighs columns by the noise of the points used, and takes the scale of each angle out of them."""

    def __init__(self, noise, scales, points):
        self.factor = cholesky(noise[np.ix_(points, points)], lower=True)
        self.scales, self.points = scales, points
        self.basis = np.linalg.qr(self.weighed(scales))[0]

    @property
    def log_determinant(self):
        return 2 * float(np.sum(np.log(np.diag(self.factor))))

    def weighed(self, columns):
        return solve_triangular(self.factor, columns[self.points], lower=True)

    def without_scales(self, columns):
        white = self.weighed(columns)
        return white - self.basis @ (self.basis.T @ white)

    def best_scales(self, columns):
        """The scales' contribution to all points."""
        return self.scales @ np.linalg.lstsq(self.weighed(self.scales), self.weighed(columns), rcond=None)[0]


def fit_discs(predict, data: Discs, thickness_errors_mm, asymmetry=ASYMMETRY, used=None) -> DiscFit:
    """Least squares in ln T with a free scale for each angle.

    The columns of `thickness_errors_mm` are independent errors, in mm on each stack. The covariance depends
    on the solution by the slope with thickness: it is held while the parameters are sought, and then computed
    anew, until both agree.
    """
    used = np.ones(data.thickness_mm.size, bool) if used is None else used
    scales = np.tile(np.eye(data.theta_deg.size), (used.size, 1))
    points = np.repeat(used, data.theta_deg.size)

    def rest(x):
        return (predict(x, asymmetry)[0] - np.log(data.transmitted)).ravel()

    def slopes(x):
        return predict(x, asymmetry)[1].reshape(-1, 2)

    def solved(weights, x):
        return least_squares(
            lambda y: weights.without_scales(rest(y)),
            x,
            lambda y: weights.without_scales(slopes(y)),
            bounds=(LOWEST, HIGHEST),
            x_scale=[1.0, 1e-2],
            xtol=1e-10,
            ftol=1e-12,
        )

    x, moved = np.array([np.log(10.0), 1e-3]), np.inf
    while moved > 1e-6:
        noise = covariance(data, predict(x, asymmetry)[1], x, thickness_errors_mm)
        weights = _Weights(noise, scales, points)
        found = solved(weights, x)
        moved, x = np.max(np.abs(found.x - x)), found.x
    left = rest(x)
    free = np.array([True, x[1] >= AT_BOUND_PER_MM])
    errors = np.full(2, np.nan)
    columns = weights.without_scales(slopes(x)[:, free])
    errors[free] = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    shape = data.transmitted.shape
    deviation = (left - weights.best_scales(left)).reshape(shape)
    sigma = np.sqrt(np.diag(noise)).reshape(shape)
    return DiscFit(x, errors, 2 * found.cost, weights.log_determinant, deviation, sigma)
