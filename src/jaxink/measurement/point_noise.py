"""Noise of the used points of a measurement: from the file, as declared, or estimated from the values."""

import dataclasses

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.measurement.dataset import GonioData
from jaxink.measurement.neighbours import values_of_neighbours
from jaxink.measurement.noise import MINIMUM_PAIRS, estimate_noise
from jaxink.measurement.noise_model import NoiseEstimate, NoiseLevel
from jaxink.measurement.one_sample import UNLIKE, refuse_other_samples
from jaxink.measurement.pairs import direction_groups

# A residual is not consistent with noise if the probability of its chi-square is below this.
LEAST_PROBABILITY = 1e-3
# Few goniometers repeat better from scan to scan. Where the noise of points is stated and that of scans is
# not, this is allowed for, so that a diagnosis does not name an effect for it.
USUAL_SCAN_RELATIVE = 0.002
# Factor to which stated standard deviations are trusted: a residual that exceeds them by less is no misfit.
SIGMA_TOLERANCE = 1.1
# Repeats that scatter by more than `UNLIKE`, and by so many times what other pairs or neighbours scatter, are
# readings of different samples.
_TIMES_OTHERS = 5.0
_REMEDY_OF_SIGMA = (
    "Fit different samples one by one (of one file, by --rows COLUMN=VALUE); if it is the same, set "
    "use_file_sigma = false in [noise], and state as relative how well its readings reproduce"
)


@dataclasses.dataclass(frozen=True)
class Noise:
    """Declared noise of a measurement.

    Parameters
    ----------
    relative, floor_per_sr
        Independent for each point: sigma^2 = (relative f)^2 + floor^2, where f is the value of the point by
        `values_of_neighbours`; ``relative`` is None if not declared.
    scan_relative
        Standard deviation of the unknown common factor of each scan; None if not declared: `noise_of` then
        allows for `USUAL_SCAN_RELATIVE`, or estimates it with the rest.
    use_file_sigma
        Whether a sigma column of the file takes precedence over ``relative`` and ``floor_per_sr``.
    """

    relative: float | None = None
    floor_per_sr: float = 0.0
    scan_relative: float | None = None
    use_file_sigma: bool = True


@dataclasses.dataclass(frozen=True)
class FitNoise:
    """The noise that a fit uses, and where it came from.

    Parameters
    ----------
    sigma_per_sr
        Independent standard deviation of each used point.
    scan_relative
        Standard deviation of the common factor of each scan.
    origin
        Sentence for reports.
    known
        False if neither the file nor a declaration nor the values give the noise: chi-square and standard
        errors are then meaningless and not given.
    level
        Of an estimated noise: its size, and how well it is known; None if it is stated or unknown.
    """

    __repr__ = brief_repr

    sigma_per_sr: Float[np.ndarray, " points"]
    scan_relative: float
    origin: str
    known: bool = True
    level: NoiseLevel | None = None

    @property
    def degrees_of_freedom(self) -> float:
        """Of the estimate of its level; infinite if it is stated."""
        return np.inf if self.level is None else self.level.degrees_of_freedom


def noise_of(data: GonioData, declared: Noise) -> FitNoise:
    """Noise of the used points: from the file, as declared, or from the values; never from a misfit.

    Raises
    ------
    InputRefusedError
        If the standard deviation, declared or estimated, is 0 at some point, or none is declared and repeats
        cannot be readings of one sample.
    """
    bsdf = data.bsdf_per_sr[data.used]
    if data.sigma_per_sr is not None and declared.use_file_sigma:
        refuse_other_samples(data, _REMEDY_OF_SIGMA)
        return _stated(data.sigma_per_sr[data.used], "sigma_per_sr of the file", declared)
    if declared.relative is not None:
        sigma = np.hypot(declared.relative * bsdf, declared.floor_per_sr)
        if not np.all(sigma > 0):
            raise InputRefusedError(
                "noise.relative and noise.floor_per_sr give a standard deviation of 0 at some points; give a "
                "noise.floor_per_sr above 0."
            )
        with np.errstate(divide="ignore"):
            values = values_of_neighbours(data, sigma / np.abs(bsdf))
        sigma = np.hypot(declared.relative * values, declared.floor_per_sr)
        origin = f"declared: {declared.relative:.3g} of the value, floor {declared.floor_per_sr:.3g} /sr"
        return _stated(sigma, origin, declared)
    return _estimated(data, declared.scan_relative)


def _stated(sigma_per_sr: Float[np.ndarray, " points"], origin: str, declared: Noise) -> FitNoise:
    """Stated noise of the points, with the factor of a scan that is declared or usual."""
    if declared.scan_relative is not None:
        return FitNoise(sigma_per_sr, declared.scan_relative, origin)
    origin += "; how well scans repeat is not stated, and taken as usual"
    return FitNoise(sigma_per_sr, USUAL_SCAN_RELATIVE, origin)


def _estimated(data: GonioData, scan_relative: float | None) -> FitNoise:
    """Noise from the values themselves; the factor of a scan is at least the declared one."""
    bsdf, estimate = data.bsdf_per_sr[data.used], estimate_noise(data)
    refuse_other_samples(data)
    _refuse_unlike_repeats(data, estimate)
    if estimate.model is None:
        size = np.abs(bsdf)
        # Most values may be 0.
        sigma = np.full(bsdf.shape, np.median(size) or np.mean(size) or 1.0)
        return FitNoise(sigma, 0.0, "unknown: " + estimate.sentence, known=False)
    _refuse_exact_zeros(data)
    relative, origin = estimate.relative_of(data)[data.used], estimate.sentence
    if np.ptp(relative) > 0:
        span = f"{100 * relative.min():.2f} to {100 * relative.max():.2f} %"
        origin += f" The noise differs between scans ({span}), so each has its own value."
    factor = max(estimate.model.scan_relative, scan_relative or 0.0)
    # Reciprocal pairs contain the factors of their scans, if any.
    if scan_relative is None and factor == 0 and estimate.adopted != "reciprocal":
        factor = USUAL_SCAN_RELATIVE
        origin += " How well scans repeat is taken as usual."
    sigma = relative * values_of_neighbours(data, relative)
    return FitNoise(sigma, factor, origin, level=estimate.level)


def _refuse_exact_zeros(data: GonioData) -> None:
    """Noise that is relative only would make a value of 0 infinitely certain."""
    zero = np.flatnonzero(data.used & (data.bsdf_per_sr == 0))
    if zero.size:
        values = "1 value is" if zero.size == 1 else f"{zero.size} values are"
        place = f"{data.source or 'GonioData'}, {data.place(int(zero[0]))}, column bsdf_per_sr"
        raise InputRefusedError(
            f"{place}: {values} exactly 0, where the estimated noise, which is relative, would be 0; "
            "remove what is no reading, or state noise.relative and a noise.floor_per_sr above 0 in the "
            "sample file."
        )


def _refuse_unlike_repeats(data: GonioData, estimate: NoiseEstimate) -> None:
    """Refuse repeats that differ far more than everything else that should agree."""
    repeats = estimate.source("repeats")
    others = [
        source
        for source in estimate.sources
        if source is not repeats and source.pairs >= MINIMUM_PAIRS and source.relative > 0
    ]
    if not others or repeats.pairs < MINIMUM_PAIRS or not repeats.relative > UNLIKE:
        return
    other = min(others, key=lambda source: source.relative)
    if repeats.relative < _TIMES_OTHERS * other.relative:
        return
    words = "neighbours along a scan" if other.name == "roughness" else f"{other.name} pairs"
    first, second = _most_unlike(data)
    values = " and ".join(f"{data.bsdf_per_sr[point]:.4g}" for point in (first, second))
    raise InputRefusedError(
        f"{data.source or 'the measurement'}: repeated readings of a direction differ by "
        f"{repeats.relative:.1%}, but {words} by {other.relative:.2%} only (most of all {data.place(first)} "
        f"and {data.place(second)}: {values} /sr); is it the same sample? Fit different samples one by one; "
        "if it is the same, state as relative in [noise] how well its readings reproduce."
    )


def _most_unlike(data: GonioData) -> tuple[int, int]:
    """The two readings of one direction with the largest ratio."""
    here = np.flatnonzero(data.used & (data.bsdf_per_sr > 0))
    order = here[np.lexsort((data.bsdf_per_sr[here], direction_groups(data)[here]))]
    group, level = direction_groups(data)[order], np.log(data.bsdf_per_sr[order])
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    ends = np.append(starts[1:], group.size) - 1
    most = int(np.argmax(level[ends] - level[starts]))
    first, second = sorted((int(order[starts[most]]), int(order[ends[most]])))
    return first, second
