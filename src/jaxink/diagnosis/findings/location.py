"""Where a residual is large (angle, side, wavelength, time), described in one sentence."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.statistics.candidate import ScreenOptions
from jaxink.diagnosis.statistics.discrepancy import SmoothPart, smooth_part
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.tangent_cone import TangentCone
from jaxink.diagnosis.statistics.variance_analysis import (
    DISTANCE_EDGES,
    TARGETS,
    Factor,
    band_words,
    divisions_of,
    factors_of,
    level_means,
)
from jaxink.display.brief import brief_repr

NOWHERE = "no structure is significant against the noise"


@dataclass(frozen=True)
class Location:
    """Where a residual is large.

    Parameters
    ----------
    sentence
        Description, without a capital letter or a full stop.
    factors
        Analyses of variance, the largest share first.
    smooth
        The smooth part that they refer to.
    """

    __repr__ = brief_repr

    sentence: str
    factors: tuple[Factor, ...]
    smooth: SmoothPart

    @property
    def is_found(self) -> bool:
        """Whether the sentence names a place: a smooth part is significant."""
        return self.sentence != NOWHERE

    def to_dict(self) -> dict:
        """Entry of ``report.json``, for `jaxink.files.encoding.plain`."""
        return {"sentence": self.sentence, "structured_share": self.smooth.share, "factors": self.factors}


def locate(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
    policy: SearchPolicy = DEFAULT_POLICY,
) -> Location:
    """Analyse the variance by side, incidence, wavelength, time and angular distance, and describe it.

    Parameters
    ----------
    residual, jacobian, points, at_bound, options
        See `find_structure`.
    policy
        Thresholds for the description.
    """
    options = ScreenOptions() if options is None else options
    smooth = smooth_part(residual, jacobian, points, at_bound=at_bound, options=options)
    cone = TangentCone.of(jacobian, at_bound)
    projection = cone.projection(cone.active(residual[None, :])[0])
    left = projection.remove(residual)
    factors = factors_of(left, projection, points, smooth)
    if smooth.p_value > options.level:
        return Location(NOWHERE, factors, smooth)
    return Location(_Words(points, policy).sentence(left[: len(points)], smooth), factors, smooth)


class _Band(NamedTuple):
    """Points of a band, the sign of the residual there, and its description."""

    points: Bool[np.ndarray, " points"]
    sign: int
    text: str


@dataclass(frozen=True)
class _Words:
    """Description of where a residual is large."""

    points: Points
    policy: SearchPolicy

    def sentence(self, left: Float[np.ndarray, " points"], smooth: SmoothPart) -> str:
        # Smoothed noise alone has some power, which is subtracted.
        power, values = smooth.values**2 - smooth.noise_power, smooth.values
        sides = {side: self.points.is_transmission == (side == "T") for side in "RT"}
        by_side = {side: max(float(np.sum(power[here])), 0.0) for side, here in sides.items()}
        main = max(by_side, key=lambda side: by_side[side])
        both = by_side[main] < self.policy.one_side_share * sum(by_side.values())
        by_sign = {side: self._prevailing_sign(values[here]) for side, here in sides.items()}
        if both and by_sign["R"] * by_sign["T"] < 0:
            return f"{_sign_word(by_sign['R'])} on side R, {_sign_word(by_sign['T'])} on side T"
        region = np.ones(len(self.points), bool) if both else sides[main]
        place = "on both sides" if both else f"on side {main}"
        band = self._band(values, region, "specular" if not both and main == "R" else "forward")
        if band.sign == 0:
            return f"changing sign {place}"
        words = f"{_sign_word(band.sign)} {place}{band.text}"
        outside = region & ~band.points
        is_much = np.sum(power[outside]) > self.policy.elsewhere_share * np.sum(power[region])
        if is_much and self._prevailing_sign(values[outside]) == -band.sign:
            words += f", {_sign_word(-band.sign)} elsewhere"
        return words + self._trends(band.sign * left, band.points)

    def _prevailing_sign(self, values) -> int:
        """The prevailing sign, or 0."""
        if values.size == 0:
            return 0
        mean, rms = np.mean(values), np.sqrt(np.mean(values**2))
        return int(np.sign(mean)) if abs(mean) > self.policy.prevailing_mean * rms else 0

    def _band(self, smooth, region, forward: str) -> _Band:
        """The division that the smooth part follows best, and its strongest run of bands of one sign.

        All of the region if it follows no division.
        """
        whole = _Band(region, self._prevailing_sign(smooth[region]), "")
        here = np.where(region, smooth, 0.0)
        divisions = divisions_of(self.points)
        shares = {}
        for name, (labels, levels) in divisions.items():
            # In transmission there is no source direction, so this division would be one of sides.
            if name not in ("side", "time") and np.all(labels[region] >= 0):
                shares[name] = level_means(np.where(region, labels, -1), len(levels), smooth, here).share
        name = max(shares, key=lambda name: shares[name])
        # A constant mean explains this much without any band.
        flat = np.sum(region) * np.mean(smooth[region]) ** 2 / np.sum(smooth[region] ** 2)
        if shares[name] - flat < self.policy.band_share:
            return whole
        labels, levels = np.where(region, divisions[name].labels, -1), divisions[name].levels
        count = np.bincount(labels[region], minlength=len(levels))
        means = np.bincount(labels[region], smooth[region], len(levels)) / np.maximum(count, 1)
        strongest = int(np.argmax(count * means**2))
        sign = int(np.sign(means[strongest]))
        if name not in DISTANCE_EDGES:
            return _Band(labels == strongest, sign, f" {levels[strongest]}")
        run = self._run(means, strongest)
        band = (labels >= run.start) & (labels < run.stop)
        if np.array_equal(band, region):
            return whole
        target = f"the {forward} direction" if name == "forward" else TARGETS[name]
        edges = DISTANCE_EDGES[name]
        return _Band(band, sign, f" {band_words(edges[run.start], edges[run.stop], edges[-1])} {target}")

    def _run(self, means, strongest: int) -> range:
        """The strongest band and similar neighbours."""
        first, end = strongest, strongest + 1
        alike = means * means[strongest] > self.policy.same_band_mean * means[strongest] ** 2
        while first > 0 and alike[first - 1]:
            first -= 1
        while end < len(means) and alike[end]:
            end += 1
        return range(first, end)

    def _trends(self, oriented, band) -> str:
        """Levels of incidence, wavelength and time where the residual is clearly larger than elsewhere."""
        words, points = [], self.points
        divisions = divisions_of(points)
        for name in ("incidence", "wavelength", "time"):
            labels, levels = divisions[name]
            if name == "time":
                # Scans are measured one after the other: only changes within a scan count as a trend in time.
                scan = points.scan[band]
                mean = np.bincount(scan, oriented[band]) / np.maximum(np.bincount(scan), 1)
                oriented = oriented - np.pad(mean, (0, points.n_scans - mean.size))[points.scan]
            count = np.bincount(labels[band], minlength=len(levels))
            if np.sum(count > 0) < 2:
                continue
            total = np.bincount(labels[band], oriented[band], len(levels))
            means = np.where(count > 0, total / np.maximum(count, 1), -np.inf)
            top = int(np.argmax(means))
            n_rest = int(count.sum() - count[top])
            rest = float(total.sum() - total[top]) / n_rest
            error = np.sqrt(1 / count[top] + 1 / n_rest)
            is_sure = means[top] - rest > self.policy.larger_errors * error
            if means[top] > self.policy.larger_ratio * rest and is_sure:
                words.append(f", larger {levels[top]}")
        return "".join(words)


def _sign_word(sign: int) -> str:
    return "positive" if sign > 0 else "negative"
