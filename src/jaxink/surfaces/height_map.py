"""Measured surface heights: facet slopes for geometrical optics, and the power spectrum for wave optics.

A map contains only part of the spatial frequencies. Undulations longer than its extent were removed with the
tilt. Slopes from central differences are those of heights averaged over two pitches; they drop to 2/pi of the
true slopes at the spatial frequency 1/(4 pitch).
"""

import dataclasses
import warnings

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Real

from jaxink.errors import InputRefusedError
from jaxink.numerics.precision import require_float64
from jaxink.numerics.validity import as_float
from jaxink.surfaces.slopes import SlopeDensity
from jaxink.surfaces.spectrum import TabulatedSpectrum, isotropic_from_profile, tabulated_spectrum

_FEWEST_HEIGHTS = 16
_LARGEST_HEIGHT_UM = 1e6
# Largest ratio of the slope variances at the pitch and at twice the pitch for a sufficiently fine pitch.
_MOST_GROWTH = 1.15
_SLOPE_BINS, _FEWEST_PER_BIN = 32, 30
# Fraction of the steepest facets, which is excluded.
_STEEPEST = 1e-4
# Rings of frequencies per octave; fewer for a profile, whose conversion to the plane differentiates noise.
_BINS_PER_OCTAVE, _BINS_OF_PROFILE = 6, 2


class TabulatedSlopes(SlopeDensity):
    """Tabulated density, interpolated by cubics in its logarithm, with a common factor of all slopes.

    Parameters
    ----------
    height_scale
        Factor of the heights and therefore of the slopes. The effect on light is quadratic in it.
    slopes
        Nodes, ascending from 0 to the largest slope.
    log_density
        Logarithm of P at the nodes for a factor of 1, up to a constant.
    """

    height_scale: Float[Array, ""] = eqx.field(converter=as_float)
    slopes: Float[Array, " nodes"] = eqx.field(converter=as_float)
    log_density: Float[Array, " nodes"] = eqx.field(converter=as_float)

    def _scale(self):
        weight = jnp.exp(self.log_density) * self.slopes * jnp.gradient(self.slopes)
        return self.height_scale * jnp.sqrt(weight @ self.slopes**2 / jnp.sum(weight) / 2)

    def _largest_slope(self):
        return self.height_scale * self.slopes[-1]

    def _shape(self, slope):
        x, y = self.slopes, self.log_density
        step, rise = jnp.diff(x), jnp.diff(y)
        secant = rise / step
        # Flat at slope 0, where a density in the plane is smooth; else the parabola through three nodes.
        inner = (secant[:-1] * step[1:] + secant[1:] * step[:-1]) / (step[1:] + step[:-1])
        tangent = jnp.concatenate([jnp.zeros(1), inner, secant[-1:]])
        at = slope / self.height_scale
        k = jnp.clip(jnp.searchsorted(x, at, side="right") - 1, 0, len(step) - 1)
        width = step[k]
        t = (at - x[k]) / width
        left, right = (tangent[k + end] * width for end in (0, 1))
        low, climb = y[k], rise[k]
        curved = (1 - t) * (left - climb) - t * (right - climb)
        return slope * jnp.exp(low + t * climb + t * (1 - t) * curved)


@dataclasses.dataclass(frozen=True)
class SlopeStatistics:
    """Statistics of a map's slopes from central differences.

    Parameters
    ----------
    variance
        Variance of the slope along one axis, averaged over the axes.
    variance_twice_as_coarse
        The same from every second height; if it is much smaller, the pitch does not resolve all slopes.
    bandwidth_per_um
        Spatial frequency at which the differences give 2/pi of a slope, 1/(4 pitch) of the coarser axis.
    anisotropy
        Ratio of the larger to the smaller slope variance along the axes; 1 for a profile.
    """

    variance: float
    variance_twice_as_coarse: float
    bandwidth_per_um: float
    anisotropy: float


@dataclasses.dataclass(frozen=True, eq=False, init=False)
class HeightMap:
    """Measured heights of an isotropic surface; mean and tilt are removed.

    Parameters
    ----------
    heights_um
        Shape ``(rows, columns)``, or ``(points,)`` for a profile.
    pitch_um
        Distance between neighbouring heights along y (rows) and along x (columns); one number for both.
    """

    heights_um: Float[np.ndarray, "..."]
    pitch_um: tuple[float, ...]

    def __init__(self, heights_um: Real[np.ndarray, "..."], pitch_um: float | tuple[float, ...]):
        heights = np.array(heights_um, float)
        if heights.ndim not in (1, 2) or min(heights.shape) < _FEWEST_HEIGHTS:
            raise InputRefusedError(
                f"heights_um has shape {heights.shape}; it must have two axes (a map) or one (a profile) of "
                f"at least {_FEWEST_HEIGHTS} heights each."
            )
        if not np.all(np.isfinite(heights)):
            where = tuple(int(k) for k in np.argwhere(~np.isfinite(heights))[0])
            raise InputRefusedError(
                f"heights_um is not a finite number at {where}; fill in the height, or crop the map there."
            )
        if np.abs(heights).max() > _LARGEST_HEIGHT_UM:
            raise InputRefusedError(
                f"heights_um has a height of {np.abs(heights).max():g} um; heights must be at most "
                f"{_LARGEST_HEIGHT_UM:g} um."
            )
        pitch = np.broadcast_to(np.asarray(pitch_um, float), heights.ndim)
        if not np.all((pitch > 0) & np.isfinite(pitch)):
            raise InputRefusedError(f"pitch_um is {pitch_um}; it must be above 0.")
        axes = np.meshgrid(*(np.linspace(-1, 1, n) for n in heights.shape), indexing="ij")
        plane = np.stack([np.ones(heights.size), *(axis.ravel() for axis in axes)], axis=1)
        tilt = plane @ np.linalg.lstsq(plane, heights.ravel(), rcond=None)[0]
        heights = heights - tilt.reshape(heights.shape)
        heights.setflags(write=False)
        object.__setattr__(self, "heights_um", heights)
        object.__setattr__(self, "pitch_um", tuple(float(p) for p in pitch))

    @property
    def is_profile(self) -> bool:
        """Whether heights were measured along one line only."""
        return self.heights_um.ndim == 1

    @property
    def height_variance_um2(self) -> float:
        """Mean squared height about the plane."""
        return float(np.mean(self.heights_um**2))

    def _slopes(self, every: int = 1) -> list[np.ndarray]:
        """Central differences of every n-th height along each axis, at the same inner points."""
        heights = self.heights_um[(slice(None, None, every),) * self.heights_um.ndim]
        found = []
        for axis, pitch in enumerate(self.pitch_um):
            inner = [slice(1, -1)] * heights.ndim
            ahead, behind = list(inner), list(inner)
            ahead[axis], behind[axis] = slice(2, None), slice(None, -2)
            found.append((heights[tuple(ahead)] - heights[tuple(behind)]) / (2 * every * pitch))
        return found

    def slope_statistics(self) -> SlopeStatistics:
        """Slope variance, and how well the pitch resolves it.

        Warns
        -----
        UserWarning
            If the variance at the pitch is more than 15 per cent above that at twice the pitch.
        """
        each = [float(np.mean(s**2)) for s in self._slopes()]
        fine, coarse = float(np.mean(each)), float(np.mean([np.mean(s**2) for s in self._slopes(every=2)]))
        if fine > _MOST_GROWTH * coarse:
            warnings.warn(
                f"the slope variance of the height map is {fine:.3g} at its pitch but {coarse:.3g} at twice "
                "the pitch, so the pitch does not resolve the slopes, or the heights are noisy; measure with "
                "a smaller pitch.",
                stacklevel=2,
            )
        bandwidth = 1 / (4 * max(self.pitch_um))
        return SlopeStatistics(fine, coarse, bandwidth, max(each) / max(min(each), 1e-300))

    def slope_density(self) -> TabulatedSlopes:
        """Density of the facets' slopes over all azimuths, up to the slope that 1e-4 of the facets exceed.

        Raises
        ------
        InputRefusedError
            For a profile, which has slopes along one direction only, and for a flat map.

        Warns
        -----
        UserWarning
            As `slope_statistics`.
        """
        require_float64()
        if self.is_profile:
            raise InputRefusedError(
                "heights_um is a profile, which has slopes along one direction only; use a map, or the "
                "Beckmann density with the variance of slope_statistics."
            )
        self.slope_statistics()
        slope = np.sqrt(sum(s**2 for s in self._slopes())).ravel()
        largest = np.quantile(slope, 1 - _STEEPEST)
        if largest <= 0:
            raise InputRefusedError("heights_um is flat; a slope density needs a map with slopes.")
        fine = np.linspace(0, largest, _SLOPE_BINS + 1)
        counts = np.histogram(slope, fine)[0]
        ends_of_bins, held = [0.0], 0
        for count, end in zip(counts, fine[1:], strict=True):
            held += count
            if held >= _FEWEST_PER_BIN:
                ends_of_bins.append(end)
                held = 0
        # The remainder is added to the last bin.
        edges = np.array([*ends_of_bins[:-1], largest])
        areas = np.pi * np.diff(edges**2)
        density = np.histogram(slope, edges)[0] / areas
        # The mean over a ring belongs to its centre in area, not in slope.
        centres = np.sqrt((edges[1:] ** 2 + edges[:-1] ** 2) / 2)
        logarithm = np.log(density)
        ends = np.interp([0.0, largest], centres, logarithm)
        ends += [
            (logarithm[0] - logarithm[1]) / (centres[1] ** 2 - centres[0] ** 2) * centres[0] ** 2,
            (logarithm[-1] - logarithm[-2]) / (centres[-1] - centres[-2]) * (largest - centres[-1]),
        ]
        nodes = np.concatenate([[0.0], centres, [largest]])
        logarithms = np.concatenate([ends[:1], logarithm, ends[1:]])
        return TabulatedSlopes(jnp.asarray(1.0), jnp.asarray(nodes), jnp.asarray(logarithms))

    def power_spectrum(self) -> TabulatedSpectrum:
        """Isotropic power spectral density, from the inverse extent to half the sampling rate.

        Its nodes are means over rings of frequencies, six per octave. For a profile there are two per octave,
        by `isotropic_from_profile`: valid for an isotropic surface, up to about half the highest frequency,
        if the profile is thousands of correlation lengths long; a shorter one is too noisy. The result is
        then 5 per cent too high, and up to several times too high where the spectrum is flat, towards
        frequency 0, because only positive noise is kept there.
        """
        frequency, density = self._periodogram()
        lowest, highest = frequency[frequency > 0].min(), 1 / (2 * max(self.pitch_um))
        per_octave = _BINS_OF_PROFILE if self.is_profile else _BINS_PER_OCTAVE
        n_bins = int(np.ceil(per_octave * np.log2(highest / lowest)))
        edges = np.geomspace(lowest / 2 ** (0.5 / per_octave), highest, n_bins + 1)
        position = np.digitize(frequency.ravel(), edges) - 1
        kept = (position >= 0) & (position < n_bins)
        position, at, values = position[kept], frequency.ravel()[kept], density.ravel()[kept]
        counts = np.bincount(position, minlength=n_bins)
        full = counts > 0
        nodes, means = (
            np.bincount(position, weights=w, minlength=n_bins)[full] / counts[full] for w in (at, values)
        )
        if self.is_profile:
            nodes, means = isotropic_from_profile(nodes, means)
        return tabulated_spectrum(nodes, np.maximum(means, 1e-12 * means.max()))

    def _periodogram(self):
        """Frequencies and two-sided density of the map, tapered by Hann windows."""
        heights, window = self.heights_um, np.ones(())
        for n in heights.shape:
            window = np.multiply.outer(window, np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2)
        heights = heights - np.sum(window * heights) / np.sum(window)
        density = np.abs(np.fft.fftn(window * heights)) ** 2
        density *= np.prod(self.pitch_um) / (heights.size * np.mean(window**2))
        axes = [np.fft.fftfreq(n, p) for n, p in zip(heights.shape, self.pitch_um, strict=True)]
        squared = sum(axis**2 for axis in np.meshgrid(*axes, indexing="ij"))
        return np.sqrt(squared), density
