"""PythonicDISORT."""

import warnings

import numpy as np

from benchmarks.speed.peers.slabs import COSINES, build, n_moments
from benchmarks.speed.peers.units import OUTGOING


class PythonicDisort:
    """NT correction at the viewing angles; Legendre tables kept between calls."""

    def __init__(self, slab, streams, n_sets):  # noqa: ARG002
        warnings.simplefilter("ignore")
        self.slab, self.streams, self.moments = slab, streams, n_moments(slab.sets, streams)

    def solve(self, sets):
        """BSDF on the grid for each set."""
        from PythonicDISORT import pydisort
        from PythonicDISORT.subroutines import interpolate

        slab, n = self.slab, len(OUTGOING)
        found = np.empty((len(sets), *slab.shape))
        azimuths = np.deg2rad(180.0 - np.array(slab.azimuths))
        for k, (asymmetry, albedo, thickness) in enumerate(sets):
            moments = asymmetry ** np.arange(self.moments)
            for i, incidence in enumerate(slab.incidences):
                cosine = np.cos(np.deg2rad(incidence))
                *_, radiance = pydisort(
                    thickness,
                    albedo,
                    self.streams,
                    moments,
                    cosine,
                    1.0,
                    0.0,
                    f_arr=moments[self.streams],
                    NT_cor=True,
                    NFourier=self.streams if incidence else 1,
                    cache_asso_leg="mu0",
                )
                at = interpolate(radiance, NT_cor="eval")
                values = at(np.concatenate([COSINES, -COSINES]), np.array([0.0, thickness]), azimuths)
                values = values.reshape(2 * n, 2, len(azimuths)) / cosine
                found[k, i] = np.stack([values[:n, 0].T, values[n:, 1].T])
        return found.reshape(len(sets), -1)


def pythonic_disort(unit, size):
    """The numpy port."""
    return build(PythonicDisort, unit, size)
