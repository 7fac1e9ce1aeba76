"""Designs of a goniometer, with smooth derivatives drawn at random."""

import numpy as np
from scipy.stats import binom

from jaxink.diagnosis import Candidate, Points

AZIMUTHS = (0.0, 180.0, 90.0, -90.0)


def goniometer(incidences=(0.0, 30.0, 60.0), views=50, wavelengths=(550.0,), sides=(False, True)) -> Points:
    """Both sides, four half planes: 200 points for each of 6 scans."""
    theta_o = np.linspace(0.5, 85, views)
    rows = [
        (length, incidence, side, phi, angle)
        for length in wavelengths
        for side in sides
        for incidence in incidences
        for phi in AZIMUTHS
        for angle in theta_o
    ]
    length, incidence, side, phi, angle = np.array(rows).T
    scan = np.repeat(np.arange(len(rows) // (views * len(AZIMUTHS))), views * len(AZIMUTHS))
    return Points(scan, incidence, angle, phi, length, side.astype(bool), np.arange(len(rows), dtype=float))


def smooth_function(points: Points, rng):
    """A few waves in the polar angles, unlike on the two sides."""
    out, into = np.deg2rad(points.theta_o_deg), np.deg2rad(points.theta_i_deg)
    value = np.zeros(len(points))
    for order in range(4):
        side = 1 + rng.standard_normal() * points.is_transmission
        tilt = 1 + 0.5 * rng.standard_normal() * np.cos(into) * np.cos(np.deg2rad(points.phi_deg))
        value += rng.standard_normal() * np.cos(order * out + rng.uniform(0, 6)) * side * tilt
    return value


def parameters(points: Points, rng, count=6):
    return np.stack([smooth_function(points, rng) for _ in range(count)], axis=1)


def lobes(points: Points, centre_deg, widths_deg):
    """A lobe round one polar angle, of several widths."""
    distance = points.theta_o_deg - centre_deg
    return np.stack([np.exp(-0.5 * (distance / width) ** 2) for width in widths_deg], axis=1)


def catalogue(points: Points, rng, plain=16, with_inner=8):
    """Candidates of either sign and of both, some with an inner parameter of up to 12 values."""
    found = [
        Candidate(f"plain_{number}", smooth_function(points, rng), number % 3 - 1) for number in range(plain)
    ]
    for number in range(with_inner):
        widths = np.geomspace(2, 40, 5 + number)
        side = 1 - 2 * rng.uniform() * points.is_transmission
        directions = lobes(points, rng.uniform(0, 80), widths) * side[:, None]
        found.append(Candidate(f"lobe_{number}", directions, (1, 0, -1)[number % 3]))
    return found


def within_binomial(count, trials, share, level=0.99):
    low, high = binom.interval(level, trials, share)
    return low <= count <= high


def autoregressive(points: Points, rho):
    """Root of the covariance of AR(1) noise of variance 1 within each scan, and the root's inverse.

    All scans have the same number of points, in order.
    """
    size = len(points) // points.n_scans
    lag = np.abs(np.subtract.outer(np.arange(size), np.arange(size)))
    root = np.linalg.cholesky(rho**lag)
    scans = np.eye(points.n_scans)
    return np.kron(scans, root), np.kron(scans, np.linalg.inv(root))
