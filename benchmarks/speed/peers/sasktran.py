"""sasktran2, which gives the reflected side."""

import numpy as np

from benchmarks.speed.peers.contenders import THREADS
from benchmarks.speed.peers.slabs import COSINES, build, n_moments
from benchmarks.speed.peers.units import SLABS


class Sasktran2:
    """Discrete ordinates with delta-M and their own single scattering; the reflected side only."""

    gives = "reflected"

    def __init__(self, slab, streams, n_sets):  # noqa: ARG002
        import sasktran2 as sk

        config = sk.Config()
        config.num_streams, config.num_threads = streams, THREADS
        config.num_singlescatter_moments = self.moments = n_moments(slab.sets, streams)
        config.multiple_scatter_source = sk.MultipleScatterSource.DiscreteOrdinates
        config.single_scatter_source = sk.SingleScatterSource.DiscreteOrdinates
        config.delta_m_scaling = True
        config.input_validation_mode = sk.InputValidationMode.Disabled
        self.slab, self.config, self.engines = slab, config, []
        linear, flat = sk.InterpolationMethod.LinearInterpolation, sk.GeometryType.PlaneParallel
        for incidence in slab.incidences:
            # A ray along the normal exactly is refused.
            cosine = min(np.cos(np.deg2rad(incidence)), 1 - 1e-10)
            geometry = sk.Geometry1D(cosine, 0.0, 6e6, np.array([0.0, 1.0]), linear, flat)
            viewing = sk.ViewingGeometry()
            for azimuth in np.deg2rad(180.0 - np.array(slab.azimuths)):
                for outgoing in np.minimum(COSINES, 1 - 1e-10):
                    viewing.add_ray(sk.GroundViewingSolar(cosine, azimuth, outgoing, 200.0))
            self.engines.append((cosine, geometry, sk.Engine(config, geometry, viewing)))

    def _atmosphere(self, geometry, sets, derivatives):
        import sasktran2 as sk

        asymmetry, albedo, thickness = sets.T
        degree = np.arange(self.moments)[:, None]
        atmosphere = sk.Atmosphere(
            geometry,
            self.config,
            numwavel=len(sets),
            calculate_derivatives=derivatives,
            legendre_derivative=False,
        )
        storage = atmosphere.storage
        storage.total_extinction[:], storage.ssa[:] = thickness, albedo
        storage.leg_coeff[:] = ((2 * degree + 1) * asymmetry**degree)[:, None]
        atmosphere.surface.albedo[:] = 0
        if derivatives:
            mapping = storage.get_derivative_mapping("wf_g")
            slope = (2 * degree + 1) * degree * asymmetry ** np.maximum(degree - 1, 0)
            mapping.d_leg_coeff[:] = slope[:, None]
            mapping.d_extinction[:], mapping.d_ssa[:], mapping.scat_factor[:] = 0, 0, 1
            mapping.interp_dim = "altitude"
        return atmosphere

    def solve(self, sets):
        """Reflected half of the grid for each set."""
        found = []
        for cosine, geometry, engine in self.engines:
            result = engine.calculate_radiance(self._atmosphere(geometry, sets, False))
            found.append(result["radiance"].values[..., 0] / cosine)
        return np.concatenate(found, axis=1)

    def linearised(self, sets):
        """Reflected half of the grid for one set, and its derivatives."""
        found, derivatives = [], []
        for cosine, geometry, engine in self.engines:
            result = engine.calculate_radiance(self._atmosphere(geometry, sets, True))
            found.append(result["radiance"].values[..., 0] / cosine)
            # Summed over both levels of the homogeneous layer.
            names = ("wf_g", "wf_ssa", "wf_extinction")
            derivatives.append([result[n].values.sum(axis=0)[0, :, 0] / cosine for n in names])
        return np.concatenate(found, axis=1), np.concatenate(derivatives, axis=1)


def sasktran2(unit, size):
    """Values only."""
    return build(Sasktran2, unit, size)


def sasktran2_linearised(unit, size):
    """Values and analytic derivatives."""
    slab = SLABS[unit]
    solver = Sasktran2(slab, size, 1)

    def run():
        values, derivatives = solver.linearised(slab.sets)
        return {"reflected": values, "derivatives": derivatives}

    return run
