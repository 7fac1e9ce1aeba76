"""Fluorescence by Monte Carlo: photons are absorbed at one wavelength and emitted there at another.

`simulate` at the exciting wavelength fills an `Absorbed` with absorbed photons; `emitted` starts one photon
isotropically at each of these places in the sample as it is at the emitted wavelength.
"""

import numpy as np

from benchmarks.montecarlo.counts import DIFFUSE, Counts
from benchmarks.montecarlo.events import NextEvents
from benchmarks.montecarlo.facets import N_BATCHES
from benchmarks.montecarlo.photons import Photons, follow
from benchmarks.montecarlo.sample import HenyeyGreenstein

_ISOTROPIC = HenyeyGreenstein(0.0)


class Absorbed:
    """Places of absorbed photons of unit weight: layer (1 is the first), depth in it in mm, and batch."""

    def __init__(self):
        self._parts = []

    def add(self, medium, batch, path, absorption, weight, random):
        """Absorption along straight paths.

        Parameters
        ----------
        medium, batch, weight
            Of the photons, before the path; a weight is at most 1.
        path
            Depth at its start, cosine with the depth axis and length.
        absorption
            Coefficient along it, 1/mm.
        random
            The generator.
        """
        depth, vertical, length = path
        share = -np.expm1(-absorption * length)
        # The expected number is that of the light absorbed; heavier photons would be split.
        chosen = np.flatnonzero(random.random(weight.size) < weight * share)
        along = -np.log1p(-random.random(chosen.size) * share[chosen]) / absorption[chosen]
        here = depth[chosen] + vertical[chosen] * along
        self._parts.append((medium[chosen], here, batch[chosen]))

    def in_layer(self, number):
        """Depths and batches of the photons absorbed in a layer, in the order of their batches."""
        medium, depth, batch = (np.concatenate(column) for column in zip(*self._parts, strict=True))
        here = np.flatnonzero(medium == number)
        here = here[np.argsort(batch[here], kind="stable")]
        return depth[here], batch[here]


def emitted(sample, absorbed, number, n_photons, seed=0, detectors=None, ring_edges=None):
    """Light emitted by a layer with a quantum yield of one.

    Parameters
    ----------
    sample
        At the emitted wavelength.
    absorbed
        From `simulate` at the exciting wavelength.
    number
        The layer that emits, 1 for the first.
    n_photons
        Incident photons of that simulation.
    seed, detectors, ring_edges
        See `simulate`.

    Returns
    -------
    Result
        In photons, over those incident at the exciting wavelength.
    """
    random = np.random.default_rng(seed)
    depth, batch = absorbed.in_layer(number)
    photons = Photons(sample, 0.0, depth.size, random)
    cosine, turn = 2 * random.random(depth.size) - 1, 2 * np.pi * random.random(depth.size)
    sine = np.sqrt(1 - cosine**2)
    photons.direction = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine])
    photons.depth, photons.batch = depth, batch
    photons.medium[:], photons.face[:], photons.kind[:] = number, -1, DIFFUSE
    events = None if detectors is None else NextEvents(sample, detectors)
    counts = Counts(ring_edges, 0.0)
    if events is not None and depth.size:
        events.on_scattering(number, photons, np.arange(depth.size), _ISOTROPIC)
    follow(sample, photons, counts, events, random)
    return counts.result(events, n_photons // N_BATCHES)
