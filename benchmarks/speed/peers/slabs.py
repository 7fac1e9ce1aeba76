"""Peers that solve slabs: each class is made for a unit and a size, and solves sets of optical parameters."""

import warnings

import numpy as np

from benchmarks.speed.peers.contenders import THREADS
from benchmarks.speed.peers.units import CENTRAL_STEPS, FORWARD_STEPS, OUTGOING, SLABS

COSINES = np.cos(np.deg2rad(OUTGOING))
# cdisort wants ascending cosines, transmitted (negative) ones first.
BOTH_SIDES = np.concatenate([-COSINES, COSINES[::-1]])


def n_moments(sets, streams: int) -> int:
    """Moments that describe the sharpest phase function to 1e-10, and one more than delta-M keeps."""
    return max(streams + 1, int(np.ceil(np.log(1e-10) / np.log(np.max(sets[:, 0])))))


def forward_differences(solve, centre):
    """Value and derivatives from four solves."""
    steps = np.diag(FORWARD_STEPS)
    values = solve(np.vstack([centre, centre + steps]))
    return values[:1], (values[1:] - values[0]) / np.diag(steps)[:, None]


def build(solver, unit: str, size):
    """One run of a unit by a solver class."""
    slab = SLABS[unit]
    n_sets = 1 + len(FORWARD_STEPS) if unit == "W4" else len(slab.sets)
    made = solver(slab, size, n_sets)
    name = getattr(solver, "gives", "values")
    if unit != "W4":
        return lambda: {name: made.solve(slab.sets)}

    def with_derivatives():
        values, derivatives = forward_differences(made.solve, slab.sets[0])
        return {name: values, "derivatives": derivatives}

    return with_derivatives


class Nanodisort:
    """One state for all incidences, solved one after the other."""

    def __init__(self, slab, streams, n_sets):  # noqa: ARG002
        import nanodisort

        self.slab, self.moments = slab, n_moments(slab.sets, streams)
        self.state = state = nanodisort.DisortState()
        _set_cdisort(state, slab, streams, self.moments)
        state.fbeam, state.albedo = 1.0, 0.0
        state.allocate()
        state.umu, state.phi = BOTH_SIDES, 180.0 - np.array(slab.azimuths)

    def solve(self, sets):
        """BSDF on the grid for each set."""
        state, slab = self.state, self.slab
        found = np.empty((len(sets), *slab.shape))
        for k, (asymmetry, albedo, thickness) in enumerate(sets):
            moments = np.asfortranarray(asymmetry ** np.arange(self.moments + 1.0)[:, None])
            for i, cosine in enumerate(np.cos(np.deg2rad(slab.incidences))):
                state.umu0, state.dtauc, state.ssalb = cosine, np.array([thickness]), np.array([albedo])
                state.pmom = moments
                state.solve()
                found[k, i] = _both_sides(state.uu) / cosine
        return found.reshape(len(sets), -1)


class NanodisortBatch:
    """One batch solver for each incidence, two threads."""

    def __init__(self, slab, streams, n_sets):
        import nanodisort

        self.slab, self.moments = slab, n_moments(slab.sets, streams)
        self.solvers = []
        for cosine in np.cos(np.deg2rad(slab.incidences)):
            solver = nanodisort.BatchSolver(nthreads=THREADS)
            _set_cdisort(solver, slab, streams, self.moments)
            solver.umu0 = cosine
            # Directions are copied when the memory is allocated.
            solver.set_umu(BOTH_SIDES)
            solver.set_phi(180.0 - np.array(slab.azimuths))
            solver.allocate(n_sets)
            solver.set_fbeam(np.ones(n_sets))
            solver.set_albedo(np.zeros(n_sets))
            self.solvers.append(solver)

    def solve(self, sets):
        """BSDF on the grid for each set."""
        found = np.empty((len(sets), *self.slab.shape))
        asymmetry, albedo, thickness = np.ascontiguousarray(sets.T)
        moments = asymmetry ** np.arange(self.moments + 1.0)[:, None, None]
        for i, solver in enumerate(self.solvers):
            solver.set_dtauc(thickness[:, None])
            solver.set_ssalb(albedo[:, None])
            solver.set_pmom(np.asfortranarray(moments))
            solver.solve()
            for k, radiance in enumerate(np.asarray(solver.uu)):
                found[k, i] = _both_sides(radiance) / solver.umu0
        return found.reshape(len(sets), -1)


def _set_cdisort(state, slab, streams, moments):
    """Sizes and switches that state and batch solver share."""
    state.nstr, state.nlyr, state.nmom, state.ntau = streams, 1, moments, 2
    state.numu, state.nphi = BOTH_SIDES.size, len(slab.azimuths)
    state.usrtau, state.usrang, state.lamber, state.quiet = False, True, True, True
    state.planck, state.onlyfl = False, False
    state.intensity_correction, state.old_intensity_correction = True, True
    state.phi0 = state.fisot = state.accur = 0.0


def _both_sides(radiance):
    """Side, azimuth, outgoing angle from cosine, depth, azimuth."""
    radiance, n = np.asarray(radiance), len(OUTGOING)
    return np.stack([radiance[n:, 0][::-1].T, radiance[:n, 1].T])


class Pydisort:
    """All incidences are columns of one call; depths are frozen, so a new thickness needs a new solver."""

    def __init__(self, slab, streams, n_sets):  # noqa: ARG002
        import torch

        torch.set_num_threads(THREADS)
        torch.set_default_dtype(torch.float64)
        self.slab, self.streams, self.moments = slab, streams, n_moments(slab.sets, streams)
        self.cosines = np.cos(np.deg2rad(slab.incidences))

    def solve(self, sets):
        """BSDF on the grid for each set."""
        found = np.empty((len(sets), *self.slab.shape))
        for thickness in np.unique(sets[:, 2]):
            members = np.flatnonzero(sets[:, 2] == thickness)
            found[members] = self._solve_thickness(sets[members], thickness)
        return found.reshape(len(sets), -1)

    def _solve_thickness(self, sets, thickness):
        import pydisort
        import torch

        n_sets, n_columns = len(sets), len(self.cosines)
        flags = "usrtau,usrang,lamber,quiet,intensity_correction,old_intensity_correction"
        options = pydisort.DisortOptions().flags(flags).nwave(n_sets).ncol(n_columns)
        options.ds().nlyr, options.ds().nstr = 1, self.streams
        options.ds().nmom = options.ds().nphase = self.moments
        options.user_tau(np.array([0.0, thickness]))
        options.user_mu(BOTH_SIDES)
        options.user_phi(180.0 - np.array(self.slab.azimuths))
        solver = pydisort.Disort(options)
        properties = torch.empty(n_sets, n_columns, 1, 2 + self.moments)
        for k, (asymmetry, albedo, _) in enumerate(sets):
            properties[k, :, 0, 0], properties[k, :, 0, 1] = thickness, albedo
            properties[k, :, 0, 2:] = pydisort.scattering_moments(
                self.moments, "henyey-greenstein", asymmetry
            )
        nothing = torch.zeros(n_sets, n_columns)
        solver.forward(
            properties,
            umu0=torch.tensor(self.cosines),
            phi0=torch.zeros(n_columns),
            fbeam=torch.ones(n_sets, n_columns),
            albedo=nothing,
            fluor=nothing,
            fisot=nothing,
        )
        # Set, column, azimuth, depth, cosine.
        radiance, n = solver.gather_rad().numpy(), len(OUTGOING)
        sides = np.stack([radiance[:, :, :, 0, n:][..., ::-1], radiance[:, :, :, 1, :n]], axis=2)
        return sides / self.cosines[:, None, None, None]


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


def nanodisort(unit, size):
    """The plain state."""
    return build(Nanodisort, unit, size)


def nanodisort_batch(unit, size):
    """The batch solver."""
    return build(NanodisortBatch, unit, size)


def pydisort(unit, size):
    """The torch module."""
    return build(Pydisort, unit, size)


def pythonic_disort(unit, size):
    """The numpy port."""
    return build(PythonicDisort, unit, size)


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


def central_differences(unit, size):
    """Derivatives that the others are checked with: nanodisort with many streams, never timed."""
    slab = SLABS[unit]
    solver = Nanodisort(slab, size, 1)
    steps = np.diag(CENTRAL_STEPS)

    def run():
        ahead, behind = (solver.solve(slab.sets[0] + sign * steps) for sign in (1, -1))
        values = solver.solve(slab.sets)
        return {"values": values, "derivatives": (ahead - behind) / (2 * np.diag(steps)[:, None])}

    return run


def iadpython(unit, size):
    """Total reflectance and transmittance at normal incidence."""
    import iadpython as iad

    slab = SLABS[unit]
    asymmetry, albedo, thickness = slab.sets[0]

    def run():
        sample = iad.Sample(a=albedo, b=thickness, g=asymmetry, n=slab.index, quad_pts=size)
        return {"totals": np.array(sample.rt()[:2])}

    return run


def mitsuba_llvm(unit, size):
    """Compiled by LLVM."""
    return _mitsuba("llvm_ad_mono", unit, size)


def mitsuba_scalar(unit, size):
    """One path after the other."""
    return _mitsuba("scalar_rgb", unit, size)


def _mitsuba(variant, unit, size):
    """Total reflectance at normal incidence, by reciprocity: radiance of the slab under a uniform sky."""
    import mitsuba as mi

    mi.set_variant(variant)
    slab = SLABS[unit]
    asymmetry, albedo, thickness = (float(value) for value in slab.sets[0])
    look = mi.ScalarTransform4f().look_at
    medium = {
        "type": "homogeneous",
        "albedo": {"type": "uniform", "value": albedo},
        "sigma_t": {"type": "uniform", "value": thickness},
        "phase": {"type": "hg", "g": asymmetry},
    }
    scene = mi.load_dict(
        {
            "type": "scene",
            # No roulette at the depths that matter: it only adds noise at this albedo.
            "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 100_000},
            "sensor": {
                "type": "radiancemeter",
                "to_world": look(origin=[0, 0, 3], target=[0, 0, 0], up=[0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "pixel_format": "luminance"},
                "sampler": {"type": "independent"},
            },
            "sky": {
                "type": "rectangle",
                "to_world": look(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0]).scale([1e5, 1e5, 1]),
                "emitter": {"type": "area", "radiance": {"type": "uniform", "value": 1.0}},
            },
            "slab": {
                "type": "cube",
                "to_world": mi.ScalarTransform4f().scale([1e3, 1e3, 0.5]),
                "bsdf": {"type": "dielectric", "int_ior": slab.index, "ext_ior": 1.0},
                "interior": medium,
            },
        }
    )
    # Parts give the standard error.
    parts = 10
    seeds = iter(range(1, 2**31))

    def run():
        renders = [mi.render(scene, spp=size // parts, seed=next(seeds)) for _ in range(parts)]
        return {"noisy_total": np.array([np.array(render).item() for render in renders])}

    return run
