"""Star product: elements put in front of what lies below, from the back of a stack to its front.

Elements that are diagonal in the channels (smooth interfaces, clear layers) stay vectors as long as they can.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.numerics.linear_algebra import inverse, resolvent, transpose


def at_least_tiny(value):
    """Keep light that is trapped without loss, which nothing excites, from dividing by zero."""
    return jnp.maximum(value, 1e-12)


# Reflectance seen from above and from below, and transmittance, of no element at all.
NOTHING = (0.0, 0.0, 1.0)


def join(upper, lower):
    """Join two elements that are diagonal in the channels: (from above, from below, through)."""
    if lower is NOTHING:
        return upper
    (a, a_below, t), (b, b_below, u) = upper, lower
    gain = 1 / at_least_tiny(1 - a_below * b)
    return a + t**2 * gain * b, b_below + u**2 * gain * a_below, t * gain * u


class RoughElement(eqx.Module):
    """A rough interface in the basis of fluxes, as seen from above and from below.

    ``one_above`` and ``one_down`` are the parts of reflection and transmission that meet one facet only.
    """

    above: Float[Array, "orders channels channels"]
    below: Float[Array, "orders channels channels"]
    down: Float[Array, "orders channels channels"]
    up: Float[Array, "orders channels channels"]
    one_above: Float[Array, "orders channels channels"]
    one_down: Float[Array, "orders channels channels"]


class Below(NamedTuple):
    """What lies below: vectors where it is diagonal in the channels, None where there is nothing."""

    reflection: Array | None
    transmission: Array | None
    is_symmetric: bool


NOTHING_BELOW = Below(None, None, True)


def add_diagonal(element, below: Below) -> Below:
    """Put an element that is diagonal in the channels in front of what lies below."""
    if element is NOTHING:
        return below
    reflection, transmission, is_symmetric = below
    above, under, t = element
    if reflection is None:
        return Below(above, t, True)
    if reflection.ndim == 1:
        above, _, through = join(element, (reflection, 0.0, transmission))
        return Below(above, through, True)
    if is_symmetric:
        between = resolvent(under, reflection) * t
    else:
        between = inverse(jnp.eye(t.shape[0]) - under[:, None] * reflection) * t
    return Below(jnp.diag(above) + t[:, None] * (reflection @ between), transmission @ between, is_symmetric)


def add_layer(layer_reflection, layer_transmission, below: Below) -> Below:
    """Put a scattering layer in front of what lies below."""
    reflection, transmission, is_symmetric = below
    if reflection is None:
        return Below(layer_reflection, layer_transmission, True)
    if reflection.ndim == 1:
        # (1 - R r)^-1 is the transpose of (1 - r R)^-1, for symmetric R.
        between = transpose(resolvent(reflection, layer_reflection)) @ layer_transmission
        onward = transmission[:, None] * between
        back = reflection[:, None] * between
    else:
        identity = jnp.eye(layer_reflection.shape[-1])
        between = inverse(identity - layer_reflection @ reflection) @ layer_transmission
        onward, back = transmission @ between, reflection @ between
    return Below(layer_reflection + layer_transmission @ back, onward, is_symmetric)


def add_rough(element: RoughElement, below: Below) -> Below:
    """Put a rough interface in front of what lies below."""
    reflection, transmission, _ = below
    if reflection is None:
        return Below(element.above, element.down, False)
    if reflection.ndim == 1:
        reflection, transmission = jnp.diag(reflection), jnp.diag(transmission)
    identity = jnp.eye(reflection.shape[-1])
    between = inverse(identity - element.below @ reflection) @ element.down
    return Below(element.above + element.up @ (reflection @ between), transmission @ between, False)
