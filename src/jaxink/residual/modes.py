"""Smooth modes of a BSDF's relative change: functions of two directions that are isotropic and reciprocal.

The radial parts are Zernike polynomials on the disc of projected solid angle, whose radius is sin(theta).
Every mode is 1 where both directions graze and point to the source's azimuth, so its amplitude is a relative
change there.

References
----------
Koenderink, van Doorn 1998 JOSA A 15, 2903 (with the radius sqrt(2) sin(theta / 2)).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import factorial

import numpy as np
from jaxtyping import Float
from numpy.polynomial import legendre

from jaxink.residual.points import ResidualPoints

# Highest order of the radial polynomials: structure finer than about 30 degrees is left out.
MOST_ORDER = 6


@dataclass(frozen=True)
class Mode:
    """One mode on one side.

    Parameters
    ----------
    side
        ``"R"`` or ``"T"``.
    n, m
        Orders in the polar angles of incidence and view. In reflection the mode is symmetric in both; in
        transmission, where the exchanged light path enters by the other face, it is not.
    azimuthal_order
        l of cos(l phi); None for data in the plane of incidence, where n and m are orders of
        Legendre polynomials of the signed sines.
    """

    side: str
    n: int
    m: int
    azimuthal_order: int | None

    @property
    def order(self) -> int:
        """The larger of both orders."""
        return max(self.n, self.m)

    def values(self, points: ResidualPoints) -> Float[np.ndarray, " points"]:
        """The mode at each point; 0 on the other side, and out of the plane for a mode in the plane."""
        mode = self._in_plane if self.azimuthal_order is None else self._out_of_plane
        return np.where(points.of_side(self.side), mode(points), 0.0)

    def _symmetric(self, function, of_i, of_o):
        product = function(self.n, of_i) * function(self.m, of_o)
        if self.side == "T" or self.n == self.m:
            return product
        return (product + function(self.m, of_i) * function(self.n, of_o)) / 2

    def _out_of_plane(self, points: ResidualPoints):
        order = self.azimuthal_order
        assert order is not None
        sines = (np.sin(np.deg2rad(angle)) for angle in (points.theta_i_deg, points.theta_o_deg))
        radial = self._symmetric(lambda n, x: zernike_radial(n, order, x), *sines)
        return radial * np.cos(order * np.deg2rad(points.phi_deg))

    def _in_plane(self, points: ResidualPoints):
        sines = np.sin(np.deg2rad(points.theta_i_deg)), signed_sine(points)
        values = self._symmetric(lambda n, x: legendre.legval(x, np.eye(n + 1)[n]), *sines)
        return np.where(points.near_plane, values, 0.0)


def signed_sine(points: ResidualPoints) -> Float[np.ndarray, " points"]:
    """Sine of the polar angle of view in the plane of incidence, positive in the source's half-plane."""
    return np.sin(np.deg2rad(points.theta_o_deg)) * np.cos(np.deg2rad(points.phi_deg))


def zernike_radial(n: int, order: int, radius: Float[np.ndarray, " *any"]) -> Float[np.ndarray, " *any"]:
    """Zernike's radial polynomial R_n^l, which is 1 at the rim."""
    total = np.zeros_like(radius)
    for k in range((n - order) // 2 + 1):
        upper, lower = (n + order) // 2 - k, (n - order) // 2 - k
        share = factorial(n - k) / (factorial(k) * factorial(upper) * factorial(lower))
        total = total + (-1) ** k * share * radius ** (n - 2 * k)
    return total


def modes_for(points: ResidualPoints, most_order: int = MOST_ORDER) -> tuple[Mode, ...]:
    """All modes of both sides up to an order, the lowest orders first."""
    found: list[Mode] = []
    for side in ("R", "T"):
        if np.any(points.of_side(side)):
            found += _in_plane(side, most_order) if points.is_in_plane(side) else _discs(side, most_order)
    return tuple(sorted(found, key=lambda mode: (mode.order, mode.n + mode.m, mode.azimuthal_order or 0)))


def _in_plane(side: str, most: int) -> Iterator[Mode]:
    # Mirrored in the normal, both signs change: n + m is even.
    for n, m in _pairs(side, range(most + 1)):
        if (n + m) % 2 == 0:
            yield Mode(side, n, m, None)


def _discs(side: str, most: int) -> Iterator[Mode]:
    for order in range(most + 1):
        for n, m in _pairs(side, range(order, most + 1, 2)):
            yield Mode(side, n, m, order)


def _pairs(side: str, orders: range) -> Iterator[tuple[int, int]]:
    for n in orders:
        for m in orders:
            if side == "T" or m <= n:
                yield n, m
