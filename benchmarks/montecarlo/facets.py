"""Rays at one rough interface by Monte Carlo.

Nothing here imports jaxink: the same physics is written down a second time, with another method.

The interface consists of facets with isotropic slopes s = tan(theta_n) of density P(s) per unit area of the
mean plane. A ray that runs along -i meets a facet of normal m with the density P(s) (i.m)+ / m_z, normalised:
the integral is cos(theta) (1 + Lambda) for a ray that comes towards the plane and |cos(theta)| Lambda for
one that runs away. At the facet it is reflected with the Fresnel probability (mean of s and p, no
polarisation carried along) or refracted. It then leaves with the probability G1 = 1 / (1 + Lambda) if it runs
away from the interface; otherwise, or if it does not leave, it meets another facet. Facets are uncorrelated:
nothing but the direction is remembered. Energy is conserved and reciprocity holds to every order.

With w(mu) = E[(p - mu)+] of the slope p along one axis, Lambda = w(cot theta) / cot theta.

Axes: z points down, into the second medium; "above" is the medium of negative z.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

N_BATCHES = 20
# The steepest facet of the density that has to be cut, 80 degrees.
CUT_SLOPE = np.tan(np.deg2rad(80.0))


def _cauchy(s, t):
    norm = np.pi * t**2 * (-np.log(t**2) / (1 - t**2) ** 2 - 1 / (1 - t**2))
    return 1 / (norm * (1 + s**2) ** 2 * (1 + (s / t) ** 2))


def _cauchy_angle(s, t):
    # The density of the angle is finite at 0, so that of the slopes has an integrable pole.
    return 2 * (1 + t) / (np.pi * t) / (2 * np.pi * s * (1 + s**2) * (1 + (s / t) ** 2))


def _cauchy2d(s, t):
    norm = 2 * np.pi * (1 / t - 1 / np.hypot(t, CUT_SLOPE))
    return np.where(s <= CUT_SLOPE, (s**2 + t**2) ** -1.5 / norm, 0.0)


def _beckmann(s, t):
    return np.exp(-(s**2) / (2 * t**2)) / (2 * np.pi * t**2)


def _ggx(s, t):
    return t**2 / (np.pi * (t**2 + s**2) ** 2)


DENSITIES: dict[str, Callable] = {
    "cauchy": _cauchy,
    "cauchy_angle": _cauchy_angle,
    "cauchy2d": _cauchy2d,
    "beckmann": _beckmann,
    "ggx": _ggx,
}


class Facets:
    """Isotropic slope density of a rough interface, with the tables to draw from it.

    Parameters
    ----------
    kind
        A key of `DENSITIES`.
    scale
        t = tan(sigma), the scale of the slopes.
    """

    def __init__(self, kind: str, scale: float):
        self.kind, self.scale = kind, float(scale)
        self.steepest = CUT_SLOPE if kind == "cauchy2d" else 1e6
        slopes = np.geomspace(1e-7 * scale, self.steepest, 40001)
        density = self.density(slopes)
        # Parts of E[1] and E[s] of slopes steeper than each; the ring below the first is flat.
        self._slopes = np.concatenate([[0.0], slopes])
        self._steeper = [self._tail(2 * np.pi * density * slopes ** (k + 2), slopes) for k in (0, 1)]
        self.norm, self.mean_slope = self._steeper[0][0], self._steeper[1][0]
        self._log_cot = np.linspace(np.log(1e-8), np.log(1e4), 20001)
        coarse = np.linspace(self._log_cot[0], self._log_cot[-1], 801)
        self._excess = CubicSpline(coarse, [self._mean_excess(np.exp(x)) for x in coarse])(self._log_cot)

    def density(self, slope):
        """P(s), per unit of both slopes."""
        return DENSITIES[self.kind](slope, self.scale)

    @staticmethod
    def _tail(per_log_slope, slopes):
        step = np.log(slopes[1] / slopes[0])
        parts = 0.5 * step * (per_log_slope[1:] + per_log_slope[:-1])
        beyond = np.concatenate([np.cumsum(parts[::-1])[::-1], [0.0]])
        return np.concatenate([[beyond[0]], beyond])

    def _mean_excess(self, mu):
        """E[(p - mu)+] by Gauss-Legendre panels in log(s - mu); the azimuth is integrated by hand."""
        if mu >= self.steepest:
            return 0.0
        nodes, weights = np.polynomial.legendre.leggauss(12)
        edges = np.linspace(np.log(1e-9 * max(mu, self.scale)), np.log(self.steepest - mu), 81)
        half = 0.5 * np.diff(edges)[:, None]
        above = np.exp(edges[:-1, None] + half * (1 + nodes))
        slope = mu + above
        azimuth = np.arctan2(np.sqrt(above * (slope + mu)), mu)
        over_azimuth = 2 * (slope * np.sin(azimuth) - mu * azimuth)
        return np.sum(half * weights * above * self.density(slope) * slope * over_azimuth)

    def excess(self, cosine, sine):
        """sin(theta) w(|cot theta|), that is |cos theta| Lambda."""
        cot = np.abs(cosine) / np.maximum(sine, 1e-300)
        return sine * np.interp(np.log(np.maximum(cot, 1e-300)), self._log_cot, self._excess)

    def escape(self, cosine, sine):
        """Probability G1 that a ray with this cosine away from the interface leaves."""
        away = np.maximum(cosine, 0.0)
        return away / (away + self.excess(cosine, sine) + 1e-300)

    def visible(self, cosine, sine, random):
        """Draw slopes along and across the ray with density P(s) (cosine + p sine)+, by rejection.

        Towards the plane (cosine > 0) proposals have the density P(s) (cosine + s sine), a mixture of two
        radial tables with azimuth uniform: at least one in pi is taken. Away from it they have s P(s) beyond
        the least slope that is seen, azimuth uniform over what is seen.
        """
        along, across = np.empty_like(cosine), np.empty_like(cosine)
        least = np.where(cosine < 0, -cosine / np.maximum(sine, 1e-300), 0.0)
        by_slope = sine * self.mean_slope
        pending = np.arange(cosine.size)
        while pending.size:
            c, s, low = cosine[pending], sine[pending], least[pending]
            away = c <= 0
            u = random.random((4, pending.size))
            steep = away | (u[0] * (c + by_slope[pending]) >= c)
            slope = np.where(steep, self._draw(1, u[1], low), self._draw(0, u[1], low))
            seen = np.where(away, np.arccos(np.minimum(low / np.maximum(slope, 1e-300), 1.0)), np.pi)
            azimuth = seen * (2 * u[2] - 1)
            weight = c + slope * np.cos(azimuth) * s
            full = np.where(away, np.pi / 2 / np.maximum(seen, 1e-300) * slope * s, c + slope * s)
            taken = u[3] * full < weight
            done = pending[taken]
            along[done] = (slope * np.cos(azimuth))[taken]
            across[done] = (slope * np.sin(azimuth))[taken]
            pending = pending[~taken]
        return along, across

    def _draw(self, power, u, least):
        """Slope beyond ``least`` with density s^power P(s) 2 pi s, by the inverse of its table."""
        tail = self._steeper[power]
        if np.any(least > 0):
            u = u * np.interp(least, self._slopes, tail) / tail[0]
        return np.interp(u * tail[0], tail[::-1], self._slopes[::-1])


def fresnel(index_from, index_to, cosine):
    """Reflectance, mean of s and p, and cosine of the refracted ray; total reflection gives 1 and 0."""
    squared = 1 - (index_from / index_to) ** 2 * (1 - cosine**2)
    refracted = np.sqrt(np.maximum(squared, 0.0))
    s = (index_from * cosine - index_to * refracted) / (index_from * cosine + index_to * refracted)
    p = (index_to * cosine - index_from * refracted) / (index_to * cosine + index_from * refracted)
    return np.where(squared > 0, 0.5 * (s**2 + p**2), 1.0), refracted


def reflected_ray(direction, normal, cosine):
    """Direction after reflection; ``normal`` faces the ray, ``cosine`` is positive."""
    return direction + 2 * cosine * normal


def refracted_ray(direction, normal, cosine, refracted, ratio):
    """Direction after refraction; ``ratio`` is the index it comes from over the one it goes to."""
    return ratio * direction + (ratio * cosine - refracted) * normal


def meet_facet(direction, above, facets, random):
    """Normal of the facet that each ray meets, towards the ray, and its cosine with the ray."""
    up = np.where(above, -1.0, 1.0)
    sine = np.hypot(direction[0], direction[1])
    cosine = -direction[2] * up
    along, across = facets.visible(cosine, sine, random)
    safe = np.maximum(sine, 1e-300)
    e_x, e_y = np.where(sine > 0, -direction[0] / safe, 1.0), -direction[1] / safe
    norm = 1 / np.sqrt(1 + along**2 + across**2)
    normal = norm * np.stack([along * e_x - across * e_y, along * e_y + across * e_x, up])
    return normal, (cosine + along * sine) * norm


def leaves(direction, above, facets, random):
    """Whether each ray leaves the interface."""
    away = direction[2] * np.where(above, -1.0, 1.0)
    return random.random(above.size) < facets.escape(away, np.hypot(direction[0], direction[1]))


def cross(direction, above, indices, facets, random, on_facet=None):
    """Follow rays from facet to facet until all have left a rough interface.

    Parameters
    ----------
    direction, above
        Unit vectors (3, n) of rays that are about to meet a facet, and whether they are above.
    indices
        Refractive indices above and below.
    facets
        The interface.
    random
        Generator.
    on_facet
        Called as ``on_facet(which, direction, above)`` before each event.

    Returns
    -------
    direction, above, events
        Of the rays that left; number of facets that each met.
    """
    direction, above = direction.copy(), above.copy()
    events = np.zeros(above.size, int)
    active = np.arange(above.size)
    while active.size:
        ray, side = direction[:, active], above[active]
        if on_facet is not None:
            on_facet(active, ray, side)
        normal, cosine = meet_facet(ray, side, facets, random)
        index_from, index_to = np.where(side, indices[0], indices[1]), np.where(side, indices[1], indices[0])
        reflectance, refracted = fresnel(index_from, index_to, cosine)
        reflect = random.random(side.size) < reflectance
        through = refracted_ray(ray, normal, cosine, refracted, index_from / index_to)
        ray = np.where(reflect, reflected_ray(ray, normal, cosine), through)
        side = side == reflect
        direction[:, active], above[active] = ray, side
        events[active] += 1
        active = active[~leaves(ray, side, facets, random)]
    return direction, above, events
