"""Where in angle, side, wavelength and time a residual stands, and one line of plain words for it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.special import chdtrc

from jaxink.diagnosis.candidate import ScreenOptions
from jaxink.diagnosis.discrepancy import SmoothPart, smooth_part
from jaxink.diagnosis.points import Points
from jaxink.diagnosis.projection import Projection, TangentCone, orthonormal_range

_DISTANCE_EDGES = {
    "forward": (0.0, 5.0, 15.0, 30.0, 60.0, 180.0),
    "retro": (0.0, 5.0, 15.0, 30.0, 60.0, 180.0),
    "horizon": (0.0, 10.0, 20.0, 40.0, 90.0),
}
# A reading as near to an edge stands on it, hence within: goniometers like the very angles of the edges.
_ROUNDING_DEG = 1e-6
_TIMES = ("in the first quarter", "in the second quarter", "in the third quarter", "in the last quarter")
# Of the sum of squares: enough to name one side alone, a distance, or what lies elsewhere.
_ONE_SIDE, _TELLING, _ELSEWHERE = 0.8, 0.25, 0.25
# How much larger, and by how many standard errors, to be called larger.
_LARGER, _SURE = 1.5, 3.0


@dataclass(frozen=True)
class Factor:
    """One way of dividing the points, and how the residual follows it.

    Parameters
    ----------
    name
        ``side``, ``incidence``, ``wavelength``, ``time``, ``forward``, ``retro`` or ``horizon``.
    levels
        Name of each level.
    means
        Mean residual of each, in standard deviations of the noise.
    share
        Of the smooth part's sum of squares, what the means of the levels make up.
    p_value
        Chance of means as large where there is noise alone; exact, the fit being accounted for.
    """

    name: str
    levels: tuple[str, ...]
    means: Float[np.ndarray, " levels"]
    share: float
    p_value: float


@dataclass(frozen=True)
class Location:
    """Where a residual stands.

    Parameters
    ----------
    sentence
        In plain words, without a capital or a stop.
    factors
        Analyses of variance, the largest share first.
    smooth
        The smooth part they refer to.
    """

    sentence: str
    factors: tuple[Factor, ...]
    smooth: SmoothPart

    def to_dict(self) -> dict:
        """What a report says of it, for `jaxink.files.encoding.plain`."""
        return {
            "sentence": self.sentence,
            "structured_share": self.smooth.share,
            "factors": self.factors,
        }


def locate(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
) -> Location:
    """Divide the residual by side, incidence, wavelength, time and distances to directions of note.

    Parameters
    ----------
    residual, jacobian, points, at_bound, options
        As of `find_structure`.
    """
    options = ScreenOptions() if options is None else options
    smooth = smooth_part(residual, jacobian, points, at_bound=at_bound, options=options)
    cone = TangentCone.of(jacobian, at_bound)
    projection = cone.projection(cone.active(residual[None, :])[0])
    left = projection.remove(residual)
    factors = []
    for name, (labels, levels) in _divisions(points).items():
        if len(levels) < 2:
            continue
        means, share = _between(labels, len(levels), left[: len(points)], smooth.values)
        factors.append(Factor(name, levels, means, share, _p_value(labels, projection, left)))
    factors = tuple(sorted(factors, key=lambda factor: -factor.share))
    if smooth.p_value > options.level:
        return Location("no structure stands out of the noise", factors, smooth)
    return Location(_words(points, left[: len(points)], smooth), factors, smooth)


def _divisions(points: Points) -> dict[str, tuple[np.ndarray, tuple[str, ...]]]:
    """Number of the level of each point, -1 for none, and the names of the levels."""
    divisions = {
        "side": _distinct(points.is_transmission, lambda side: "T" if side else "R"),
        "incidence": _distinct(points.theta_i_deg, lambda angle: f"at {angle:g} degrees incidence"),
        "wavelength": _distinct(points.wavelength_nm, lambda length: f"at {length:g} nm"),
    }
    rank = np.argsort(np.argsort(points.order, kind="stable"))
    divisions["time"] = (rank * len(_TIMES) // len(points), _TIMES)
    for name, edges in _DISTANCE_EDGES.items():
        bands = [_band_words(low, high, edges[-1]) for low, high in zip(edges, edges[1:], strict=False)]
        divisions[name] = (_bands(points, name), tuple(f"{band} the {name}" for band in bands))
    return divisions


def _distinct(values, word):
    distinct, labels = np.unique(np.round(values.astype(float), 3), return_inverse=True)
    return labels.reshape(-1), tuple(word(value) for value in distinct)


def _bands(points: Points, name):
    distance = {
        "forward": points.from_forward_deg,
        "retro": points.from_retro_deg,
        "horizon": 90 - points.theta_o_deg,
    }[name]
    inner_edges = np.array(_DISTANCE_EDGES[name][1:-1]) + _ROUNDING_DEG
    return np.where(np.isfinite(distance), np.searchsorted(inner_edges, distance), -1)


def _band_words(low, high, end):
    if low == 0:
        return f"within {high:g} degrees of"
    if high == end:
        return f"beyond {low:g} degrees from"
    return f"{low:g} to {high:g} degrees from"


def _between(labels, n_levels, left, smooth):
    """Means of the residual by level, and the share of the smooth part that its own means make up."""
    inside = labels >= 0
    count = np.bincount(labels[inside], minlength=n_levels)
    divisor = np.maximum(count, 1)
    means = np.bincount(labels[inside], left[inside], n_levels) / divisor
    smooth_means = np.bincount(labels[inside], smooth[inside], n_levels) / divisor
    total = float(np.sum(smooth**2))
    share = float(np.sum(count * smooth_means**2)) / total if total > 0 else 0.0
    return np.where(count > 0, means, np.nan), share


def _p_value(labels, projection: Projection, left) -> float:
    indicators = (labels[:, None] == np.arange(labels.max() + 1)).astype(float)
    padded = np.zeros((left.size, indicators.shape[1]))
    padded[: labels.size] = indicators
    unit, norm = projection.unit(padded)
    basis = orthonormal_range(unit[:, norm > 0])
    return float(chdtrc(basis.shape[1], np.sum((basis.T @ left) ** 2))) if basis.shape[1] else 1.0


def _words(points: Points, left, smooth: SmoothPart) -> str:
    # Smoothed noise has a power of its own, also where nothing stands.
    power, values = smooth.values**2 - smooth.noise_power, smooth.values
    sides = {side: points.is_transmission == (side == "T") for side in "RT"}
    by_side = {side: max(float(np.sum(power[here])), 0.0) for side, here in sides.items()}
    main = max(by_side, key=lambda side: by_side[side])
    both = by_side[main] < _ONE_SIDE * sum(by_side.values())
    by_sign = {side: _mean_sign(values[here]) for side, here in sides.items()}
    if both and by_sign["R"] * by_sign["T"] < 0:
        return f"{_sign_word(by_sign['R'])} on side R, {_sign_word(by_sign['T'])} on side T"
    region = np.ones(len(points), bool) if both else sides[main]
    place = "on both sides" if both else f"on side {main}"
    band, sign, text = _band(points, values, region, "specular" if not both and main == "R" else "forward")
    if sign == 0:
        return f"changing sign {place}"
    words = f"{_sign_word(sign)} {place}{text}"
    outside = region & ~band
    if np.sum(power[outside]) > _ELSEWHERE * np.sum(power[region]) and _mean_sign(values[outside]) == -sign:
        words += f", {_sign_word(-sign)} elsewhere"
    return words + _trends(points, sign * left, band)


def _sign_word(sign) -> str:
    return "positive" if sign > 0 else "negative"


def _mean_sign(values) -> int:
    """Sign that prevails, 0 where none does."""
    if values.size == 0:
        return 0
    mean, rms = np.mean(values), np.sqrt(np.mean(values**2))
    return int(np.sign(mean)) if abs(mean) > 0.5 * rms else 0


def _band(points: Points, smooth, region, forward):
    """The distance whose bands the smooth part follows best, and its strongest run of bands of one sign.

    One incidence or wavelength where it follows that more than any distance; all of the region where it
    follows none.
    """
    whole = region, _mean_sign(smooth[region]), ""
    here = np.where(region, smooth, 0.0)
    divisions = _divisions(points)
    shares = {}
    for name, (labels, levels) in divisions.items():
        # Transmission has no way back to the source: such a division would be one of sides.
        if name not in ("side", "time") and np.all(labels[region] >= 0):
            shares[name] = _between(np.where(region, labels, -1), len(levels), smooth, here)[1]
    name = max(shares, key=lambda name: shares[name])
    # A mean that is the same everywhere makes up as much without any band.
    flat = np.sum(region) * np.mean(smooth[region]) ** 2 / np.sum(smooth[region] ** 2)
    if shares[name] - flat < _TELLING:
        return whole
    labels, levels = np.where(region, divisions[name][0], -1), divisions[name][1]
    count = np.bincount(labels[region], minlength=len(levels))
    means = np.bincount(labels[region], smooth[region], len(levels)) / np.maximum(count, 1)
    first = last = strongest = int(np.argmax(count * means**2))
    sign = int(np.sign(means[strongest]))
    if name not in _DISTANCE_EDGES:
        return labels == strongest, sign, f" {levels[strongest]}"
    alike = means * means[strongest] > 0.25 * means[strongest] ** 2
    while first > 0 and alike[first - 1]:
        first -= 1
    while last < len(means) - 1 and alike[last + 1]:
        last += 1
    band = (labels >= first) & (labels <= last)
    if np.array_equal(band, region):
        return whole
    target = {"forward": f"the {forward} direction", "retro": "the source", "horizon": "the horizon"}[name]
    edges = _DISTANCE_EDGES[name]
    return band, sign, f" {_band_words(edges[first], edges[last + 1], edges[-1])} {target}"


def _trends(points: Points, oriented, band) -> str:
    """Levels of incidence, wavelength and time at which the residual is clearly larger than at the others."""
    words = []
    divisions = _divisions(points)
    for name in ("incidence", "wavelength", "time"):
        labels, levels = divisions[name]
        if name == "time":
            # Scans follow each other in time: only what changes within them is told of it.
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
        if means[top] > _LARGER * rest and means[top] - rest > _SURE * error:
            words.append(f", larger {levels[top]}")
    return "".join(words)
