"""Correlation of residuals along a scan and between neighbours."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array


@dataclass(frozen=True)
class ByScan:
    """A statistic of several residuals, in each scan and over all scans."""

    per_scan: Float[np.ndarray, "vectors scans"]
    pooled: Float[np.ndarray, " vectors"]


def runs_z(signs_positive: Bool[np.ndarray, "vectors points"], starts: Int[np.ndarray, " scans"]) -> ByScan:
    """Number of runs of one sign, in standard deviations from its mean given the signs.

    Negative for too few runs; 0 for a scan with a single sign.

    Parameters
    ----------
    signs_positive
        True for positive residuals, in the order along the scans.
    starts
        First index of each scan.

    References
    ----------
    Wald, Wolfowitz 1940 Ann. Math. Stat. 11, 147.
    """
    size = np.diff(np.append(starts, signs_positive.shape[1]))
    changes = np.zeros(signs_positive.shape)
    changes[:, 1:] = signs_positive[:, 1:] != signs_positive[:, :-1]
    # The first point of a scan always begins a run.
    changes[:, starts] = 1
    runs = np.add.reduceat(changes, starts, axis=1)
    positive = np.add.reduceat(signs_positive.astype(float), starts, axis=1)
    mean = 2 * positive * (size - positive) / size + 1
    variance = (mean - 1) * (mean - 2) / np.maximum(size - 1, 1)
    excess = np.where(variance > 0, runs - mean, 0.0)
    per_scan = excess / np.sqrt(np.where(variance > 0, variance, 1.0))
    total = np.sum(variance, axis=1)
    return ByScan(per_scan, np.sum(excess, axis=1) / np.sqrt(np.where(total > 0, total, 1.0)))


def ljung_box(
    residuals: Float[np.ndarray, "vectors points"], starts: Int[np.ndarray, " scans"], lags: int
) -> Float[np.ndarray, "vectors scans"]:
    """Ljung-Box Q of each scan, about zero and not about the mean: an offset is structure too.

    Parameters
    ----------
    residuals
        In the order along the scans.
    starts
        First index of each scan.
    lags
        Largest lag; in a scan of n points at most n - 1.

    References
    ----------
    Ljung, Box 1978 Biometrika 65, 297.
    """
    ends = np.append(starts[1:], residuals.shape[1])
    q = np.zeros((len(residuals), starts.size))
    for scan, (start, end) in enumerate(zip(starts, ends, strict=True)):
        here, size = residuals[:, start:end], int(end - start)
        power = np.einsum("ij,ij->i", here, here)
        power = np.where(power > 0, power, 1.0)
        for lag in range(1, min(lags, size - 1) + 1):
            rho = np.einsum("ij,ij->i", here[:, lag:], here[:, :-lag]) / power
            q[:, scan] += size * (size + 2) * rho**2 / (size - lag)
    return q


def moran(
    residuals: Float[np.ndarray, "vectors points"], graph: csr_array, scan: Int[np.ndarray, " points"]
) -> ByScan:
    """Moran's I, about zero: mean of r_i r_j over pairs of neighbours, divided by the mean square.

    Parameters
    ----------
    residuals
        One row for each vector.
    graph
        Sparse matrix with 1 for each pair of neighbours, each pair once.
    scan
        Scan of each point, ascending; a pair counts for the scan of its row.

    References
    ----------
    Moran 1950 Biometrika 37, 17.
    """
    starts = np.flatnonzero(np.diff(scan, prepend=-1))
    products = residuals * (graph @ residuals.T).T
    pairs = np.add.reduceat(np.asarray(graph.sum(axis=1)).reshape(-1), starts)
    size = np.diff(np.append(starts, scan.size))
    square = np.add.reduceat(residuals**2, starts, axis=1)
    each = np.add.reduceat(products, starts, axis=1)
    mean_square = square / size
    per_scan = each / np.maximum(pairs, 1) / np.where(mean_square > 0, mean_square, 1.0)
    overall = np.sum(square, axis=1) / scan.size
    pooled = np.sum(each, axis=1) / max(pairs.sum(), 1) / np.where(overall > 0, overall, 1.0)
    return ByScan(per_scan, pooled)
