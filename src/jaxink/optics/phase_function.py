"""Interface of phase functions."""

import abc

import equinox as eqx
from jax.typing import ArrayLike
from jaxtyping import Array, Float

from jaxink.display.brief import brief_repr


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
