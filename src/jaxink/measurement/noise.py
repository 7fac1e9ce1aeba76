"""Noise of a measurement, estimated from its values: repeats, mirror images, reciprocal pairs, roughness.

No model of the sample is used, so a misfit is never mistaken for noise. Every estimate is the root mean
square of relative differences d = (a - b) / mean, scaled such that independent errors of relative standard
deviation s give s. If there are at least 20 differences, those beyond 5 robust standard deviations (1.4826
times the median of |d|) are excluded and counted; this removes 6e-7 of Gaussian errors. For the roughness of
scans, see `jaxink.measurement.neighbour_noise`.
"""

from typing import NamedTuple

import numpy as np

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.neighbour_noise import roughness_of_scans
from jaxink.measurement.noise_model import (
    ROBUST_FROM,
    NoiseEstimate,
    NoiseLevel,
    NoiseModel,
    NoiseSource,
    ScanScatter,
)
from jaxink.measurement.pairs import (
    Differences,
    mirror_differences,
    reciprocal_differences,
    repeat_differences,
    without_copies,
)
from jaxink.measurement.scans import Scan

MINIMUM_PAIRS = 10
_OUTLIER = 5.0
# Two estimates disagree if a ratio as extreme has a smaller probability.
_DISAGREE = 1e-3
_KINDS = {"repeats": "repeat", "mirror": "mirror", "reciprocal": "reciprocal"}


def _inliers(differences: Differences) -> np.ndarray:
    size = np.abs(differences.relative)
    if size.size < ROBUST_FROM:
        return np.ones(size.size, bool)
    median = np.full(size.size, np.median(size))
    # A noisier scan is judged by its own scale, if it has enough pairs.
    for scan in np.unique(differences.scan_a):
        here = differences.scan_a == scan
        if here.sum() >= ROBUST_FROM:
            median[here] = np.median(size[here])
    # If more than half of the rounded readings agree exactly, there is no scale to judge by.
    return (size <= _OUTLIER * 1.4826 * median) | (median == 0)


def _rms(differences: Differences) -> float:
    weight = differences.weight
    return float(np.sqrt((weight * differences.relative**2).sum() / weight.sum()))


def _source(name: str, differences: Differences, scans: tuple[Scan, ...]) -> NoiseSource:
    keep = _inliers(differences)
    kept = differences.only(keep)
    by_scan = []
    for scan in scans:
        here = kept.only((kept.scan_a == scan.index) | (kept.scan_b == scan.index))
        if here.weight.size:
            mean = np.average(here.relative * np.sqrt(here.spread), weights=here.weight)
            pairs = round(float(here.weight.sum()))
            by_scan.append(ScanScatter(scan, pairs, _rms(here), float(mean)))
    pairs = round(float(kept.weight.sum()))
    relative = _rms(kept) if pairs else float("nan")
    return NoiseSource(name, pairs, relative, int((~keep).sum()), tuple(by_scan))


class _ScanFactor(NamedTuple):
    """Standard deviation of the common factors of scans, and whether they are significant."""

    relative: float
    is_found: bool


def _scan_factor(reciprocal: Differences, within: NoiseSource) -> _ScanFactor:
    """From the excess variance between scans; below 2 standard errors, what one standard error allows."""
    kept = reciprocal.only(_inliers(reciprocal))
    if kept.weight.size < MINIMUM_PAIRS:
        return _ScanFactor(0.0, False)
    expected = within.relative**2 * kept.spread
    excess = float(np.mean(kept.relative**2 * kept.spread - expected))
    error = np.sqrt(2 * np.sum(expected**2) / kept.weight.size**2 + 2 * np.mean(expected) ** 2 / within.pairs)
    is_found = excess > 2 * error
    # Half, because each of the two scans has its own factor.
    variance = (excess if is_found else max(excess, 0.0) + error) / 2
    return _ScanFactor(float(np.sqrt(variance)), is_found)


def symmetry_repeatability(data: GonioData) -> tuple[ScanScatter, ...]:
    """Agreement of phi with -phi in each scan that has mirror pairs, without masked points.

    The result is empty for in-plane data.
    """
    used = without_copies(data)
    _, means = repeat_differences(used)
    return _source("mirror", mirror_differences(means), data.scans).scans


def _roughness(data: GonioData) -> NoiseSource:
    """From the scans that tell it, if they have half of the points: fewer do not speak for the others."""
    scans = {scan.index: scan for scan in data.scans}
    found = roughness_of_scans(data)
    if 2 * sum(scans[one.scan].used for one in found) < data.used.sum():
        found = ()
    freedom = sum(one.degrees_of_freedom for one in found)
    squares = sum(one.degrees_of_freedom * one.relative**2 for one in found)
    by_scan = tuple(
        ScanScatter(scans[one.scan], round(one.degrees_of_freedom), one.relative, 0.0) for one in found
    )
    relative = float(np.sqrt(squares / freedom)) if found else float("nan")
    return NoiseSource("roughness", round(freedom), relative, sum(one.outliers for one in found), by_scan)


def _exceeds(one: NoiseSource, other: NoiseSource) -> bool:
    """Whether one estimate is significantly larger than another."""
    # Imported late because reading a file needs no scipy.
    from scipy.special import fdtrc

    ratio = (one.relative / other.relative) ** 2
    return bool(fdtrc(one.pairs, other.pairs, ratio) < _DISAGREE)


def estimate_noise(data: GonioData) -> NoiseEstimate:
    """Relative noise of a measurement, estimated from its values alone.

    Parameters
    ----------
    data
        The measurement; masked points and exact copies of rows are not used.

    Returns
    -------
    NoiseEstimate
        From repeats or else mirror pairs; from the roughness of the scans, if it agrees with these and tells
        the noise better, or if there are fewer than ``MINIMUM_PAIRS`` of them; otherwise from reciprocal
        pairs, or from the source with most pairs. ``floor_per_sr`` is 0.

    Notes
    -----
    Mirror pairs assume an azimuthally isotropic sample, reciprocal pairs f(i, o) = f(o, i) in reflection.
    Violations, such as by a tilted sample, are included in the estimate. Readings that agree exactly in all
    pairs are copies made by the instrument's software and are ignored. Roughness that exceeds the scatter of
    reciprocal pairs is structure of the scans and is ignored, too. If reciprocal pairs do not scatter
    significantly more than points of one scan, ``scan_relative`` is what one standard error does not exclude.
    """
    used = without_copies(data)
    repeats, means = repeat_differences(used)
    reciprocal = reciprocal_differences(means)
    sources = (
        _source("repeats", repeats, data.scans),
        _source("mirror", mirror_differences(means), data.scans),
        _source("reciprocal", reciprocal, data.scans),
        _roughness(used),
    )
    adopted = _adopted(*sources)
    if adopted is None:
        text = (
            "There are no repeat, mirror or reciprocal pairs, nor scans dense and smooth enough, to estimate "
            "the noise from; give column sigma_per_sr or a noise model."
        )
        return NoiseEstimate(sources, None, None, text)
    is_within = adopted.name != "reciprocal"
    factor = _scan_factor(reciprocal, adopted) if is_within else _ScanFactor(0.0, False)
    model = NoiseModel(adopted.relative, 0.0, factor.relative)
    sentence = _sentence(data, sources, adopted, factor)
    return NoiseEstimate(sources, adopted.name, model, sentence)


def _adopted(
    repeats: NoiseSource, mirror: NoiseSource, reciprocal: NoiseSource, roughness: NoiseSource
) -> NoiseSource | None:
    """The source to use, see `estimate_noise`."""
    sources = (repeats, mirror, reciprocal, roughness)
    telling = [source for source in sources if source.pairs and source.relative > 0]
    enough = [source for source in telling if source.pairs >= MINIMUM_PAIRS]
    if not enough:
        return max(telling, key=lambda source: source.pairs, default=None)
    first = enough[0]
    if roughness not in enough or first is roughness:
        return first
    agrees = not _exceeds(roughness, first)
    if first is reciprocal:
        # These also contain the factors of two scans.
        return roughness if agrees else first
    agrees = agrees and not _exceeds(first, roughness)
    return roughness if agrees and roughness.pairs > first.pairs else first


def _sentence(data, sources, adopted: NoiseSource, factor: _ScanFactor) -> str:
    text = NoiseLevel(adopted.relative, adopted.pairs).text
    parts = [f"Relative noise {text} from {_pairs(adopted)}"]
    if adopted.pairs < MINIMUM_PAIRS:
        parts[0] += f" (uncertain: fewer than {MINIMUM_PAIRS} pairs)"
    for source in sources:
        if source is adopted:
            continue
        if not source.pairs:
            if source.name != "roughness":
                parts.append(f"no {_KINDS[source.name]} pairs")
        elif source.relative == 0:
            parts.append(f"{_pairs(source)} agree exactly, so they are copies")
        else:
            few = ", too few to trust" if source.pairs < MINIMUM_PAIRS else ""
            verb = "gives" if source.pairs == 1 or source.name == "roughness" else "give"
            parts.append(f"{_pairs(source)} {verb} {source.relative:.2%}{few}")
    if adopted.name == "reciprocal":
        parts.append("this includes a factor of each scan")
    elif factor.is_found:
        parts.append(f"in addition, scans differ by a common factor with {factor.relative:.2%}")
    elif factor.relative:
        parts.append(
            f"scans do not scatter beyond it, but a common factor with {factor.relative:.2%} is not excluded"
        )
    else:
        parts.append("a factor that varies from scan to scan cannot be estimated")
    if data.sigma_per_sr is not None:
        positive = data.used & (data.bsdf_per_sr > 0)
        stated = np.median(data.sigma_per_sr[positive] / data.bsdf_per_sr[positive])
        parts.append(f"the file states {stated:.2%} (median)")
    return "; ".join(parts) + "."


def _pairs(source: NoiseSource) -> str:
    if source.name == "roughness":
        count = len(source.scans)
        text = f"the roughness of {count} scan{'s' * (count != 1)}"
    else:
        text = f"{source.pairs} {_KINDS[source.name]} pair{'s' * (source.pairs != 1)}"
    if source.outliers:
        text += f" ({source.outliers} outlier{'s' * (source.outliers != 1)} left out)"
    return text
