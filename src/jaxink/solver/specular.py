"""Regular light in a stack: undeviated or specular, a number for each channel."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxink.numerics.linear_algebra import at_least_tiny
from jaxink.optics.directions import Directions
from jaxink.optics.fresnel import fresnel_reflectance, propagating_cosine


class RegularFields(eqx.Module):
    """Regular light of unit flux in each channel, from the front and from the back.

    Parameters
    ----------
    reflection, transmission
        Regular reflectance at the front and transmittance, shape ``(channels,)``.
    down_from_front, up_from_front
        For each layer: flux going down at its top and going up at its bottom, just inside, shape
        ``(layers, channels)``.
    down_from_back, up_from_back
        The same for light that enters at the back.
    cosines
        Cosine of the channel in each layer.
    interfaces
        Fresnel reflectance of each interface, shape ``(layers + 1, channels)``.
    arriving_from_front, arriving_from_back
        Flux that comes to each interface from its front, and from its back, for light that enters at the
        front and at the back respectively, shape ``(layers + 1, channels)``.
    returning_from_front, returning_from_back
        The same from its other side: after a reflection beyond.
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
    """Regular light along the incidence and along the way out of each point.

    Parameters
    ----------
    directions
        The points.
    kappa
        n sin(theta) of all incidences and, after them, of all ways out.
    way_out
        Position in ``kappa`` of each point's way out; that of its incidence is the same as in the points.
    fields_in, fields_out
        The light, shape ``(..., points)``.
    """

    directions: Directions
    kappa: Float[Array, " directions"]
    way_out: Int[Array, " points"]
    fields_in: RegularFields
    fields_out: RegularFields


def attenuation(optical_thickness, cosine):
    """exp(-tau/mu), and 0 in an evanescent or grazing channel."""
    inside = cosine > 0
    return jnp.where(inside, jnp.exp(-optical_thickness / jnp.where(inside, cosine, 1.0)), 0.0)


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
) -> RegularFields:
    """Regular light in every layer, with all multiple reflections, incoherently.

    Parameters
    ----------
    indices
        Refractive indices of front, layers and back.
    squared_cosine
        mu^2 of the wanted channels in each of them; negative where evanescent.
    optical_thickness
        Optical thickness of each layer: the true one for what a detector sees in the regular direction, the
        truncated one for the light that is scattered further.
    kept
        As of `Stack.kept_regular`.
    """
    cosines = propagating_cosine(squared_cosine)
    interfaces = fresnel_reflectance(indices[:-1, None], indices[1:, None], cosines[:-1], cosines[1:])
    inside = attenuation(optical_thickness[:, None], cosines[1:-1])
    # Interfaces and layers in turn, from the front to the back: reflection of either side, transmission.
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
    # A layer's top is where the elements before it end, its bottom where those after it begin.
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
