"""Noise of a measurement: the model, and estimates from the values themselves."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.measurement.dataset import GonioData
from jaxink.measurement.scans import Scan
from jaxink.numerics.digits import with_uncertainty

ROBUST_FROM = 20
_DIFFER = 1e-3


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviation of a value: a relative part, a floor, and a factor common to a scan.

    Parameters
    ----------
    relative
        Relative standard deviation, independent from point to point.
    floor_per_sr
        Standard deviation at zero signal in 1/sr.
    scan_relative
        Relative standard deviation of one unknown factor for each scan.

    Raises
    ------
    InputRefusedError
        If one is negative or not finite, or both the relative part and the floor are zero.
    """

    relative: float
    floor_per_sr: float = 0.0
    scan_relative: float = 0.0

    def __post_init__(self):
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0):
                raise InputRefusedError(f"{name} is {value}; it must be finite and not negative.")
        if self.relative == 0 and self.floor_per_sr == 0:
            raise InputRefusedError("relative and floor_per_sr are both 0; one must be positive.")

    def sigma(self, bsdf_per_sr: Float[np.ndarray, " points"]) -> Float[np.ndarray, " points"]:
        """Independent standard deviation in 1/sr: sqrt((relative bsdf)^2 + floor^2)."""
        return np.hypot(self.relative * np.asarray(bsdf_per_sr, float), self.floor_per_sr)


@dataclass(frozen=True)
class NoiseLevel:
    """How well an estimated noise is known.

    Parameters
    ----------
    relative
        Relative standard deviation of a point.
    degrees_of_freedom
        Of its square.
    """

    relative: float
    degrees_of_freedom: float

    @property
    def text(self) -> str:
        """The level with its standard error, such as ``0.49(2) %``."""
        error = self.relative / np.sqrt(2 * self.degrees_of_freedom)
        return f"{with_uncertainty(100 * self.relative, 100 * error)} %"


@dataclass(frozen=True)
class ScanScatter:
    """Estimate from the pairs, or the roughness, of one scan.

    Parameters
    ----------
    scan
        The scan.
    pairs
        Number of independent differences; degrees of freedom of the roughness.
    relative
        Relative standard deviation of one value: root mean square of the differences / sqrt(2).
    mean_difference
        Mean relative difference, for mirror pairs phi > 0 minus phi < 0, which reveals a misaligned azimuth.
        It is included in ``relative``.
    """

    __repr__ = brief_repr

    scan: Scan
    pairs: int
    relative: float
    mean_difference: float


@dataclass(frozen=True)
class NoiseSource:
    """One kind of pairs, or the roughness of scans.

    Parameters
    ----------
    name
        ``"repeats"``, ``"mirror"``, ``"reciprocal"`` or ``"roughness"``.
    pairs
        Number of independent differences: degrees of freedom of ``relative`` squared. k repeats of a
        direction count k - 1; overlapping differences of neighbours count less than one each.
    relative
        Relative standard deviation of one value, NaN without pairs.
    outliers
        Number of excluded differences.
    scans
        Estimates by scan; a reciprocal pair counts in both of its scans.
    """

    __repr__ = brief_repr

    name: str
    pairs: int
    relative: float
    outliers: int
    scans: tuple[ScanScatter, ...]


@dataclass(frozen=True)
class NoiseEstimate:
    """Noise estimated from the measurement alone.

    Parameters
    ----------
    sources
        Repeats, mirror pairs, reciprocal pairs and roughness.
    adopted
        Name of the source that was used, None if there is none.
    model
        The noise model, None if there is no source.
    sentence
        What was used, and why.
    """

    __repr__ = brief_repr

    sources: tuple[NoiseSource, ...]
    adopted: str | None
    model: NoiseModel | None
    sentence: str

    @property
    def level(self) -> NoiseLevel | None:
        """The relative noise, and how well it is known."""
        if self.model is None or self.adopted is None:
            return None
        return NoiseLevel(self.model.relative, float(self.source(self.adopted).pairs))

    def relative_of(self, data: GonioData) -> Float[np.ndarray, " points"]:
        """Relative standard deviation of each point of the measurement; NaN without a model.

        It is that of the point's own scan if the adopted source lies within scans, every scan has at least 20
        pairs, and their variances differ (Bartlett 1937, level 0.001); otherwise that of the model.
        """
        model = np.full(len(data), np.nan if self.model is None else self.model.relative)
        if self.adopted not in ("repeats", "mirror", "roughness"):
            return model
        scans = self.source(self.adopted).scans
        told = {scatter.scan.index for scatter in scans if scatter.pairs >= ROBUST_FROM}
        if len(told) < 2 or told != {scan.index for scan in data.scans if scan.used}:
            return model
        pairs = np.array([scatter.pairs for scatter in scans], float)
        variance = np.array([scatter.relative**2 for scatter in scans])
        if not _variances_differ(pairs, variance):
            return model
        by_scan = {scatter.scan.index: scatter.relative for scatter in scans}
        return np.array([by_scan.get(index, np.nan) for index in data.scan_index.tolist()])

    def source(self, name: str) -> NoiseSource:
        """Estimate from one source, by name."""
        return next(source for source in self.sources if source.name == name)


def _variances_differ(pairs: np.ndarray, variance: np.ndarray) -> bool:
    """Bartlett's test of equal variances, for differences whose mean is known to be 0."""
    # Imported late because reading a file needs no scipy.
    from scipy.special import chdtrc

    if np.any(variance <= 0):
        return False
    pooled = np.sum(pairs * variance) / np.sum(pairs)
    statistic = np.sum(pairs) * np.log(pooled) - np.sum(pairs * np.log(variance))
    correction = 1 + (np.sum(1 / pairs) - 1 / np.sum(pairs)) / (3 * (pairs.size - 1))
    return bool(chdtrc(pairs.size - 1, statistic / correction) < _DIFFER)
