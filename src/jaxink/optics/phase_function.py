"""What the solver asks of a phase function, and of the scattering matrix of polarised light."""

import abc
import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.display.brief import brief_repr
from jaxink.numerics.legendre import associated_legendre


class PhaseFunction(eqx.Module):
    """Angular distribution of single scattering, with mean 1 over the sphere (integral 4 pi)."""

    __repr__ = brief_repr

    @abc.abstractmethod
    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """Phase function at cosines of the scattering angle; 1 is forward, -1 backward."""

    @abc.abstractmethod
    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """Legendre moments, without the factor 2l + 1.

        Moment 0 is 1; moment 1 is the asymmetry parameter.
        """


class ScatteringMatrix(eqx.Module):
    """Scattering matrix of spheres, without its element F34, which only circular polarisation meets.

    In the scattering plane, I' = F11 I + F12 Q, Q' = F12 I + F11 Q and U' = F33 U, where Q is the intensity
    in that plane minus that perpendicular to it.

    Parameters
    ----------
    moments
        Legendre moments of F11 (the phase function, first moment 1), F12 and F33, without the factor 2l + 1.
    phase_function
        Phase function if interference between the spheres changes F11, and the others in proportion.

    References
    ----------
    Bohren, Huffman 1983, eqs. 4.75 to 4.77.
    """

    __repr__ = brief_repr

    moments: Float[Array, "3 moments"]
    phase_function: PhaseFunction | None = None

    def elements(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "3 *points"]:
        """F11, F12 and F33 at cosines of the scattering angle."""
        degree = np.arange(self.moments.shape[1])
        polynomials = associated_legendre(degree.size, 1, scattering_cosine)[0]
        elements = jnp.tensordot((2 * degree + 1) * self.moments, polynomials, 1)
        if self.phase_function is None:
            return elements
        return elements * (self.phase_function.value(scattering_cosine) / elements[0])

    def with_phase_function(self, phase_function: PhaseFunction) -> "ScatteringMatrix":
        """The matrix of spheres that interfere, which together have another phase function."""
        return dataclasses.replace(self, phase_function=phase_function)
