"""How a stack is solved: which channels it needs, found once from the refractive indices of its media."""

from collections.abc import Collection, Sequence

import equinox as eqx
import jax.numpy as jnp

from jaxink.errors import InputRefusedError
from jaxink.numerics.validity import is_known
from jaxink.optics.channels import ChannelGrid
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack
from jaxink.surfaces.interface import RoughInterface

# Relative difference below which two fixed indices are one.
_EQUAL = 1e-5


class ChannelPlan(eqx.Module):
    """Which channels serve a stack, and others like it that differ in their numbers only.

    Media are positions in (front, layers..., back).

    Parameters
    ----------
    block_media
        Media whose refractive indices end the blocks of channels.
    exposed
        True where a scattering layer has the index of the surroundings, see `ChannelGrid`.
    rarest
        Media that have the lowest index of all, where it is fixed: a rough interface then need not look at
        the channels that do not propagate there.
    interfaces
        For each interface, what it does between the channels where that has been computed before; empty if
        nothing has.
    """

    block_media: tuple[int, ...] = eqx.field(static=True)
    exposed: bool = eqx.field(static=True, default=False)
    rarest: tuple[int, ...] = eqx.field(static=True, default=())
    interfaces: tuple[RoughInterface | None, ...] = ()

    def grid(self, stack: Stack, config: SolverConfig) -> ChannelGrid:
        """Channels of a stack."""
        scattering = {k + 1 for k in stack.scattering}
        # Of equal indices that of a scattering medium comes first: the block of the other one is then empty.
        media = sorted(self.block_media, key=lambda medium: medium not in scattering)
        ends = jnp.stack([stack.indices[medium] for medium in media])
        order = jnp.argsort(ends)
        scatters = jnp.array([medium in scattering for medium in media])
        n_trapped_blocks = len(self.block_media) - 1
        return ChannelGrid(
            ends[order],
            scatters[order],
            (config.nodes_escaping,) + (config.nodes_trapped,) * n_trapped_blocks,
            self.exposed,
        )

    def n_outer(self, stack: Stack, interface: int, config: SolverConfig) -> int | None:
        """Number of channels that propagate outside a rough interface, the first ones; None: perhaps all."""
        return config.nodes_escaping if stack.sides(interface)[0] in self.rarest else None

    def reversed(self, n_layers: int) -> "ChannelPlan":
        """The plan of the same stack lit from its other side, without interfaces."""
        last = n_layers + 1
        block_media, rarest = (
            tuple(sorted(last - medium for medium in media)) for media in (self.block_media, self.rarest)
        )
        return ChannelPlan(block_media, self.exposed, rarest)


def plan_channels(stack: Stack, free: Collection[int] = ()) -> ChannelPlan:
    """Plan which channels serve a stack.

    Parameters
    ----------
    stack
        The stack; its refractive indices must be known numbers.
    free
        Media, positions in (front, layers..., back), whose refractive index will take other values: their
        blocks of channels are kept wherever the index goes.

    Raises
    ------
    InputRefusedError
        If a refractive index is being differentiated or compiled, or no layer scatters.
    """
    if not is_known(stack.indices):
        raise InputRefusedError(
            "channels cannot be planned while a refractive index is being differentiated or compiled: plan "
            "them before, with plan_channels(stack, free) that names the positions of such indices, and pass "
            "them as plan."
        )
    if not stack.scattering:
        raise InputRefusedError("no layer of the stack scatters; give it a ScatteringLayer.")
    indices = [float(index) for index in stack.indices]
    scatters = [k - 1 in stack.scattering for k in range(len(indices))]
    varies = [k in free for k in range(len(indices))]
    return plan_media(indices, scatters, varies, stack.backing is not None)


def plan_media(
    indices: Sequence[float], scatters: Sequence[bool], free: Sequence[bool], has_backing: bool = False
) -> ChannelPlan:
    """The same as `plan_channels`, for `block_media` of front, layers and back, and a diffuse backing."""
    # A backing sends light in all directions, too.
    chosen = block_media(indices, [*scatters[:-1], has_backing], free)
    lowest = chosen[0]
    exposed = any(
        scatters[k] and not free[k] and abs(indices[k] / indices[lowest] - 1) < _EQUAL
        for k in range(len(indices))
    )
    rarest = tuple(
        k for k, n in enumerate(indices) if not free[lowest] and not free[k] and n == indices[lowest]
    )
    # Their order does not matter; in a fixed one stacks mostly share a compiled program.
    return ChannelPlan(tuple(sorted(chosen)), exposed, rarest)


def block_media(
    indices: Sequence[float], scattering: Sequence[bool], free: Sequence[bool]
) -> tuple[int, ...]:
    """Choose which media end the blocks of channels.

    Parameters
    ----------
    indices
        Refractive indices of front, layers and back.
    scattering, free
        For each: whether it scatters, and whether its index is a free parameter.

    Returns
    -------
    tuple[int, ...]
        Positions, by ascending index; equal fixed indices appear once, and nothing above the largest
        index of a scattering medium, where no light is ever scattered to.
    """
    largest = max(n for n, scatters in zip(indices, scattering, strict=True) if scatters)
    chosen: list[int] = []
    for medium in sorted(range(len(indices)), key=lambda i: (indices[i], not scattering[i])):
        if indices[medium] > largest * (1 + 1e-9) and not free[medium]:
            continue
        same = any(
            abs(indices[medium] / indices[other] - 1) < _EQUAL and not free[medium] and not free[other]
            for other in chosen
        )
        if not same:
            chosen.append(medium)
    return tuple(chosen)
