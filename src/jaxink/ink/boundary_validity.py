"""Validity of the theory behind a boundary's table."""

import dataclasses
import math
from collections.abc import Iterator

import jax.numpy as jnp

from jaxink.ink.boundary_file import RoughBoundary
from jaxink.numerics.precision import computing
from jaxink.surfaces import LARGEST_SLOPE, HeightMap, PowerSpectrum, WaveSurface, validity

# Angles of incidence at which a surface is checked, from either side.
INCIDENCES_DEG = (0.0, 30.0, 60.0, 75.0)
# Range of each number in which the theory is valid, and the range in words.
_ANY = (-math.inf, math.inf)
_WAVES = {
    "a_sigma_reflection": (*_ANY, "any; first order alone below 0.3"),
    "a_sigma_transmission": (*_ANY, "any; first order alone below 0.3"),
    "slope": (0.0, LARGEST_SLOPE, f"below {LARGEST_SLOPE:g}"),
    "slope_over_grazing_slope": (0.0, 1.0, "below 1"),
    "height_variance_beyond": (0.0, 0.1, "below 0.1"),
    "uncovered": (0.0, 0.1, "below 0.1"),
    "power_error": (-0.01, 0.01, "within 0.01 of 0"),
}
_FACETS = {
    "a_sigma_reflection": (5.0, math.inf, "above 5"),
    "a_sigma_transmission": (5.0, math.inf, "above 5"),
    # See `HeightMap.slope_statistics`.
    "slope_growth": (0.0, 1.15, "below 1.15"),
    "anisotropy": (1.0, 1.5, "below 1.5"),
}


@dataclasses.dataclass(frozen=True)
class ValidityCheck:
    """One criterion of validity, over all wavelengths, incidences and sides.

    Parameters
    ----------
    name
        Name in `jaxink.surfaces.wave_power.validity`.
    least, largest
        Range of its values.
    asked
        Required range, in words.
    holds
        Whether the criterion is met everywhere; None if any value is valid.
    worst, where
        The worst value and the conditions at which it occurs.
    """

    name: str
    least: float
    largest: float
    asked: str
    holds: bool | None
    worst: float
    where: str


def validity_checks(boundary: RoughBoundary) -> list[ValidityCheck]:
    """Check a boundary at `INCIDENCES_DEG` from either side; empty for a slope density without heights."""
    found: dict[str, list[tuple[float, str]]] = {}
    with computing():
        spectrum = boundary.shape_at(boundary.height_scale)
        if isinstance(spectrum, PowerSpectrum):
            limits, numbers = _WAVES, _of_waves(boundary, spectrum)
        elif boundary.heights is not None:
            limits, numbers = _FACETS, _of_facets(boundary, boundary.heights)
        else:
            return []
        for name, value, where in numbers:
            found.setdefault(name, []).append((value, where))
    return [_check(name, found[name], *limit) for name, limit in limits.items()]


def _check(name, values, low: float, high: float, asked: str) -> ValidityCheck:
    each = [value for value, _ in values]
    worst, where = max(values, key=lambda pair: max(low - pair[0], pair[0] - high))
    holds = None if (low, high) == _ANY else low <= worst <= high
    return ValidityCheck(name, min(each), max(each), asked, holds, worst, where)


def _of_facets(boundary: RoughBoundary, heights: HeightMap) -> Iterator[tuple[str, float, str]]:
    """Name and value of every criterion for facets, and the conditions."""
    statistics = heights.slope_statistics()
    growth = statistics.variance / max(statistics.variance_twice_as_coarse, 1e-300)
    yield "slope_growth", growth, "from twice the pitch to the pitch"
    yield "anisotropy", statistics.anisotropy, "between the axes of the map"
    spectrum = heights.power_spectrum()
    variance = spectrum.height_variance_um2 * boundary.height_scale**2
    yield from _of_waves(boundary, dataclasses.replace(spectrum, height_variance_um2=variance))


def _of_waves(boundary: RoughBoundary, spectrum: PowerSpectrum) -> Iterator[tuple[str, float, str]]:
    """The same for wave optics."""
    media = zip(boundary.wavelengths_nm, boundary.index_inside, boundary.index_outside, strict=True)
    for wavelength_nm, inside, outside in media:
        indices = jnp.asarray(inside), jnp.asarray(outside)
        surface = WaveSurface(spectrum, *indices, jnp.asarray(wavelength_nm))
        for side, seen in (("inside", surface), ("outside", surface.reversed)):
            for theta_deg in INCIDENCES_DEG:
                found = validity(seen, math.cos(math.radians(theta_deg)))
                found["slope_over_grazing_slope"] = found["slope"] / found["grazing_slope"]
                where = f"from {side} at {theta_deg:g} degrees, {wavelength_nm:g} nm"
                yield from ((name, value, where) for name, value in found.items())
