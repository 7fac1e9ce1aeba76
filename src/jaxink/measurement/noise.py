"""Noise of a measurement, estimated from values that must agree: repeats, mirror images, reciprocal pairs.

No model of the sample is used, so a misfit is never mistaken for noise. Every estimate is the root mean
square of relative differences d = (a - b) / mean, scaled such that independent errors of relative standard
deviation s give s. If there are at least 20 differences, those beyond 5 robust standard deviations (1.4826
times the median of |d|) are excluded and counted; this removes 6e-7 of Gaussian errors.
"""

import numpy as np

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.noise_model import ROBUST_FROM, NoiseEstimate, NoiseModel, NoiseSource, ScanScatter
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


def _scan_relative(reciprocal: Differences, within: NoiseSource) -> float:
    """Standard deviation of scan factors, from excess variance between scans; 0 below 2 standard errors."""
    kept = reciprocal.only(_inliers(reciprocal))
    if kept.weight.size < MINIMUM_PAIRS:
        return 0.0
    expected = within.relative**2 * kept.spread
    excess = float(np.mean(kept.relative**2 * kept.spread - expected))
    error = np.sqrt(2 * np.sum(expected**2) / kept.weight.size**2 + 2 * np.mean(expected) ** 2 / within.pairs)
    # Half, because each of the two scans has its own factor.
    return float(np.sqrt(excess / 2)) if excess > 2 * error else 0.0


def symmetry_repeatability(data: GonioData) -> tuple[ScanScatter, ...]:
    """Agreement of phi with -phi in each scan that has mirror pairs, without masked points.

    The result is empty for in-plane data.
    """
    used = without_copies(data)
    _, means = repeat_differences(used)
    return _source("mirror", mirror_differences(means), data.scans).scans


def estimate_noise(data: GonioData) -> NoiseEstimate:
    """Relative noise of a measurement, estimated from values that must agree.

    Parameters
    ----------
    data
        The measurement; masked points and exact copies of rows are not used.

    Returns
    -------
    NoiseEstimate
        From the first of repeats, mirror pairs and reciprocal pairs that has ``MINIMUM_PAIRS``, otherwise
        from the one with most pairs. ``floor_per_sr`` is 0, as pairs cannot separate it from relative noise.

    Notes
    -----
    Mirror pairs assume an azimuthally isotropic sample, reciprocal pairs f(i, o) = f(o, i) in reflection.
    Violations, such as by a tilted sample, are included in the estimate. Readings that agree exactly in all
    pairs are copies made by the instrument's software and are ignored.
    """
    used = without_copies(data)
    repeats, means = repeat_differences(used)
    reciprocal = reciprocal_differences(means)
    sources = (
        _source("repeats", repeats, data.scans),
        _source("mirror", mirror_differences(means), data.scans),
        _source("reciprocal", reciprocal, data.scans),
    )
    telling = [source for source in sources if source.pairs and source.relative > 0]
    if not telling:
        text = (
            "There are no repeat, mirror or reciprocal pairs to estimate the noise from; give column "
            "sigma_per_sr or a noise model."
        )
        return NoiseEstimate(sources, None, None, text)
    enough = [source for source in telling if source.pairs >= MINIMUM_PAIRS]
    adopted = enough[0] if enough else max(telling, key=lambda source: source.pairs)
    is_within = adopted.name != "reciprocal"
    scan_relative = _scan_relative(reciprocal, adopted) if is_within else 0.0
    model = NoiseModel(adopted.relative, 0.0, scan_relative)
    sentence = _sentence(data, sources, adopted, model)
    return NoiseEstimate(sources, adopted.name, model, sentence)


def _sentence(data, sources, adopted: NoiseSource, model: NoiseModel) -> str:
    parts = [f"Relative noise {model.relative:.2%} from {_pairs(adopted)}"]
    if adopted.pairs < MINIMUM_PAIRS:
        parts[0] += f" (uncertain: fewer than {MINIMUM_PAIRS} pairs)"
    for source in sources:
        if source is adopted:
            continue
        if not source.pairs:
            parts.append(f"no {_KINDS[source.name]} pairs")
        elif source.relative == 0:
            parts.append(f"{_pairs(source)} agree exactly, so they are copies")
        else:
            few = ", too few to trust" if source.pairs < MINIMUM_PAIRS else ""
            verb = "gives" if source.pairs == 1 else "give"
            parts.append(f"{_pairs(source)} {verb} {source.relative:.2%}{few}")
    if adopted.name == "reciprocal":
        parts.append("this includes a factor of each scan")
    elif model.scan_relative > 0:
        parts.append(f"in addition, scans differ by a common factor with {model.scan_relative:.2%}")
    elif sources[-1].pairs >= MINIMUM_PAIRS:
        parts.append("scans do not scatter beyond it")
    else:
        parts.append("a factor that varies from scan to scan cannot be estimated")
    if data.sigma_per_sr is not None:
        positive = data.used & (data.bsdf_per_sr > 0)
        stated = np.median(data.sigma_per_sr[positive] / data.bsdf_per_sr[positive])
        parts.append(f"the file states {stated:.2%} (median)")
    return "; ".join(parts) + "."


def _pairs(source: NoiseSource) -> str:
    text = f"{source.pairs} {_KINDS[source.name]} pair{'s' * (source.pairs != 1)}"
    if source.outliers:
        text += f" ({source.outliers} outlier{'s' * (source.outliers != 1)} left out)"
    return text
