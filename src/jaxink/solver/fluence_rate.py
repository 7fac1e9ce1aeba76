"""Fluence inside a scattering layer for light of every incidence, and light that leaves it from inside.

The fluence is the radiance integrated over all directions. By reciprocity, an isotropic source at a depth
sends to a direction what light incident from that direction brings to the depth: the radiance outside is
(n_out / n)^2 / (4 pi) times the power that the source emits per area, times the fluence per irradiance. Only
azimuthal order 0 matters.
"""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.linear_algebra import inverse, transpose
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.solver.config import SolverConfig
from jaxink.solver.layer_response import respond
from jaxink.solver.phase_matrices import phase_matrices
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.specular import RegularFields, attenuation
from jaxink.solver.stack import Stack
from jaxink.solver.stack_channels import StackChannels, put_on_channels
from jaxink.solver.star_product import (
    Below,
    DiagonalBelow,
    MixedBelow,
    Nothing,
    RoughElement,
    add_diagonal,
    add_layer,
    add_rough,
)

# Gauss-Legendre depths of a layer. Twice as many change integrals over the depth by less than 1e-4 up to an
# optical thickness of 30.
DEPTHS, DEPTH_WEIGHTS = gauss_legendre_unit(12)


class Fluence(eqx.Module):
    """Fluence per irradiance of the incident light, at `DEPTHS` of some layers.

    Parameters
    ----------
    from_front, from_back
        For light incident from the front and from the back, shape ``(depths, directions)``; the layers follow
        each other along the first axis.
    """

    from_front: Float[Array, "depths directions"]
    from_back: Float[Array, "depths directions"]


def fluence(
    stack: Stack,
    plan: ChannelPlan,
    config: SolverConfig,
    kappa: Float[Array, " directions"],
    layers: tuple[int, ...],
) -> Fluence:
    """Fluence in scattering layers, for light incident from each side.

    Parameters
    ----------
    stack, plan, config
        See `diffuse_bsdf`. A lateral field is ignored: all light counts, wherever it is.
    kappa
        n sin(theta) of the incident light.
    layers
        Positions of the layers.
    """
    channels = put_on_channels(stack, plan, dataclasses.replace(config, n_orders=1), kappa)
    each = [_in_layer(stack, channels, config, kappa, k) for k in layers]
    return Fluence(*(jnp.concatenate(side) for side in zip(*each, strict=True)))


def _in_layer(stack, channels: StackChannels, config, kappa, k: int) -> tuple[Array, ...]:
    """Fluence in layer ``k`` from the front and from the back, shape ``(depths, directions)``."""
    cosine = channels.fields.cosines[k]
    inside = cosine > 0
    # From the flux of each channel to its fluence.
    slant = jnp.where(inside, 1 / jnp.where(inside, cosine, 1.0), 0.0)
    seen = _seen_from_depths(stack, channels, config, k)
    sides = (
        (*seen, channels.escape[0], channels.escape_beyond[0]),
        (*seen[::-1], channels.escape[1], channels.escape_beyond[1]),
    )
    rows = transpose(channels.grid.interpolation(kappa))
    # A clear layer neither absorbs nor emits.
    thickness = channels.scattering[k].truncated.optical_thickness
    regular = _regular(channels.fields, k, thickness)
    regular_beyond = _regular(channels.fields_beyond, k, thickness)
    found = []
    for (near, far, escape, escape_beyond), here, beyond in zip(sides, regular, regular_beyond, strict=True):
        smooth = (_arriving(near, far, channels.scale * slant) / channels.scale - here) / escape
        found.append((smooth @ rows) * escape_beyond + beyond)
    return tuple(found)


class _Seen(NamedTuple):
    """What lies to one side of each depth: reflection, and transmission from the depth to the outside."""

    reflection: Float[Array, "depths channels channels"]
    transmission: Float[Array, "depths channels channels"]


def _seen_from_depths(stack, channels: StackChannels, config, k: int) -> tuple[_Seen, _Seen]:
    """What lies in front of each depth of layer ``k``, and behind it, for azimuthal order 0."""
    optics, cosine = channels.scattering[k].truncated, channels.fields.cosines[k]
    safe_cosine = jnp.where(cosine > 0, cosine, 1.0)
    weight = channels.grid.etendue_weight / (stack.layers[k].refractive_index ** 2 * safe_cosine)
    a_matrix, b_matrix, _ = phase_matrices(optics, cosine, weight, 1)
    half = optics.optical_thickness / 2
    # The depths are symmetric: counted from either face, the parts between them are equally thick.
    shares = jnp.asarray(np.diff(DEPTHS, prepend=0.0))
    parts = jax.vmap(lambda share: respond(config.layer_method, a_matrix, b_matrix, share * half))(shares)
    last = len(stack.layers)
    front, back = _outside(stack, channels, range(k + 1)), _outside(stack, channels, range(last, k, -1))
    # Both sides take the place of the azimuthal orders.
    start = MixedBelow(
        jnp.concatenate([front.reflection, back.reflection]),
        jnp.concatenate([front.transmission, back.transmission]),
        False,
    )

    def step(outside, part):
        inwards = add_layer(*part, outside)
        return inwards, _Seen(inwards.reflection, inwards.transmission)

    _, (reflection, transmission) = jax.lax.scan(step, start, parts)
    return (
        _Seen(reflection[:, 0], transmission[:, 0]),
        _Seen(reflection[::-1, 1], transmission[::-1, 1]),
    )


def _outside(stack, channels: StackChannels, interfaces: range) -> _Seen:
    """All elements from one of the surroundings to an emitting layer, seen from there, for order 0.

    ``interfaces`` are counted inwards: upwards from the front, downwards from the back.
    """
    is_front = interfaces.step > 0
    outermost, *inner = interfaces
    has_backing = stack.backing is not None and not is_front
    below = _with_interface(
        channels, outermost, is_front, _backing(stack, channels) if has_backing else Nothing()
    )
    for k in inner:
        below = _with_layer(stack, channels, k if not is_front else k - 1, below)
        below = _with_interface(channels, k, is_front, below)
    if isinstance(below, DiagonalBelow):
        return _Seen(jnp.diag(below.reflection)[None], jnp.diag(below.transmission)[None])
    return _Seen(below.reflection, below.transmission)


def _with_interface(
    channels: StackChannels, k: int, is_front: bool, below: Below
) -> DiagonalBelow | MixedBelow:
    """Add an interface, turned round if it belongs to what lies in front."""
    if k not in channels.rough:
        r = channels.fields.interfaces[k]
        return add_diagonal((r, r, 1 - r), below)
    element = channels.rough[k].element
    sides = (element.above, element.below, element.down, element.up)
    order = (1, 0, 3, 2) if is_front else (0, 1, 2, 3)
    above, under, down, up = (sides[i][:1] for i in order)
    return add_rough(RoughElement(above, under, down, up, above, under, down), below)


def _with_layer(
    stack, channels: StackChannels, k: int, below: DiagonalBelow | MixedBelow
) -> DiagonalBelow | MixedBelow:
    if k in channels.scattering:
        layer = channels.scattering[k]
        return add_layer(layer.reflection, layer.transmission, below)
    thickness, cosine = stack.layers[k].optical_thickness, channels.fields.cosines[k]
    dark = jnp.zeros_like(cosine)
    return add_diagonal((dark, dark, attenuation(thickness, cosine)), below)


def _backing(stack, channels: StackChannels) -> MixedBelow:
    """An ideally diffuse reflector, behind which nothing leaves."""
    reaches = channels.grid.squared_cosine(stack.index_back) > 0
    sent = jnp.where(reaches, jnp.sqrt(channels.grid.etendue_weight), 0.0)
    reflection = stack.backing * sent[:, None] * sent / (sent @ sent)
    return MixedBelow(reflection[None], jnp.zeros_like(reflection)[None], False)


def _arriving(near: _Seen, far: _Seen, counted: Float[Array, " channels"]) -> Float[Array, "depths channels"]:
    """Sum, weighted by ``counted``, of the light at each depth that comes through the near side."""
    identity = jnp.eye(counted.shape[0])
    back, again = transpose(far.reflection), transpose(near.reflection)
    both = (identity + back) @ counted
    resolved = inverse(identity - back @ again)
    return jnp.einsum("doc,dci,di->do", near.transmission, resolved, both)


def _regular(fields: RegularFields, k: int, thickness) -> tuple[Array, Array]:
    """Fluence of the regular light in layer ``k`` from the front and from the back."""
    cosine = fields.cosines[k]
    inside = cosine > 0
    passed = attenuation(thickness * DEPTHS[:, None], cosine)
    left = attenuation(thickness * (1 - DEPTHS[:, None]), cosine)
    slant = jnp.where(inside, 1 / jnp.where(inside, cosine, 1.0), 0.0)
    return tuple(
        (down[k] * passed + up[k] * left) * slant
        for down, up in (
            (fields.down_from_front, fields.up_from_front),
            (fields.down_from_back, fields.up_from_back),
        )
    )
