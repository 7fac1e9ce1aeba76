"""What an integrating sphere reads in a single beam: the sample, as part of its wall, changes its gain."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxink.measurement.quantities import QUANTITIES
from jaxink.measurement.readings import Readings


class SphereGain(eqx.Module):
    """Gain of a sphere with the sample in its port, over that of the reading of 100 %.

    A sphere of mean wall reflectance r_w with a port of area fraction f, closed by what reflects r of diffuse
    light, multiplies the light that is let into it by G = 1 / (1 - (1 - f) r_w - f r). An ideal sphere has
    f = 0. The first reflection from the wall is that of the reference too and cancels. A baffle between port
    and detector makes f r in G smaller by about r_w, which is neglected.

    Parameters
    ----------
    reference
        1 / G of the reading of 100 %; 1 for an ideal sphere.
    wall
        1 - (1 - f) r_w; 1 for an ideal sphere.
    port_fraction
        f.
    facing
        Which diffuse reflectance of the sample faces the sphere: 0 of its front, 1 of its front without a
        backing, 2 of its back.

    References
    ----------
    Pickering, Prahl, van Wieringen, Beek, Sterenborg, van Gemert 1993 Appl. Opt. 32, 399 (single spheres).
    """

    reference: Float[np.ndarray, " readings"]
    wall: Float[np.ndarray, " readings"]
    port_fraction: Float[np.ndarray, " readings"]
    facing: Int[np.ndarray, " readings"]

    def of(self, reflectances: Float[Array, "readings sides"]) -> Float[Array, " readings"]:
        """Gain for each sample, from its diffuse reflectances in the order of ``facing``."""
        facing = reflectances[jnp.arange(len(self.facing)), self.facing]
        return self.reference / (self.wall - self.port_fraction * facing)


def sphere_gain(readings: Readings) -> SphereGain | None:
    """Gain of the spheres of some readings; None if all are ideal."""
    spheres = readings.spheres
    if spheres is None:
        return None
    fraction, reference = (
        np.nan_to_num(column) for column in (spheres.port_fraction, spheres.reference_reflectance)
    )
    wall = 1 - (1 - fraction) * np.nan_to_num(spheres.wall_reflectance)
    facing = [_facing(name) for name in readings.quantity.tolist()]
    return SphereGain(wall - fraction * reference, wall, fraction, np.array(facing))


def _facing(name: str) -> int:
    quantity = QUANTITIES[name]
    if not quantity.is_transmission:
        return 0
    # Diffuse light in front comes from a sphere there, collected light goes to one behind.
    return 1 if quantity.theta_i_deg is None else 2
