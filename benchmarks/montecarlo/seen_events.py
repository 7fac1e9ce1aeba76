"""Next-event estimation where only light is seen that leaves near the axis of the beam.

As in `events`, but the reflections at the two outer faces are followed one by one: each leaves at another
place. For layers of one index between smooth faces, so that a path is straight between these faces.
"""

import numpy as np

from benchmarks.montecarlo.events import NextEvents
from benchmarks.montecarlo.facets import fresnel

# Passages through the whole sample and back; each is weaker by the square of a reflectance, or by scattering.
ROUND_TRIPS = 4


class SeenEvents(NextEvents):
    """Adds up the BSDF at the detectors, by batch, of light that leaves within the disc that is seen.

    Parameters
    ----------
    sample
        With ``seen_radius_mm``, layers of one index, smooth faces and no backing.
    detectors
        Directions.
    centre_mm
        Place along x where the axis of the beam leaves, in transmission; in reflection it is 0.

    Raises
    ------
    ValueError
        The layers differ in index, a face is rough, or there is a backing.
    """

    def __init__(self, sample, detectors, centre_mm):
        super().__init__(sample, detectors)
        indices = sample.indices[1:-1]
        is_rough = any(sample.rough(face) is not None for face in range(len(sample.layers) + 1))
        if np.any(indices != indices[0]) or is_rough or sample.backing_albedo is not None:
            raise ValueError("light near the axis is followed in layers of one index between smooth faces.")
        self._centre, self._index = centre_mm, indices[0]
        # Depth and optical depth of the near faces of the media, from the lit side.
        self._top = np.concatenate([[0.0, 0.0], np.cumsum(self._thickness[1:-1])])
        whole = np.cumsum(self._extinction[1:-1] * self._thickness[1:-1])
        self._optical_top = np.concatenate([[0.0, 0.0], whole])

    def on_scattering(self, number, photons, at, phase=None):
        """Scattering of the photons ``at`` in layer ``number``, by its phase function or another one."""
        layer = self.sample.layers[number - 1]
        phase = layer.phase if phase is None else phase
        inside = photons.depth[at]
        depth = self._top[number] + inside
        optical = self._optical_top[number] + self._extinction[number] * inside
        whole, optical_whole = self._top[-1], self._optical_top[-1]
        for which, z, flat, beam in self._sides:
            flat, cosine = flat / self._index, beam.cosine[number]
            towards = np.concatenate([flat, z * cosine[:, None]], axis=1)
            outside = [self.sample.index_front, self.sample.index_back][:: -1 if z > 0 else 1]
            near, far = (fresnel(self._index, n, cosine)[0] for n in outside)
            factor = (outside[0] / self._index) ** 2 / cosine * (1 - near)
            to_near, optical_near = (whole - depth, optical_whole - optical) if z > 0 else (depth, optical)
            centre = self._centre if z > 0 else 0.0
            sent = np.zeros((which.size, at.size))
            for by_far in (False, True):
                direction = towards * [1.0, 1.0, -1.0 if by_far else 1.0]
                scattered = phase.value(direction @ photons.direction[:, at]) * factor[:, None]
                for trip in range(ROUND_TRIPS):
                    length = 2 * trip * whole + (2 * whole - to_near if by_far else to_near)
                    path = 2 * trip * optical_whole + (
                        2 * optical_whole - optical_near if by_far else optical_near
                    )
                    left = (near * far) ** trip * (far if by_far else 1.0)
                    x, y = (photons.place[k, at] + (flat[:, k] / cosine)[:, None] * length for k in range(2))
                    seen = (x - centre) ** 2 + y**2 <= self.sample.seen_radius_mm**2
                    sent += seen * left[:, None] * np.exp(-path / cosine[:, None]) * scattered
            self._add(which, photons.weight[at] * sent, photons.batch[at])
