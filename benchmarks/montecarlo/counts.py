"""What leaves a sample, by batches of photons: powers, rings, and the BSDF at detectors."""

from dataclasses import dataclass

import numpy as np

from benchmarks.montecarlo.facets import N_BATCHES

REGULAR, SURFACE, DIFFUSE = range(3)


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


class Counts:
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
        """Weights to a power."""
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
