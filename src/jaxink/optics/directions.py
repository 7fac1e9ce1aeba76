"""Directions of a measurement, and their scattering angles."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from jaxink.display.brief import brief_repr


class Directions(eqx.Module):
    """Pairs of incident and outgoing directions, with each polar angle stored once.

    The angles are constants, held as NumPy arrays and never differentiated.

    Parameters
    ----------
    sin_incidence, sin_outgoing
        Sines of the distinct polar angles in the surroundings, shapes ``(incidences,)``, ``(outgoing,)``.
    incidence, outgoing
        Position of each point's polar angles among them, shape ``(points,)``.
    azimuth_rad
        Azimuth between the directions of propagation at each point; 0 is straight on.
    is_transmission
        Whether the light leaves on the far side.
    """

    __repr__ = brief_repr

    sin_incidence: Float[np.ndarray, " incidences"]
    sin_outgoing: Float[np.ndarray, " outgoing"]
    incidence: Int[np.ndarray, " points"]
    outgoing: Int[np.ndarray, " points"]
    azimuth_rad: Float[np.ndarray, " points"]
    is_transmission: np.ndarray

    @classmethod
    def from_degrees(cls, theta_i_deg, theta_o_deg, phi_deg, is_transmission) -> "Directions":
        """Directions from the columns of a measurement.

        Parameters
        ----------
        theta_i_deg, theta_o_deg
            Polar angles, 0 to 90 degrees, shape ``(points,)``.
        phi_deg
            Azimuth: 180 in the half plane of the specular or undeviated direction, 0 in that of the source.
        is_transmission
            False for reflection, True for transmission.
        """
        theta_i, theta_o, phi = (np.asarray(angle, float) for angle in (theta_i_deg, theta_o_deg, phi_deg))
        distinct_i, incidence = np.unique(theta_i, return_inverse=True)
        distinct_o, outgoing = np.unique(theta_o, return_inverse=True)
        return cls(
            np.sin(np.deg2rad(distinct_i)),
            np.sin(np.deg2rad(distinct_o)),
            incidence.reshape(-1),
            outgoing.reshape(-1),
            np.deg2rad(180.0 - phi),
            np.asarray(is_transmission, bool),
        )


def scattering_cosines(
    cosine_out: Float[Array, " points"],
    cosine_in: Float[Array, " points"],
    azimuth_rad: Float[ArrayLike, " points"],
) -> tuple[Float[Array, " points"], Float[Array, " points"]]:
    """Cosines of the scattering angle into the same and into the opposite hemisphere.

    Parameters
    ----------
    cosine_out, cosine_in
        Cosines to the normal inside the medium, both positive.
    azimuth_rad
        Azimuth between the directions of propagation.

    Returns
    -------
    ahead, back
        cos(Theta) for the same and for the opposite hemisphere.
    """
    sines = jnp.sqrt(jnp.maximum((1 - cosine_out**2) * (1 - cosine_in**2), 1e-300))
    in_plane = sines * jnp.cos(azimuth_rad)
    straight = cosine_out * cosine_in
    return jnp.clip(straight + in_plane, -1, 1), jnp.clip(in_plane - straight, -1, 1)
