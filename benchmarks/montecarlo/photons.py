"""Light in a stack of plane layers by Monte Carlo, apart from the solver: photons, smooth and rough faces.

Nothing here imports jaxink. Unpolarised light, Fresnel coefficients averaged over s and p at each face, no
polarisation and no interference carried along. Rough faces: `facets`.

Estimators, all unbiased:

* Totals and rings count photons that leave, each with its weight. Weights decrease by absorption along the
  path; light ones end by roulette.
* At given directions, next-event estimation (`events`). Every scattering, every facet of a rough
  face and every reflection by the backing adds the power that it sends to each detector without a further
  such event: the phase function (or the density of the facet that turns the ray into the right direction,
  times G1), times what the smooth faces between that event and the detector transmit, all their multiple
  reflections summed. It never holds light that met no such event: regular peaks are apart.

Standard errors: 20 batches of photons. All directions share the photons, so that their errors are correlated.

Axes: z down along the incidence, x in its plane; phi 180 is the specular side, as in the measurements.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.montecarlo.events import NextEvents
from benchmarks.montecarlo.facets import N_BATCHES, cross, fresnel
from benchmarks.montecarlo.sample import Detectors, sample_from

REGULAR, SURFACE, DIFFUSE = range(3)
ROULETTE_WEIGHT, ROULETTE_SURVIVAL = 1e-3, 0.1
MOST_STEPS = 200_000


@dataclass(frozen=True)
class Result:
    """Batches of all that was counted, the last axis of each array.

    ``powers``: by name, share of the incident power; R and T are divided into ``_regular`` (neither scattered
    nor turned by a facet), ``_surface`` (facets only) and ``_diffuse``. ``bsdf``: at the detectors, 1/sr.
    ``rings``: mean BSDF, without the regular light, over bins (side, theta, azimuth from the specular side,
    folded) and weighted by cos(theta) dOmega, 1/sr.
    """

    powers: dict[str, np.ndarray]
    bsdf: np.ndarray | None
    rings: np.ndarray | None

    @staticmethod
    def mean_and_error(batches):
        """Mean and standard error over the batches."""
        return batches.mean(-1), batches.std(-1, ddof=1) / N_BATCHES**0.5


class _Photons:
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
        for name, array in vars(self).items():
            setattr(self, name, array[..., alive])


def simulate(sample, theta_deg, n_photons, seed=0, detectors=None, ring_edges=None):
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

    Returns
    -------
    Result

    Raises
    ------
    ValueError
        Detectors with a radius that is seen: next events sum over all places of exit.
    RuntimeError
        Photons that never end.
    """
    if detectors is not None and sample.seen_radius_mm is not None:
        raise ValueError("detectors need seen_radius_mm = None; use ring_edges where only a disc is seen.")
    random = np.random.default_rng(seed)
    in_batch = n_photons // N_BATCHES
    photons = _Photons(sample, theta_deg, N_BATCHES * in_batch, random)
    events = None if detectors is None else NextEvents(sample, detectors)
    counts = _Counts(ring_edges, sample.axis_offset(theta_deg))
    for _ in range(MOST_STEPS):
        _pass_faces(sample, photons, events, random)
        counts.leave(sample, photons, events, random)
        if not photons.weight.size:
            return counts.result(events, in_batch)
        _travel(sample, photons, counts, events, random)
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


class _Counts:
    """What has left, by batch."""

    def __init__(self, ring_edges, axis_offset):
        self.axis_offset = axis_offset
        names = [f"{side}_{kind}" for side in "RT" for kind in ("regular", "surface", "diffuse")]
        self.powers = {name: np.zeros(N_BATCHES) for name in (*names, "absorbed", "lost", "backing")}
        self.edges = None if ring_edges is None else [np.deg2rad(np.asarray(e, float)) for e in ring_edges]
        if self.edges is not None:
            self.shape = (2, len(self.edges[0]) - 1, len(self.edges[1]) - 1, N_BATCHES)
            self.rings = np.zeros(self.shape)

    def add(self, name, batch, weight):
        self.powers[name] += np.bincount(batch, weight, N_BATCHES)

    def leave(self, sample, photons, events, random):
        """Count and remove photons outside; the backing sends its share back."""
        last = len(sample.layers) + 1
        back = photons.medium == last
        if sample.backing_albedo is not None and back.any():
            self._reflect_at_backing(sample, photons, np.flatnonzero(back), events, random)
            back = np.zeros_like(back)
        out = back | (photons.medium == 0)
        if not out.any():
            return
        weight, batch, kind = photons.weight[out], photons.batch[out], photons.kind[out]
        code = np.where(back[out], 3, 0) + kind
        if sample.seen_radius_mm is not None:
            x, y = photons.place[:, out]
            unseen = np.hypot(x - np.where(back[out], self.axis_offset, 0.0), y) > sample.seen_radius_mm
            code[unseen] = 7
        for n, name in enumerate(self.powers):
            self.add(name, batch[code == n], weight[code == n])
        if self.edges is not None:
            counted = (kind != REGULAR) & (code != 7)
            self._to_rings(photons.direction[:, out][:, counted], weight[counted], batch[counted])
        photons.keep(~out)

    def _to_rings(self, direction, weight, batch):
        theta = np.arctan2(np.hypot(direction[0], direction[1]), np.abs(direction[2]))
        azimuth = np.abs(np.arctan2(direction[1], direction[0]))
        bins = [np.searchsorted(e, x) - 1 for e, x in zip(self.edges, (theta, azimuth), strict=True)]
        inside = [(b >= 0) & (b < n) for b, n in zip(bins, self.shape[1:3], strict=True)]
        use = inside[0] & inside[1]
        place = ((direction[2] > 0).astype(int), *bins, batch)
        flat = np.ravel_multi_index([p[use] for p in place], self.shape)
        self.rings += np.bincount(flat, weight[use], self.rings.size).reshape(self.shape)

    def _reflect_at_backing(self, sample, photons, at, events, random):
        albedo = sample.backing_albedo
        self.add("backing", photons.batch[at], (1 - albedo) * photons.weight[at])
        photons.weight[at] *= albedo
        if events is not None:
            events.on_backing(photons.weight[at], photons.batch[at])
        sine, turn = np.sqrt(random.random(at.size)), 2 * np.pi * random.random(at.size)
        cosine = np.sqrt(1 - sine**2)
        photons.direction[:, at] = np.stack([sine * np.cos(turn), sine * np.sin(turn), -cosine])
        photons.kind[at] = DIFFUSE
        photons.face[at] = len(sample.layers)

    def result(self, events, in_batch):
        """Batches of all counts, per photon."""
        rings = None
        if self.edges is not None:
            etendue = np.diff(np.sin(self.edges[0]) ** 2)[:, None, None] * np.diff(self.edges[1])[:, None]
            rings = self.rings / (in_batch * etendue)
        powers = {name: power / in_batch for name, power in self.powers.items()}
        return Result(powers, None if events is None else events.bsdf / in_batch, rings)


def _travel(sample, photons, counts, events, random):
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

    left = weight * np.exp(-sample.per_medium("absorption_per_mm")[medium] * path)
    counts.add("absorbed", photons.batch[inside], weight - left)
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
            photons.direction[:, at] = _turned(photons.direction[:, at], cosine, random)
            photons.kind[at] = DIFFUSE
    light = photons.weight < ROULETTE_WEIGHT
    if light.any():
        survives = random.random(light.size) < ROULETTE_SURVIVAL
        photons.weight[light] /= ROULETTE_SURVIVAL
        photons.keep(~light | survives)


def _turned(direction, cosine, random):
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


def main():
    """Print totals and the BSDF in the plane of incidence of a sample described in a JSON file."""
    parser = argparse.ArgumentParser(description="Light from a stack of layers by Monte Carlo.")
    parser.add_argument("sample", type=Path, help="JSON file with the fields of Sample")
    parser.add_argument("--theta", type=float, default=0.0, help="incidence in degrees")
    parser.add_argument("--photons", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    sample = sample_from(json.loads(arguments.sample.read_text(encoding="utf-8")))
    theta = np.arange(-80.0, 81.0, 10.0)
    sides = (False,) if sample.backing_albedo is not None else (False, True)
    side = np.repeat(sides, theta.size)
    signed = np.tile(theta, len(sides))
    detectors = Detectors(np.abs(signed), np.where(signed < 0, 0.0, 180.0), side)
    seen = sample.seen_radius_mm is not None
    result = simulate(sample, arguments.theta, arguments.photons, arguments.seed, None if seen else detectors)
    for name, batches in result.powers.items():
        print("{:12s} {:.6f} +- {:.6f}".format(name, *Result.mean_and_error(batches)))
    if result.bsdf is not None:
        for angle, far, value, error in zip(signed, side, *Result.mean_and_error(result.bsdf), strict=True):
            print(f"{'T' if far else 'R'} {angle:6.1f} deg {value:.6f} +- {error:.6f} 1/sr")


if __name__ == "__main__":
    main()
