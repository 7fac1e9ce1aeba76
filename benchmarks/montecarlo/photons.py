"""Light in a stack of plane layers by Monte Carlo, apart from the solver: photons, smooth and rough faces.

Nothing here imports jaxink. Unpolarised light, Fresnel coefficients averaged over s and p at each face, no
polarisation and no interference carried along. Rough faces: `facets`.

Estimators, all unbiased:

* Totals and rings count photons that leave, each with its weight. Weights decrease by absorption along the
  path; light ones end by roulette.
* At given directions, next-event estimation (`events`, or `seen_events` where only a disc is seen). Every
  scattering, every facet of a rough face and every reflection by the backing adds the power that it sends to
  each detector without a further such event: the phase function (or the density of the facet that turns the
  ray into the right direction, times G1), times what the smooth faces between that event and the detector
  transmit, all their multiple reflections summed. It never holds light that met no such event: regular peaks
  are apart.

Standard errors: 20 batches of photons. All directions share the photons, so that their errors are correlated.

Axes: z down along the incidence, x in its plane; phi 180 is the specular side, as in the measurements.
"""

from functools import partial

import numpy as np

from benchmarks.montecarlo.counts import DIFFUSE, REGULAR, SURFACE, Counts
from benchmarks.montecarlo.events import NextEvents
from benchmarks.montecarlo.facets import N_BATCHES, cross, fresnel
from benchmarks.montecarlo.seen_events import SeenEvents

ROULETTE_WEIGHT, ROULETTE_SURVIVAL = 1e-3, 0.1
MOST_STEPS = 200_000


class Photons:
    """Photons alive, in the order of their batches, so that batches are slices."""

    def __init__(self, sample, theta_deg, n, random):
        theta = np.deg2rad(theta_deg)
        self.direction = np.repeat([[np.sin(theta)], [0.0], [np.cos(theta)]], n, axis=1)
        radius, turn = sample.beam_radius_mm * np.sqrt(random.random(n)), 2 * np.pi * random.random(n)
        self.place = radius * np.stack([np.cos(turn) / np.cos(theta), np.sin(turn)])
        self.depth = np.zeros(n)
        self.medium = np.zeros(n, int)
        self.face = np.zeros(n, int)
        self.weight = np.ones(n)
        self.kind = np.full(n, REGULAR)
        self.batch = np.arange(n) * N_BATCHES // n

    def keep(self, alive):
        """Forget all others."""
        for name, array in vars(self).items():
            setattr(self, name, array[..., alive])


def simulate(sample, theta_deg, n_photons, seed=0, detectors=None, ring_edges=None, absorbed=None):
    """Send a wide beam onto a sample.

    Parameters
    ----------
    sample
        The sample.
    theta_deg
        Incidence in front.
    n_photons
        Photons, a multiple of 20.
    seed
        Of the generator.
    detectors
        Directions for next-event estimation; None: none.
    ring_edges
        Edges of the bins in degrees: of theta, and of the azimuth from the specular side, 0 ... 180.
    absorbed
        Collects where light is absorbed, see `Absorbed`; None: nothing does.

    Returns
    -------
    Result

    Raises
    ------
    ValueError
        Detectors with a radius that is seen, and a sample that `SeenEvents` does not describe.
    RuntimeError
        Photons that never end.
    """
    random = np.random.default_rng(seed)
    in_batch = n_photons // N_BATCHES
    photons = Photons(sample, theta_deg, N_BATCHES * in_batch, random)
    counts = Counts(ring_edges, sample.axis_offset(theta_deg))
    events = None
    if detectors is not None:
        is_seen_whole = sample.seen_radius_mm is None
        limited = partial(SeenEvents, centre_mm=counts.axis_offset)
        events = (NextEvents if is_seen_whole else limited)(sample, detectors)
    follow(sample, photons, counts, events, random, absorbed)
    return counts.result(events, in_batch)


def follow(sample, photons, counts, events, random, absorbed=None):
    """Follow photons until all have ended; the arguments are those of `simulate`, as objects."""
    for _ in range(MOST_STEPS):
        _pass_faces(sample, photons, events, random)
        counts.leave(sample, photons, events, random)
        if not photons.weight.size:
            return
        _travel(sample, photons, counts, events, random, absorbed)
    raise RuntimeError(f"{photons.weight.size} photons are alive after {MOST_STEPS} steps.")


def _pass_faces(sample, photons, events, random):
    for face in range(len(sample.layers) + 1):
        at = np.flatnonzero(photons.face == face)
        if not at.size:
            continue
        direction, above = photons.direction[:, at], photons.medium[at] == face
        indices, facets = sample.indices[face : face + 2], sample.rough(face)
        if facets is None:
            direction, above = _cross_smooth(direction, above, indices, random)
        else:
            hook = None
            if events is not None:
                weight, batch = photons.weight[at], photons.batch[at]
                hook = events.on_facet(face, weight, batch)
            direction, above, _ = cross(direction, above, indices, facets, random, hook)
            photons.kind[at] = np.maximum(photons.kind[at], SURFACE)
        photons.direction[:, at] = direction
        photons.medium[at] = np.where(above, face, face + 1)
        photons.depth[at] = np.where(above, sample.per_medium("thickness_mm")[face], 0.0)
    photons.face[:] = -1


def _cross_smooth(direction, above, indices, random):
    index_from, index_to = np.where(above, indices[0], indices[1]), np.where(above, indices[1], indices[0])
    cosine = np.abs(direction[2])
    reflectance, refracted = fresnel(index_from, index_to, cosine)
    reflect = random.random(above.size) < reflectance
    ratio = np.where(reflect, 1.0, index_from / index_to)
    vertical = np.where(reflect, -direction[2], np.copysign(refracted, direction[2]))
    return np.stack([ratio * direction[0], ratio * direction[1], vertical]), above == reflect


def _travel(sample, photons, counts, events, random, absorbed):
    """Move photons inside layers to their next scattering, or to a face."""
    inside = np.flatnonzero(photons.face < 0)
    medium, vertical = photons.medium[inside], photons.direction[2, inside]
    vertical = np.where(np.abs(vertical) < 1e-12, 1e-12, vertical)
    thickness = sample.per_medium("thickness_mm")[medium]
    depth, weight = photons.depth[inside], photons.weight[inside]
    to_face = np.where(vertical > 0, thickness - depth, -depth) / vertical
    scattering = sample.per_medium("scattering_per_mm")[medium]
    free = random.standard_exponential(inside.size) / np.maximum(scattering, 1e-300)
    hits = to_face <= free
    path = np.minimum(to_face, free)

    absorption = sample.per_medium("absorption_per_mm")[medium]
    left = weight * np.exp(-absorption * path)
    counts.add("absorbed", photons.batch[inside], weight - left)
    if absorbed is not None:
        absorbed.add(medium, photons.batch[inside], (depth, vertical, path), absorption, weight, random)
    photons.place[:, inside] += photons.direction[:2, inside] * path
    photons.depth[inside] = depth + vertical * path
    photons.weight[inside] = left
    photons.face[inside[hits]] = np.where(vertical > 0, medium, medium - 1)[hits]
    for number, layer in enumerate(sample.layers, 1):
        at = inside[~hits & (medium == number)]
        if at.size:
            if events is not None:
                events.on_scattering(number, photons, at)
            cosine = layer.phase.draw(at.size, random)
            photons.direction[:, at] = turned(photons.direction[:, at], cosine, random)
            photons.kind[at] = DIFFUSE
    light = photons.weight < ROULETTE_WEIGHT
    if light.any():
        survives = random.random(light.size) < ROULETTE_SURVIVAL
        photons.weight[light] /= ROULETTE_SURVIVAL
        photons.keep(~light | survives)


def turned(direction, cosine, random):
    """Directions after scattering by angles of these cosines, azimuth uniform."""
    sine, turn = np.sqrt(np.maximum(1 - cosine**2, 0)), 2 * np.pi * random.random(cosine.size)
    # Two unit vectors across the ray: Duff et al. 2017, J. Computer Graphics Techniques 6 (1).
    x, y, z = direction
    sign = np.copysign(1.0, z)
    a = -1 / (sign + z)
    b = x * y * a
    first = np.stack([1 + sign * x * x * a, sign * b, -sign * x])
    second = np.stack([b, sign + y * y * a, -y])
    turned = sine * (np.cos(turn) * first + np.sin(turn) * second) + cosine * direction
    return turned / np.sqrt(np.sum(turned**2, axis=0))
