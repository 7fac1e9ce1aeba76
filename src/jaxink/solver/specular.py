"""Regular (specular or directly transmitted) light in a stack: one number per channel."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxink.numerics.linear_algebra import at_least_tiny
from jaxink.optics import Directions, fresnel_reflectance, propagating_cosine


class RegularFields(eqx.Module):
    """Regular light in each channel, for unit flux incident on the front or on the back.

    Parameters
    ----------
    reflection, transmission
        Regular reflectance of the front, and regular transmittance, shape ``(channels,)``.
    down_from_front, up_from_front
        Downward flux just below the top of each layer and upward flux just above its bottom, shape
        ``(layers, channels)``.
    down_from_back, up_from_back
        The same for light incident on the back.
    cosines
        Cosine of the channel in each layer.
    interfaces
        Fresnel reflectance of each interface, shape ``(layers + 1, channels)``.
    arriving_from_front, arriving_from_back
        Flux that reaches each interface from its front, for light incident on the front, and from its back,
        for light incident on the back, shape ``(layers + 1, channels)``.
    returning_from_front, returning_from_back
        The same from the other side of the interface, after a reflection beyond it.
    """

    reflection: Float[Array, " channels"]
    transmission: Float[Array, " channels"]
    down_from_front: Float[Array, "layers channels"]
    up_from_front: Float[Array, "layers channels"]
    down_from_back: Float[Array, "layers channels"]
    up_from_back: Float[Array, "layers channels"]
    cosines: Float[Array, "layers channels"]
    interfaces: Float[Array, "interfaces channels"]
    arriving_from_front: Float[Array, "interfaces channels"]
    arriving_from_back: Float[Array, "interfaces channels"]
    returning_from_front: Float[Array, "interfaces channels"]
    returning_from_back: Float[Array, "interfaces channels"]


class RegularPaths(NamedTuple):
    """Regular light along the path in and the path out of each point.

    Parameters
    ----------
    directions
        The points.
    kappa
        n sin(theta) of all incidences, followed by those of all exits.
    way_out
        Position in ``kappa`` of each point's exit; its incidence has the same position as in ``directions``.
    fields_in, fields_out
        Regular light of both, shape ``(..., points)``.
    """

    directions: Directions
    kappa: Float[Array, " directions"]
    way_out: Int[Array, " points"]
    fields_in: RegularFields
    fields_out: RegularFields


# Depth beyond which the solver attenuates no further, 3e-96: it divides by the light that is left, up to
# three times in second derivatives.
FURTHEST = 220.0


def attenuation(optical_thickness, cosine, furthest=jnp.inf):
    """exp(-tau/mu), with tau/mu up to the furthest; 0 in an evanescent or grazing channel."""
    inside = cosine > 0
    depth = jnp.minimum(optical_thickness / jnp.where(inside, cosine, 1.0), furthest)
    return jnp.where(inside, jnp.exp(-depth), 0.0)


def _put_before(beyond, element):
    """Reflection and transmission once an element is put before what lies beyond it, twice for a scan."""
    (reflection, transmission), (r, under, t) = beyond, element
    gain = 1 / at_least_tiny(1 - under * reflection)
    after = (r + t**2 * gain * reflection, t * gain * transmission)
    return after, after


def regular_fields(
    indices: Float[Array, " media"],
    squared_cosine: Float[Array, "media channels"],
    optical_thickness: Float[Array, " layers"],
    kept: Float[Array, "3 interfaces channels"] | None,
    furthest: float = np.inf,
) -> RegularFields:
    """Regular light in every layer, with all multiple reflections added incoherently.

    Parameters
    ----------
    indices
        Refractive indices of front, layers and back.
    squared_cosine
        mu^2 of the channels in each of them; negative if evanescent.
    optical_thickness
        Optical thickness of each layer: the true one for light that is detected as regular, the truncated
        one for light that is scattered further.
    kept
        See `Stack.kept_regular`.
    furthest
        See `attenuation`.
    """
    cosines = propagating_cosine(squared_cosine)
    interfaces = fresnel_reflectance(indices[:-1, None], indices[1:, None], cosines[:-1], cosines[1:])
    inside = attenuation(optical_thickness[:, None], cosines[1:-1], furthest)
    # Interfaces and layers alternate, from the front to the back: reflection of either side, transmission.
    n_layers, n_channels = inside.shape
    at_faces = interfaces, interfaces, 1 - interfaces
    if kept is not None:
        at_faces = tuple(share * factor for share, factor in zip(at_faces, kept, strict=True))
    empty = jnp.zeros((2 * n_layers + 1, n_channels))
    r_front, r_back, t = (empty.at[::2].set(share) for share in at_faces)
    t = t.at[1::2].set(inside)

    nothing = (jnp.zeros(n_channels), jnp.ones(n_channels))
    # below[k], above[k]: what the elements from k on, or before k, reflect and transmit.
    _, below = jax.lax.scan(_put_before, nothing, (r_front, r_back, t), reverse=True)
    _, above = jax.lax.scan(_put_before, nothing, (r_back, r_front, t))
    below, through_below = (jnp.concatenate([b, e[None]]) for b, e in zip(below, nothing, strict=True))
    above, through_above = (jnp.concatenate([e[None], b]) for b, e in zip(above, nothing, strict=True))
    gain = 1 / at_least_tiny(1 - above * below)
    down_front, up_back = through_above * gain, through_below * gain
    # The elements before a layer end at its top; those after it begin at its bottom.
    top, bottom = slice(1, -1, 2), slice(2, None, 2)
    return RegularFields(
        reflection=below[0],
        transmission=through_below[0],
        down_from_front=down_front[top],
        up_from_front=(down_front * below)[bottom],
        down_from_back=(up_back * above)[top],
        up_from_back=up_back[bottom],
        cosines=cosines[1:-1],
        interfaces=interfaces,
        arriving_from_front=down_front[:-1:2],
        arriving_from_back=up_back[1::2],
        returning_from_front=(down_front * below)[1::2],
        returning_from_back=(up_back * above)[:-1:2],
    )
