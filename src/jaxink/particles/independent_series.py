"""The Mie series beside that of another program, miepython."""

from collections.abc import Callable
from functools import cache

import jax
import numpy as np
from jaxtyping import Complex, Float

from jaxink.numerics.compiling import jit_unoptimised
from jaxink.numerics.fingerprint import fingerprint
from jaxink.particles.mie import DEFAULT_MAX_SIZE_PARAMETER, mie_sphere

# Spheres that one run of the program computes.
_AT_ONCE = 16
_COSINES = np.cos(np.deg2rad(np.arange(0.0, 181.0, 5.0)))


def difference_from_miepython(
    size_parameters: Float[np.ndarray, " spheres"],
    relative_indices: Complex[np.ndarray, " spheres"],
    max_size_parameter: float = DEFAULT_MAX_SIZE_PARAMETER,
) -> Float[np.ndarray, " spheres"]:
    """Largest relative difference between jaxink's spheres and those of miepython.

    Compared are the efficiencies of extinction and scattering, relative to themselves; the asymmetry
    parameter, relative to 1; and the phase function every 5 degrees, relative to itself or, where it is
    smaller, to that of isotropic scattering.

    Parameters
    ----------
    size_parameters, relative_indices, max_size_parameter
        See `mie_sphere`.

    References
    ----------
    Prahl, miepython, https://miepython.readthedocs.io.
    """
    import miepython

    count = len(size_parameters)
    # The last chunk is filled up, so that one program serves any number of spheres.
    padded = np.resize(np.arange(count), -(-count // _AT_ONCE) * _AT_ONCE).reshape(-1, _AT_ONCE)
    run = _program(max_size_parameter)
    x, index = size_parameters, relative_indices
    chunks = [run(x[some], index.real[some], index.imag[some]) for some in padded]
    own = [np.concatenate([np.asarray(chunk[i]) for chunk in chunks])[:count] for i in range(4)]
    # Its index is n - ik.
    extinction, scattering, _, asymmetry = miepython.efficiencies_mx(np.conj(index), x)
    phase = np.array(
        [
            4 * np.pi * miepython.i_unpolarized(np.conj(m), size, _COSINES, norm="one")
            for size, m in zip(x, index, strict=True)
        ]
    )
    differences = (
        np.abs(own[0] / extinction - 1),
        np.abs(own[1] / scattering - 1),
        np.abs(own[2] - asymmetry),
        np.max(np.abs(own[3] - phase) / np.maximum(phase, 1), axis=1),
    )
    return np.max(differences, axis=0)


@cache
def _program(max_size_parameter: float) -> Callable:
    key = fingerprint("spheres beside miepython", max_size_parameter)
    return jit_unoptimised(lambda x, n, k: _spheres(x, n, k, max_size_parameter), key=key)


def _spheres(x, n, k, max_size_parameter: float):
    """Efficiencies of extinction and scattering, asymmetry and phase function of spheres."""

    def one(x, n, k):
        sphere = mie_sphere(x, n + 1j * k, max_size_parameter)
        efficiencies = sphere.extinction_efficiency, sphere.scattering_efficiency
        return *efficiencies, sphere.asymmetry_parameter, sphere.value(_COSINES)

    return jax.vmap(one)(x, n, k)
