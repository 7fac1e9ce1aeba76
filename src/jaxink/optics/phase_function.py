"""What the optics of a layer asks of a phase function."""

import abc

import equinox as eqx
from jax.typing import ArrayLike
from jaxtyping import Array, Float


class PhaseFunction(eqx.Module):
    """Angular distribution of one scattering; its mean over the sphere is 1 (integral 4 pi)."""

    @abc.abstractmethod
    def value(self, scattering_cosine: Float[ArrayLike, "*points"]) -> Float[Array, "*points"]:
        """Phase function at given cosines of the scattering angle.

        Parameters
        ----------
        scattering_cosine
            1 is straight on, -1 is back, any shape.

        Returns
        -------
        Float[Array, "*points"]
            Dimensionless, mean over the sphere 1.
        """

    @abc.abstractmethod
    def moments(self, n_moments: int) -> Float[Array, " moments"]:
        """Legendre moments, without the factor 2l + 1.

        Parameters
        ----------
        n_moments
            Number of moments.

        Returns
        -------
        Float[Array, " moments"]
            chi_0 = 1, chi_1 is the asymmetry parameter.
        """
