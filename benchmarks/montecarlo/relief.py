"""Light in an opaque body whose surface is a random relief, by Monte Carlo.

The surface is a Gaussian process with a Gaussian correlation function, periodic, bilinear between the points
of a grid; each batch of photons has another one. Below it is a medium that scatters, above it is air. Rays
are followed on both sides until they meet the surface or scatter, so that shadows, light between slopes and
paths through thin ridges need no model. The unit of length is the distance between two scatterings.

Axes: z points up, away from the body; x along the incidence, so that azimuth 0 is the specular side.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.montecarlo.facets import N_BATCHES, fresnel, reflected_ray, refracted_ray
from benchmarks.montecarlo.photons import ROULETTE_SURVIVAL, ROULETTE_WEIGHT, turned
from benchmarks.montecarlo.sample import HenyeyGreenstein

# Points of the grid along one side, and along one correlation length.
N_GRID, N_IN_CORRELATION = 384, 12
BISECTIONS = 12
# Shortest step of a ray along the surface, in distances of the grid.
LEAST_STEP = 2e-3


@dataclass(frozen=True)
class Body:
    """The medium, and statistics of its surface.

    Parameters
    ----------
    phase
        Phase function.
    albedo
        Of one scattering.
    slope_variance
        Along each axis.
    correlation_length
        Distance at which the correlation of heights is 1/e, in distances between two scatterings.
    index
        Refractive index of the medium; 1 has no reflection.
    """

    phase: HenyeyGreenstein
    albedo: float
    slope_variance: float
    correlation_length: float
    index: float = 1.0


class Surface:
    """One realisation of the relief."""

    def __init__(self, body: Body, random):
        self.spacing = body.correlation_length / N_IN_CORRELATION
        frequency = 2 * np.pi * np.fft.fftfreq(N_GRID)
        squared = frequency[:, None] ** 2 + frequency**2
        # The spectrum of a Gaussian correlation is the square of this filter.
        spectrum = np.fft.fft2(random.standard_normal((N_GRID, N_GRID)))
        height = np.fft.ifft2(spectrum * np.exp(-squared * N_IN_CORRELATION**2 / 8)).real
        slopes = [np.roll(height, -1, axis) - height for axis in (0, 1)]
        height *= np.sqrt(body.slope_variance / np.mean(np.square(slopes)))
        self._height = (height - height.mean()) * self.spacing
        # Two slopes along the edges of one cell bound the slope within it.
        self.steepest = np.hypot(*(np.abs(s).max() for s in slopes)) * np.sqrt(
            body.slope_variance / np.mean(np.square(slopes))
        )
        self.top = self._height.max() + 1e-6 * self.spacing

    @property
    def period(self):
        """Length after which the surface repeats."""
        return N_GRID * self.spacing

    def _cell(self, x, y):
        u, v = x / self.spacing, y / self.spacing
        i, j = np.floor(u).astype(int), np.floor(v).astype(int)
        u, v, i, j = u - i, v - j, i % N_GRID, j % N_GRID
        flat, right, up = self._height.ravel(), (i + 1) % N_GRID, (j + 1) % N_GRID
        corners = (
            flat[i * N_GRID + j],
            flat[right * N_GRID + j],
            flat[i * N_GRID + up],
            flat[right * N_GRID + up],
        )
        return u, v, corners

    def height(self, x, y):
        """Height above the mean plane."""
        u, v, (a, b, c, d) = self._cell(x, y)
        lower, upper = a + u * (b - a), c + u * (d - c)
        return lower + v * (upper - lower)

    def normal(self, x, y):
        """Unit normal, upwards."""
        u, v, (a, b, c, d) = self._cell(x, y)
        along_x = ((1 - v) * (b - a) + v * (d - c)) / self.spacing
        along_y = ((1 - u) * (c - a) + u * (d - b)) / self.spacing
        return np.stack([-along_x, -along_y, np.ones_like(u)]) / np.sqrt(1 + along_x**2 + along_y**2)

    def above(self, place):
        """Distance above the surface along z."""
        return place[2] - self.height(place[0], place[1])

    def meeting(self, near, far, side):
        """Two places close to each other, the surface between them."""
        for _ in range(BISECTIONS):
            middle = (near + far) / 2
            outside = side * self.above(middle) >= 0
            near, far = np.where(outside, middle, near), np.where(outside, far, middle)
        return near, far


def reflected(body: Body, theta_deg, n_photons, ring_edges, seed=0):
    """BSDF averaged over bins, and the power reflected.

    Parameters
    ----------
    body
        The body.
    theta_deg
        Incidence.
    n_photons
        Photons, a multiple of 20.
    ring_edges
        Edges of the bins in degrees: of theta, and of the azimuth from the specular side, 0 to 180.
    seed
        Of the generator.

    Returns
    -------
    rings, power
        Mean BSDF in 1/sr, shape (theta, azimuth, batches), and share of the power, shape (batches,).
    """
    edges = [np.deg2rad(np.asarray(e, float)) for e in ring_edges]
    etendue = np.diff(np.sin(edges[0]) ** 2)[:, None] * np.diff(edges[1])
    in_batch = n_photons // N_BATCHES
    rings, power = [], []
    for batch in range(N_BATCHES):
        random = np.random.default_rng([seed, batch])
        direction, weight = _leaving(body, Surface(body, random), theta_deg, in_batch, random)
        theta = np.arctan2(np.hypot(direction[0], direction[1]), direction[2])
        azimuth = np.abs(np.arctan2(direction[1], direction[0]))
        counted, *_ = np.histogram2d(theta, azimuth, edges, weights=weight)
        rings.append(counted / (in_batch * etendue))
        power.append(weight.sum() / in_batch)
    return np.stack(rings, axis=-1), np.array(power)


class _Photons:
    """Photons alive; ``side`` is 1 in air and -1 in the body, ``rest`` the length to the next scattering."""

    def __init__(self, surface, theta_deg, n, random):
        theta = np.deg2rad(theta_deg)
        self.direction = np.repeat([[np.sin(theta)], [0.0], [-np.cos(theta)]], n, axis=1)
        self.place = np.stack([*surface.period * random.random((2, n)), np.full(n, surface.top)])
        self.side, self.weight, self.rest = np.ones(n), np.ones(n), np.full(n, np.inf)

    def keep(self, alive):
        """Forget all others."""
        for name, array in vars(self).items():
            setattr(self, name, array[..., alive])


def _leaving(body, surface, theta_deg, n, random):
    """Directions and weights of all photons that leave."""
    photons, found = _Photons(surface, theta_deg, n, random), []
    while photons.side.size:
        # A step that no surface of these slopes can end, or one that is too short to pass over anything.
        across, up = np.hypot(photons.direction[0], photons.direction[1]), photons.direction[2]
        closing = surface.steepest * across - photons.side * up
        gap = np.maximum(photons.side * surface.above(photons.place), 0.0)
        safe = np.where(closing > 0, gap / np.where(closing > 0, closing, 1.0), np.inf)
        step = np.minimum(np.maximum(safe, LEAST_STEP * surface.spacing), photons.rest)
        left = (photons.side > 0) & (np.isinf(step) | ((photons.place[2] > surface.top) & (up > 0)))
        found.append((photons.direction[:, left], photons.weight[left]))
        step[left] = 0.0
        there = photons.place + step * photons.direction
        near = np.flatnonzero(~left & (step > safe))
        met = near[photons.side[near] * surface.above(there[:, near]) < 0]
        scattered = np.flatnonzero(~left & (step >= photons.rest))
        photons.rest -= step
        before = photons.place[:, met]
        photons.place = there
        _meet(body, surface, photons, met, before, random)
        _scatter(body, photons, np.setdiff1d(scattered, met, assume_unique=True), random)
        light = photons.weight < ROULETTE_WEIGHT
        survives = random.random(light.size) < ROULETTE_SURVIVAL
        photons.weight[light] /= ROULETTE_SURVIVAL
        if left.any() or light.any():
            photons.keep(~left & (~light | survives))
    return np.concatenate([d for d, _ in found], axis=1), np.concatenate([w for _, w in found])


def _scatter(body, photons, at, random):
    photons.weight[at] *= body.albedo
    cosine = body.phase.draw(at.size, random)
    photons.direction[:, at] = turned(photons.direction[:, at], cosine, random)
    photons.rest[at] = random.standard_exponential(at.size)


def _meet(body, surface, photons, at, before, random):
    """Reflect or refract the photons that have met the surface on their last step."""
    if not at.size:
        return
    near, far = surface.meeting(before, photons.place[:, at], photons.side[at])
    direction, passes = _cross(surface, near, photons.direction[:, at], photons.side[at], body.index, random)
    photons.direction[:, at] = direction
    photons.place[:, at] = np.where(passes, far, near)
    photons.side[at] = np.where(passes, -photons.side[at], photons.side[at])
    # The exponential law has no memory, so a new length may begin anywhere.
    photons.rest[at] = np.where(photons.side[at] > 0, np.inf, random.standard_exponential(at.size))


def _cross(surface, place, direction, side, index, random):
    """New directions of rays that meet the surface, and whether they pass through it."""
    if index == 1.0:
        return direction, np.ones(side.size, bool)
    normal = surface.normal(place[0], place[1]) * side
    cosine = np.maximum(-np.sum(normal * direction, axis=0), 1e-12)
    index_from, index_to = np.where(side > 0, 1.0, index), np.where(side > 0, index, 1.0)
    reflectance, refracted = fresnel(index_from, index_to, cosine)
    passes = random.random(side.size) >= reflectance
    through = refracted_ray(direction, normal, cosine, refracted, index_from / index_to)
    return np.where(passes, through, reflected_ray(direction, normal, cosine)), passes
