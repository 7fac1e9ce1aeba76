"""Star product: elements are added from the back of a stack to its front.

Elements diagonal in the channels (smooth interfaces, clear layers) remain vectors as long as possible.
"""

from collections.abc import Callable
from typing import NamedTuple, overload

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.linear_algebra import at_least_tiny, inverse, resolvent, transpose

# An element that is diagonal in the channels: reflectance from above and from below, and transmittance.
Diagonal = tuple[Array, Array, Array]


def join(upper: Diagonal, lower: Diagonal | None) -> Diagonal:
    """Star product of two diagonal elements, or the upper one if there is nothing below it."""
    return upper if lower is None else _joined(upper, lower)


# Jitted separately: traced once for all interfaces of all programs.
@jax.jit
def _joined(upper, lower):
    (a, a_below, t), (b, b_below, u) = upper, lower
    gain = 1 / at_least_tiny(1 - a_below * b)
    return a + t**2 * gain * b, b_below + u**2 * gain * a_below, t * gain * u


class RoughElement(eqx.Module):
    """A rough interface in the basis of fluxes, as seen from above and from below.

    ``one_above``, ``one_below`` and ``one_down`` are the parts of reflection and transmission that meet only
    one facet. ``regular`` is its regular light, which the first four include; None if there is none.
    """

    above: Float[Array, "orders channels channels"]
    below: Float[Array, "orders channels channels"]
    down: Float[Array, "orders channels channels"]
    up: Float[Array, "orders channels channels"]
    one_above: Float[Array, "orders channels channels"]
    one_below: Float[Array, "orders channels channels"]
    one_down: Float[Array, "orders channels channels"]
    regular: Diagonal | None = None


class BackingResponse(NamedTuple):
    """Ideally diffuse light from a backing, and what becomes of it (azimuthal order 0, basis of fluxes).

    ``reflectance`` is that of the backing, and ``light``, v, is what it sends. ``passed`` is T^T v, which
    leaves at the front, shape ``(channels,)``; ``returned`` is v R' v, where R' is the reflection seen from
    behind.
    """

    reflectance: Array
    light: Array
    passed: Array
    returned: Array | float

    @classmethod
    def of(cls, reflectance, light) -> "BackingResponse":
        """With nothing in front of the backing."""
        return cls(reflectance, light, light, 0.0)

    def after(self, under, resolved, between) -> "BackingResponse":
        """The same with one more element in front, which reflects light from below by ``under``.

        With R the reflection of what is below, ``resolved`` is (1 - under R)^-1 and ``between`` gives the
        light that comes down to R from that above.
        """
        returned = self.passed @ _times(resolved, _times(under, self.passed))
        passed = _times(_transpose_of(between), self.passed)
        return self._replace(passed=passed, returned=self.returned + returned)


def _times(element, light):
    """Apply an element, diagonal or not, to light of azimuthal order 0."""
    if jnp.ndim(element) < 2:
        return element * light
    return (element if element.ndim == 2 else element[0]) @ light


def _transpose_of(element):
    """Transpose of an element that may be diagonal."""
    return element if jnp.ndim(element) < 2 else transpose(element)


class Nothing(NamedTuple):
    """No element below; here and beside, ``from_behind`` is None if it is not needed."""

    from_behind: BackingResponse | None = None


class DiagonalBelow(NamedTuple):
    """Everything below, if all of it is diagonal in the channels."""

    reflection: Float[Array, " channels"]
    transmission: Float[Array, " channels"]
    from_behind: BackingResponse | None = None


class MixedBelow(NamedTuple):
    """Everything below, if some of it sends light from one channel to others."""

    reflection: Float[Array, "*orders channels channels"]
    transmission: Float[Array, "*orders channels channels"]
    is_symmetric: bool
    from_behind: BackingResponse | None = None


Below = Nothing | DiagonalBelow | MixedBelow


def _seen_through(below: Below, under, resolved, between) -> BackingResponse | None:
    """Light from behind with one more element in front, see `BackingResponse.after`."""
    return below.from_behind and below.from_behind.after(under, resolved, between)


@overload
def add_diagonal(element: Diagonal, below: Nothing | DiagonalBelow) -> DiagonalBelow: ...
@overload
def add_diagonal(element: Diagonal, below: MixedBelow) -> MixedBelow: ...
def add_diagonal(element: Diagonal, below: Below) -> DiagonalBelow | MixedBelow:
    """Add an element that is diagonal in the channels."""
    above, under, t = element
    if isinstance(below, Nothing):
        return DiagonalBelow(above, t, _seen_through(below, under, 1.0, t))
    if isinstance(below, DiagonalBelow):
        resolved = 1 / at_least_tiny(1 - under * below.reflection)
        return DiagonalBelow(
            above + t**2 * resolved * below.reflection,
            t * resolved * below.transmission,
            _seen_through(below, under, resolved, resolved * t),
        )
    if below.is_symmetric:
        resolved = resolvent(under, below.reflection)
    else:
        resolved = inverse(jnp.eye(t.shape[0]) - under[:, None] * below.reflection)
    between = resolved * t
    return MixedBelow(
        jnp.diag(above) + t[:, None] * (below.reflection @ between),
        below.transmission @ between,
        below.is_symmetric,
        _seen_through(below, under, resolved, between),
    )


def add_layer(layer_reflection: Array, layer_transmission: Array, below: Below) -> MixedBelow:
    """Add a scattering layer."""
    if isinstance(below, Nothing):
        from_behind = _seen_through(below, layer_reflection, 1.0, layer_transmission)
        return MixedBelow(layer_reflection, layer_transmission, True, from_behind)
    if isinstance(below, DiagonalBelow):
        # (1 - R r)^-1 is the transpose of (1 - r R)^-1, for symmetric R.
        resolved = transpose(resolvent(below.reflection, layer_reflection))
        between = resolved @ layer_transmission
        onward = below.transmission[:, None] * between
        back = below.reflection[:, None] * between
        is_symmetric = True
    else:
        identity = jnp.eye(layer_reflection.shape[-1])
        resolved = inverse(identity - layer_reflection @ below.reflection)
        between = resolved @ layer_transmission
        onward, back = below.transmission @ between, below.reflection @ between
        is_symmetric = below.is_symmetric
    from_behind = _seen_through(below, layer_reflection, resolved, between)
    return MixedBelow(layer_reflection + layer_transmission @ back, onward, is_symmetric, from_behind)


def add_rough(element: RoughElement, below: Below) -> MixedBelow:
    """Add a rough interface."""
    if isinstance(below, Nothing):
        from_behind = _seen_through(below, element.below, 1.0, element.down)
        return MixedBelow(element.above, element.down, False, from_behind)
    reflection, transmission = below.reflection, below.transmission
    if isinstance(below, DiagonalBelow):
        reflection, transmission = jnp.diag(reflection), jnp.diag(transmission)
    identity = jnp.eye(reflection.shape[-1])
    resolved = inverse(identity - element.below @ reflection)
    between = resolved @ element.down
    from_behind = _seen_through(below, element.below, resolved, between)
    return MixedBelow(
        element.above + element.up @ (reflection @ between), transmission @ between, False, from_behind
    )


class StackAssembly(NamedTuple):
    """A stack being built from the back to the front; diagonal elements are joined first.

    Parameters
    ----------
    below
        Everything below the diagonal elements ``run``.
    damping
        Factor of a lateral displacement at one lateral frequency; None if displacements do not matter. The
        first path in and the last path out are known and left out.
    run
        These elements, joined; None if there are none.
    way
        Lateral displacement of one passage through ``run``. Reflections within it are so weak that only the
        first round trip counts.
    regular
        Regular light of everything below; None if that is nothing.
    """

    below: Below
    damping: Callable | None = None
    run: Diagonal | None = None
    way: Array | float = 0.0
    regular: Diagonal | None = None

    def with_diagonal(self, element: Diagonal, way: Array | float = 0.0) -> "StackAssembly":
        """Add a smooth interface or a clear layer."""
        if self.damping is None or self.run is None:
            return self._replace(run=join(element, self.run), way=self.way + way)
        (a, a_below, t), (b, b_below, u) = element, self.run
        gain = 1 / at_least_tiny(1 - a_below * b)
        above = a + t**2 * self.damping(2 * way) * gain * b
        under = b_below + u**2 * self.damping(2 * self.way) * gain * a_below
        return self._replace(run=(above, under, t * gain * u), way=self.way + way)

    def closed(self, is_front=False) -> "StackAssembly":
        """Add the joined diagonal elements to what is below them.

        At the front, what these elements reflect themselves is left out: light from below them would lose its
        digits in the sum if they transmit little of it.
        """
        if self.run is None:
            return self
        above, under, t = self.run
        if is_front:
            above = jnp.zeros_like(t)
        regular = join((above, under, t), self.regular)
        below: Below
        if self.damping is None:
            below = add_diagonal((above, under, t), self.below)
        elif isinstance(self.below, Nothing):
            # Negative factors have no square root, which the resolvent of symmetric reflections needs.
            from_behind = _seen_through(self.below, under, 1.0, t)
            below = MixedBelow(jnp.diag(above), jnp.diag(t), False, from_behind)
        else:
            through = t if is_front else t * self.damping(self.way)
            below = add_diagonal((above, under, through), self.below)
        return self._replace(below=below, run=None, way=0.0, regular=regular)

    def with_layer(self, reflection: Array, transmission: Array, undeviated: Array) -> "StackAssembly":
        """Add a scattering layer; ``undeviated`` is its regular transmittance."""
        pile = self.closed()
        dark = jnp.zeros_like(undeviated)
        regular = join((dark, dark, undeviated), pile.regular)
        return pile._replace(below=add_layer(reflection, transmission, pile.below), regular=regular)

    def with_rough(self, element: RoughElement) -> "StackAssembly":
        """Add a rough interface to the stack."""
        pile = self.closed()
        nothing = jnp.zeros(element.down.shape[-1])
        regular = join(element.regular or (nothing, nothing, nothing), pile.regular)
        return pile._replace(below=add_rough(element, pile.below), regular=regular)

    def whole(self) -> tuple[MixedBelow, Diagonal]:
        """The finished stack and its regular light; see `closed` for what is left out at the front.

        Raises
        ------
        InputRefusedError
            If no element sends light from one channel to others.
        """
        pile = self.closed(is_front=True)
        if not isinstance(pile.below, MixedBelow) or pile.regular is None:
            raise InputRefusedError("no layer of the stack scatters; give it a ScatteringLayer.")
        return pile.below, pile.regular
