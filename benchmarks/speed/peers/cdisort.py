"""Peers around cdisort: nanodisort, one state or a batch, and pydisort."""

import numpy as np

from benchmarks.speed.peers.contenders import THREADS
from benchmarks.speed.peers.slabs import BOTH_SIDES, build, n_moments
from benchmarks.speed.peers.units import CENTRAL_STEPS, OUTGOING, SLABS


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


def nanodisort(unit, size):
    """The plain state."""
    return build(Nanodisort, unit, size)


def nanodisort_batch(unit, size):
    """The batch solver."""
    return build(NanodisortBatch, unit, size)


def pydisort(unit, size):
    """The torch module."""
    return build(Pydisort, unit, size)


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
