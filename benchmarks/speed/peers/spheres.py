"""Peers that compute spheres."""

import os

import numpy as np

from benchmarks.speed.peers.units import SIZE_PARAMETERS, SPHERE_COSINES, SPHERE_INDEX, SPHERE_MOMENTS

# These packages take n - ik. 64 Gauss nodes integrate the moments exactly.
INDEX = np.conj(SPHERE_INDEX)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(SPHERE_MOMENTS)
COSINES = np.concatenate([SPHERE_COSINES, NODES])
TO_MOMENTS = np.polynomial.legendre.legvander(NODES, SPHERE_MOMENTS - 1) * WEIGHTS[:, None] / 2


def _columns(extinction, scattering, phase):
    """Efficiencies, asymmetry, phase function at the angles, moments."""
    moments = phase[:, SPHERE_COSINES.size :] @ TO_MOMENTS
    head = np.column_stack([extinction, scattering, moments[:, 1]])
    return {"spheres": np.concatenate([head, phase[:, : SPHERE_COSINES.size], moments], axis=1)}


def sasktran2(unit, size):  # noqa: ARG001
    """All spheres in one call."""
    from sasktran2.mie import LinearizedMie

    mie = LinearizedMie()

    def run():
        out = mie.calculate(SIZE_PARAMETERS, INDEX, COSINES, False)
        intensity = np.abs(out.S1) ** 2 + np.abs(out.S2) ** 2
        return _columns(out.Qext, out.Qsca, 2 * intensity / (SIZE_PARAMETERS**2 * out.Qsca)[:, None])

    return run


def miepython(unit, size):  # noqa: ARG001
    """Compiled by numba; one call for each sphere's phase function."""
    # Read at import.
    os.environ["MIEPYTHON_USE_JIT"] = "1"
    import miepython as mie

    def run():
        extinction, scattering, *_ = mie.efficiencies_mx(INDEX, SIZE_PARAMETERS)
        phase = [mie.i_unpolarized(INDEX, x, COSINES, norm="4pi") for x in SIZE_PARAMETERS]
        return _columns(extinction, scattering, np.array(phase))

    return run
