"""Star product: elements are added from the back of a stack to its front.

Elements diagonal in the channels (smooth interfaces, clear layers) remain vectors as long as possible.
"""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.numerics.linear_algebra import at_least_tiny, inverse, resolvent, transpose

# The empty element: reflectance seen from above and from below, and transmittance.
NOTHING = (0.0, 0.0, 1.0)


def join(upper, lower):
    """Star product of two diagonal elements: reflectance from above and from below, transmittance."""
    return upper if lower is NOTHING else _joined(upper, lower)


# Jitted separately: traced once for all interfaces of all programs.
@jax.jit
def _joined(upper, lower):
    (a, a_below, t), (b, b_below, u) = upper, lower
    gain = 1 / at_least_tiny(1 - a_below * b)
    return a + t**2 * gain * b, b_below + u**2 * gain * a_below, t * gain * u


class RoughElement(eqx.Module):
    """A rough interface in the basis of fluxes, as seen from above and from below.

    ``one_above``, ``one_below`` and ``one_down`` are the parts of reflection and transmission that meet only
    one facet. ``regular`` holds the regular reflectances of both sides and the regular transmittance, which
    the first four include; None if there is no regular light.
    """

    above: Float[Array, "orders channels channels"]
    below: Float[Array, "orders channels channels"]
    down: Float[Array, "orders channels channels"]
    up: Float[Array, "orders channels channels"]
    one_above: Float[Array, "orders channels channels"]
    one_below: Float[Array, "orders channels channels"]
    one_down: Float[Array, "orders channels channels"]
    regular: tuple | None = None


class FromBehind(NamedTuple):
    """What becomes of ideally diffuse light v that enters from behind (azimuthal order 0, basis of fluxes).

    ``passed`` is T^T v, which leaves at the front, shape ``(channels,)``; ``returned`` is v R' v, where R' is
    the reflection seen from behind.
    """

    passed: Array
    returned: Array | float

    def after(self, under, resolved, between) -> "FromBehind":
        """The same with one more element in front, which reflects light from below by ``under``.

        With R the reflection of what is below, ``resolved`` is (1 - under R)^-1 and ``between`` gives the
        light that comes down to R from that above.
        """
        returned = self.passed @ _times(resolved, _times(under, self.passed))
        return FromBehind(_times(_transpose_of(between), self.passed), self.returned + returned)


def _times(element, light):
    """Apply an element, diagonal or not, to light of azimuthal order 0."""
    if jnp.ndim(element) < 2:
        return element * light
    return (element if element.ndim == 2 else element[0]) @ light


def _transpose_of(element):
    """Transpose of an element that may be diagonal."""
    return element if jnp.ndim(element) < 2 else transpose(element)


class Below(NamedTuple):
    """Everything below: vectors if diagonal in the channels, None if there is nothing.

    ``from_behind`` is None if it is not needed.
    """

    reflection: Array | None
    transmission: Array | None
    is_symmetric: bool
    from_behind: FromBehind | None = None

    def seen_through(self, under, resolved, between) -> FromBehind | None:
        """Light from behind with one more element in front, see `FromBehind.after`."""
        return self.from_behind and self.from_behind.after(under, resolved, between)


def add_diagonal(element, below: Below) -> Below:
    """Add an element that is diagonal in the channels."""
    if element is NOTHING:
        return below
    reflection, transmission, is_symmetric, _ = below
    above, under, t = element
    if reflection is None:
        return Below(above, t, True, below.seen_through(under, 1.0, t))
    if reflection.ndim == 1:
        resolved = 1 / at_least_tiny(1 - under * reflection)
        above, _, through = join(element, (reflection, 0.0, transmission))
        return Below(above, through, True, below.seen_through(under, resolved, resolved * t))
    if is_symmetric:
        resolved = resolvent(under, reflection)
    else:
        resolved = inverse(jnp.eye(t.shape[0]) - under[:, None] * reflection)
    between = resolved * t
    return Below(
        jnp.diag(above) + t[:, None] * (reflection @ between),
        transmission @ between,
        is_symmetric,
        below.seen_through(under, resolved, between),
    )


def add_layer(layer_reflection, layer_transmission, below: Below) -> Below:
    """Add a scattering layer."""
    reflection, transmission, is_symmetric, _ = below
    if reflection is None:
        from_behind = below.seen_through(layer_reflection, 1.0, layer_transmission)
        return Below(layer_reflection, layer_transmission, True, from_behind)
    if reflection.ndim == 1:
        # (1 - R r)^-1 is the transpose of (1 - r R)^-1, for symmetric R.
        resolved = transpose(resolvent(reflection, layer_reflection))
        between = resolved @ layer_transmission
        onward = transmission[:, None] * between
        back = reflection[:, None] * between
    else:
        identity = jnp.eye(layer_reflection.shape[-1])
        resolved = inverse(identity - layer_reflection @ reflection)
        between = resolved @ layer_transmission
        onward, back = transmission @ between, reflection @ between
    from_behind = below.seen_through(layer_reflection, resolved, between)
    return Below(layer_reflection + layer_transmission @ back, onward, is_symmetric, from_behind)


def add_rough(element: RoughElement, below: Below) -> Below:
    """Add a rough interface."""
    reflection, transmission, _, _ = below
    if reflection is None:
        from_behind = below.seen_through(element.below, 1.0, element.down)
        return Below(element.above, element.down, False, from_behind)
    if reflection.ndim == 1:
        reflection, transmission = jnp.diag(reflection), jnp.diag(transmission)
    identity = jnp.eye(reflection.shape[-1])
    resolved = inverse(identity - element.below @ reflection)
    between = resolved @ element.down
    from_behind = below.seen_through(element.below, resolved, between)
    return Below(
        element.above + element.up @ (reflection @ between), transmission @ between, False, from_behind
    )


class Pile(NamedTuple):
    """A stack being built from the back to the front; diagonal elements are joined first.

    Parameters
    ----------
    below
        Everything below the diagonal elements ``run``.
    run
        These elements, joined.
    damping
        Factor of a lateral displacement at one lateral frequency; None if displacements do not matter. The
        first path in and the last path out are known and left out.
    way
        Lateral displacement of one passage through ``run``. Reflections within it are so weak that only the
        first round trip counts.
    regular
        Regular reflectances and transmittance of everything below.
    """

    below: Below
    damping: Callable | None = None
    run: tuple = NOTHING
    way: Array | float = 0.0
    regular: tuple = NOTHING

    def with_diagonal(self, element, way=0.0) -> "Pile":
        """Add a smooth interface or a clear layer."""
        if self.damping is None or self.run is NOTHING:
            return self._replace(run=join(element, self.run), way=self.way + way)
        (a, a_below, t), (b, b_below, u) = element, self.run
        gain = 1 / at_least_tiny(1 - a_below * b)
        above = a + t**2 * self.damping(2 * way) * gain * b
        under = b_below + u**2 * self.damping(2 * self.way) * gain * a_below
        return self._replace(run=(above, under, t * gain * u), way=self.way + way)

    def closed(self, is_front=False) -> "Pile":
        """Add the joined diagonal elements to what is below them.

        At the front, what these elements reflect themselves is left out: light from below them would lose its
        digits in the sum if they transmit little of it.
        """
        if self.run is NOTHING:
            return self
        above, under, t = self.run
        if is_front:
            above = jnp.zeros_like(t)
        regular = join((above, under, t), self.regular)
        if self.damping is None:
            below = add_diagonal((above, under, t), self.below)
        elif self.below.reflection is None:
            # Negative factors have no square root, which the resolvent of symmetric reflections needs.
            from_behind = self.below.seen_through(under, 1.0, t)
            below = Below(jnp.diag(above), jnp.diag(t), False, from_behind)
        else:
            through = t if is_front else t * self.damping(self.way)
            below = add_diagonal((above, under, through), self.below)
        return self._replace(below=below, run=NOTHING, way=0.0, regular=regular)

    def with_layer(self, reflection, transmission, undeviated) -> "Pile":
        """Add a scattering layer; ``undeviated`` is its regular transmittance."""
        pile = self.closed()
        regular = join((0.0, 0.0, undeviated), pile.regular)
        return pile._replace(below=add_layer(reflection, transmission, pile.below), regular=regular)

    def with_rough(self, element: RoughElement) -> "Pile":
        """Add a rough interface to the stack."""
        pile = self.closed()
        nothing = jnp.zeros(element.down.shape[-1])
        regular = join(element.regular or (nothing, nothing, nothing), pile.regular)
        return pile._replace(below=add_rough(element, pile.below), regular=regular)
