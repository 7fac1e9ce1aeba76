"""Resolution for a given accuracy, from the phase functions and the geometry of a stack.

What limits each number was measured with Henyey-Greenstein layers, see docs/validation/accuracy.md. Moments:
those that delta-M drops, weighted by the remaining light scattered into the forward peak. Streams: a block
resolves polynomials in the cosine of about two degrees per stream, over the part of the quarter circle that
it covers. Azimuthal orders: fewer if refraction keeps the light away from grazing.
"""

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.validity import is_known
from jaxink.optics import ScatteringLayer
from jaxink.solver.accuracy import DEFAULT_ACCURACY, require_accuracy
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import ChannelPlan, plan_channels
from jaxink.solver.stack import Stack

# Moments examined: Henyey-Greenstein's fall below 1e-4 by then up to an asymmetry parameter of 0.965.
_MOST_MOMENTS = 320
# Optical thickness below which the far side is seen at 89 degrees.
_THIN = 2.0


class Demand(eqx.Module):
    """What determines the resolution that a stack needs.

    Parameters
    ----------
    phase_moments
        Largest size of each Legendre moment among the scattering layers.
    optical_thickness
        Total optical thickness of the scattering layers.
    largest_sine, smallest_sine
        Sines, inside the scattering layers, of grazing light from the denser of the surroundings.
    escaping_sine
        The largest of these sines for the rarer of the surroundings.
    exposed
        See `ChannelPlan`.
    backward_peak
        Largest share of the scattering into a backward peak narrower than any resolution.
    rough
        Whether a face is rough: singly scattered light that meets it is no longer exact.
    """

    phase_moments: Float[Array, "*batch moments"]
    optical_thickness: Float[Array, "*batch"]
    largest_sine: Float[Array, "*batch"]
    smallest_sine: Float[Array, "*batch"]
    escaping_sine: Float[Array, "*batch"]
    backward_peak: Float[Array, "*batch"]
    exposed: bool = eqx.field(static=True)
    rough: bool = eqx.field(static=True, default=False)


def demand(stack: Stack, plan: ChannelPlan) -> Demand:
    """Find what determines the resolution of a stack."""
    layers = [layer for layer in stack.layers if isinstance(layer, ScatteringLayer)]
    first, *others = (layer.optical_thickness for layer in layers)
    moments = jnp.stack([layer.phase_function.moments(_MOST_MOMENTS) for layer in layers])
    outside = jnp.stack([stack.index_front, stack.index_back])
    sines = jnp.stack([jnp.max(outside) / layer.refractive_index for layer in layers])
    escaping = jnp.max(jnp.stack([jnp.min(outside) / layer.refractive_index for layer in layers]))
    return Demand(
        phase_moments=jnp.max(jnp.abs(moments), axis=0),
        optical_thickness=sum(others, start=first),
        largest_sine=jnp.minimum(jnp.max(sines), 1.0),
        smallest_sine=jnp.minimum(jnp.min(sines), 1.0),
        escaping_sine=jnp.minimum(escaping, 1.0),
        # Moments of a forward peak have one sign, those of a backward peak alternate.
        backward_peak=jnp.max(jnp.abs(moments[:, -1] - moments[:, -2])) / 2,
        exposed=plan.exposed,
        rough=bool(stack.rough),
    )


def require_resolvable(demand: Demand, accuracy: float) -> None:
    """Reject phase functions that no resolution describes.

    A narrow forward peak counts as unscattered light (delta-M), a narrow backward peak cannot.

    Raises
    ------
    InputRefusedError
        If a share of more than ten times the accuracy is scattered into such a peak.
    """
    peak = float(np.max(np.asarray(demand.backward_peak)))
    if peak > 10 * accuracy:
        raise InputRefusedError(
            f"a phase function scatters {peak:.2g} of the light into a backward peak too narrow to resolve "
            f"to an accuracy of {accuracy:g} (its Legendre moments alternate up to degree {_MOST_MOMENTS}); "
            "give a wider one, such as an asymmetry parameter nearer to 0, or a coarser accuracy."
        )


def sizes_for(
    demand: Demand, accuracy: float = DEFAULT_ACCURACY, layer_method: str = "fastest"
) -> SolverConfig:
    """Resolution that meets one or several demands within an accuracy.

    Parameters
    ----------
    demand
        Known numbers; several demands along the leading axis.
    accuracy
        Target for the largest relative error of the BSDF in any direction up to 89 degrees.
    layer_method
        See `SolverConfig`.
    """
    moments = np.atleast_2d(demand.phase_moments)
    sines = np.stack([demand.largest_sine, demand.smallest_sine, demand.escaping_sine], axis=-1)
    each = zip(moments, np.ravel(demand.optical_thickness), np.atleast_2d(sines), strict=True)
    sizes = np.max([_sizes(*one, demand.exposed, demand.rough, accuracy) for one in each], axis=0)
    escaping, trapped, n_moments, n_orders = sizes.tolist()
    return SolverConfig(escaping, trapped, n_moments, n_orders, layer_method)


def _sizes(moments, thickness, sines, exposed, rough, accuracy):
    """Streams of the escaping and of each trapped block, moments and orders."""
    # Strength of narrow features: eight times the light that was scattered at most twice.
    few = math.exp(-thickness) * (1 + thickness + thickness**2 / 2) if thickness < 700 else 0.0
    narrow = 1.0 if rough else min(1.0, 8 * few)
    sine = sines[0]
    cone, narrowest_cone, escaping_cone = (math.asin(s) / (math.pi / 2) for s in sines)
    digits = -math.log10(accuracy)

    def degree(factor, least_narrow):
        """Degree above which no moment exceeds the accuracy times a factor; relaxed for thick layers."""
        return _degree(moments, factor * accuracy / max(narrow, least_narrow))

    if exposed:
        n_moments = max(degree(2, 1.0), 4)
        # Near grazing a thin layer's radiance varies as exp(-thickness / cosine), and light scattered twice
        # in any layer, with the square of each moment, is dim and narrow.
        least = 18 * digits - 30 if thickness < _THIN else 6.2 * digits - 2
        twice = _degree(moments**2, accuracy / (2 + 8 * narrow))
        escaping = max(least, twice, 0.58 * degree(1 / 3, 0.02), n_moments / 2)
    else:
        n_moments = max(degree(1, 0.05), 4)
        near = min(_near_matched(sines[2], digits), 18 * digits - 30)
        escaping = max(4 * digits - 8, 0.58 * escaping_cone * degree(1 / 3, 0.02), 6, near)
    trapped = max(4 * digits - 8, (1 - narrowest_cone) / 2.7 * degree(1 / 2, 0.02), 6)
    if cone > escaping_cone:
        # Light trapped on the rarer side is seen from the denser one, where the radiance of a layer without
        # an index step varies as mu log(mu) near grazing.
        unrefracted = 6.2 * digits + 6 if sine > 1 - 1e-3 else 0
        trapped = max(trapped, 0.58 * (cone - escaping_cone) * degree(1 / 3, 0.02), unrefracted)
    # All streams together must integrate products of two polynomials of the phase function.
    trapped = max(trapped, n_moments / 1.7 - escaping)
    # From one grazing direction to another, light scattered twice stays narrow in any layer.
    highest = degree(1 / 10, 0.02)
    needed = sine * _degree(moments**2, accuracy / 10) if exposed else sine / 2.2 * highest
    orders = max(needed, 1.05 * digits + 1)
    return _even(escaping), _even(trapped), _even(n_moments), min(_even(orders), highest)


def _near_matched(escaping_sine, digits) -> float:
    """Streams for a layer whose index is near that of its surroundings.

    The radiance has a branch point where the cosine in the layer vanishes. A polynomial in the cosine outside
    converges by the ellipse through that point (Bernstein); the offset of one digit was measured.
    """
    point = -1 + 2j * math.sqrt(1 / escaping_sine**2 - 1)
    root = np.sqrt(point**2 - 1 + 0j)
    ellipse = max(abs(point + root), abs(point - root))
    return (digits - 1) / math.log10(ellipse) if ellipse > 1 else math.inf


def _degree(moments, limit) -> int:
    """Degree above which no moment exceeds a limit."""
    return int(np.max(np.flatnonzero(moments > limit), initial=0)) + 1


def _even(number: float) -> int:
    """Next even number, for similar stacks to share a compiled program."""
    return 2 * math.ceil(number / 2)


_demand = eqx.filter_jit(demand)


def choose_sizes(
    stack: Stack,
    accuracy: float = DEFAULT_ACCURACY,
    layer_method: str = "fastest",
    plan: ChannelPlan | None = None,
) -> SolverConfig:
    """Smallest resolution expected to keep the BSDF of a stack within an accuracy.

    Parameters
    ----------
    stack
        The stack, with known numbers.
    accuracy, layer_method
        See `sizes_for`.
    plan
        See `diffuse_bsdf`.

    Raises
    ------
    InputRefusedError
        If the accuracy is not between 1e-8 and 0.1, the stack is being differentiated or compiled, or a phase
        function has too narrow a backward peak.
    """
    require_accuracy(accuracy)
    if not is_known(stack):
        raise InputRefusedError(
            "the resolution cannot be chosen while a stack is being differentiated or compiled; "
            "choose it beforehand with choose_sizes(stack, accuracy) and pass it as config."
        )
    plan = plan_channels(stack) if plan is None else plan
    needed = _demand(stack, plan)
    require_resolvable(needed, accuracy)
    return sizes_for(needed, accuracy, layer_method)
