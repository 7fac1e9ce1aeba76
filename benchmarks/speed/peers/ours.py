"""The contenders of jaxink, as a user would call it; the worker enters `computing()` around them."""

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.speed.peers.units import SIZE_PARAMETERS, SLABS, SPHERE_COSINES, SPHERE_INDEX, SPHERE_MOMENTS
from jaxink import ForwardModel, parse_sample
from jaxink.optics.directions import Directions
from jaxink.optics.layers import ScatteringLayer
from jaxink.particles.mie import mie_sphere
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.bsdf import diffuse_bsdf
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack

SAMPLE = """
schema_version = 1
wavelength_nm = 550

[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.49
thickness_mm = 2.0

[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = { value = 1.52, free = true, min = 1.45, max = 1.6 }
thickness_um = { value = 40, free = true, min = 10, max = 100 }
radius_nm = { value = 300, free = true, min = 50, max = 1000 }
particle_index = { value = 1.75, free = true, min = 1.6, max = 2.0 }
particle_absorption_index = 1e-4
volume_fraction = { value = 0.08, free = true, min = 0.001, max = 0.3 }
"""


def _bsdf(slab, config):
    """BSDF of the slab as a function of g, albedo and optical thickness."""
    directions = Directions.from_degrees(*slab.points())

    def bsdf(parameters):
        asymmetry, albedo, thickness = parameters
        layer = ScatteringLayer(slab.index, thickness, albedo, HenyeyGreenstein(asymmetry))
        return diffuse_bsdf(Stack((layer,), 1.0, 1.0), directions, config)

    return bsdf


def _with_jacobian(function):
    """Value and forward-mode Jacobian in one pass."""

    def twice(x):
        value = function(x)
        return value, value

    jacobian = jax.jacfwd(twice, has_aux=True)

    def value_and_jacobian(x):
        slopes, value = jacobian(x)
        return value, slopes

    return value_and_jacobian


def slab(unit, size):
    """Values of one set, or of all sets at once."""
    work = SLABS[unit]
    bsdf = _bsdf(work, SolverConfig(*size))
    if len(work.sets) == 1:
        compiled = jax.jit(bsdf)
        return lambda: {"values": np.asarray(compiled(work.sets[0]))[None]}
    compiled = jax.jit(jax.vmap(bsdf))
    return lambda: {"values": np.asarray(compiled(work.sets))}


def slab_with_jacobian(unit, size):
    """Values and exact derivatives of one set."""
    work = SLABS[unit]
    compiled = jax.jit(_with_jacobian(_bsdf(work, SolverConfig(*size))))

    def run():
        values, slopes = jax.block_until_ready(compiled(work.sets[0]))
        return {"values": np.asarray(values)[None], "derivatives": np.asarray(slopes).T}

    return run


def _sphere(parameters):
    """Efficiencies, asymmetry, phase function at the angles, moments; one sphere."""
    x, n, k = parameters
    sphere = mie_sphere(x, n + 1j * k, float(SIZE_PARAMETERS[-1]))
    head = jnp.stack([sphere.extinction_efficiency, sphere.scattering_efficiency, sphere.asymmetry_parameter])
    return jnp.concatenate([head, sphere.value(SPHERE_COSINES), sphere.moments(SPHERE_MOMENTS)])


def _spheres():
    constant = np.full(SIZE_PARAMETERS.size, SPHERE_INDEX)
    return np.column_stack([SIZE_PARAMETERS, constant.real, constant.imag])


def spheres(unit, size):  # noqa: ARG001
    """All spheres at once."""
    compiled, parameters = jax.jit(jax.vmap(_sphere)), _spheres()
    return lambda: {"spheres": np.asarray(compiled(parameters))}


def spheres_with_jacobian(unit, size):  # noqa: ARG001
    """All spheres at once, with derivatives in size parameter and both parts of the index."""
    compiled, parameters = jax.jit(jax.vmap(_with_jacobian(_sphere))), _spheres()

    def run():
        values, slopes = jax.block_until_ready(compiled(parameters))
        return {"spheres": np.asarray(values), "slopes": np.asarray(slopes)}

    return run


def _sample_model(config):
    outgoing = np.arange(0.0, 88.0, 2.5)
    rows = [
        (incidence, angle, azimuth, side)
        for incidence in (0.0, 15.0, 30.0, 45.0, 60.0)
        for side in (False, True)
        # One half-plane is all there is at normal incidence.
        for azimuth in ((0.0, 180.0) if incidence else (180.0,))
        for angle in outgoing
    ]
    incidence, angle, azimuth, side = np.array(rows).T
    sample = parse_sample(SAMPLE)
    model = ForwardModel(
        sample, incidence, angle, azimuth, np.full(len(rows), 550.0), side > 0.5, SolverConfig(*config)
    )
    free = {p.name: float(p.value) for p in sample.parameters.values() if p.free}
    names = sorted(free)

    def bsdf(values):
        return model.bsdf(dict(zip(names, values, strict=True)))

    return bsdf, np.array([free[name] for name in names])


def sample_with_jacobian(unit, size):  # noqa: ARG001
    """Values of the whole sample and their Jacobian in the five free parameters."""
    bsdf, start = _sample_model(size)
    compiled = jax.jit(_with_jacobian(bsdf))

    def run():
        values, slopes = jax.block_until_ready(compiled(start))
        return {"values": np.asarray(values), "slopes": np.asarray(slopes)}

    return run


def sample(unit, size):  # noqa: ARG001
    """Values of the whole sample."""
    bsdf, start = _sample_model(size)
    compiled = jax.jit(bsdf)
    return lambda: {"values": np.asarray(compiled(start))}
