"""Channels that a stack needs, found once from the refractive indices of its media."""

from collections.abc import Collection, Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.validity import is_known
from jaxink.optics import ChannelGrid
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack
from jaxink.surfaces import RoughInterface

# Relative difference below which two fixed indices count as equal.
_EQUAL = 1e-5


class ChannelPlan(eqx.Module):
    """Channels of a stack and of all stacks that differ from it only in numbers.

    Media are given as positions in (front, layers..., back).

    Parameters
    ----------
    block_media
        Media whose refractive indices end the blocks of channels.
    exposed
        Whether a scattering layer has the index of the surroundings, see `ChannelGrid`.
    rarest
        Media of the lowest index, if it is fixed: a rough interface can then ignore the channels that do not
        propagate there.
    interfaces
        Those rough interfaces that have been computed beforehand, between the channels, by position.
    """

    block_media: tuple[int, ...] = eqx.field(static=True)
    exposed: bool = eqx.field(static=True, default=False)
    rarest: tuple[int, ...] = eqx.field(static=True, default=())
    interfaces: dict[int, RoughInterface] = eqx.field(default_factory=dict)

    def grid(self, stack: Stack, config: SolverConfig) -> ChannelGrid:
        """Channels of a stack."""
        return self.grid_of(stack.indices, stack.scattering, config)

    def grid_of(
        self, indices: Sequence[Float[Array, ""]], scattering_layers: Collection[int], config: SolverConfig
    ) -> ChannelGrid:
        """Channels of a stack.

        Parameters
        ----------
        indices
            Refractive indices of front, layers and back.
        scattering_layers
            Positions of the layers that scatter.
        config
            Numbers of channels.
        """
        scattering = {k + 1 for k in scattering_layers}
        # Of equal indices that of a scattering medium comes first; the block of the other one is then empty.
        media = sorted(self.block_media, key=lambda medium: medium not in scattering)
        ends = jnp.stack([indices[medium] for medium in media])
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
        """Number of channels, the first ones, that propagate outside a rough interface; None if unknown."""
        return config.nodes_escaping if stack.sides(interface)[0] in self.rarest else None

    def reversed(self, n_layers: int) -> "ChannelPlan":
        """The plan of the same stack illuminated from its other side, without interfaces."""
        last = n_layers + 1
        block_media, rarest = (
            tuple(sorted(last - medium for medium in media)) for media in (self.block_media, self.rarest)
        )
        return ChannelPlan(block_media, self.exposed, rarest)


def plan_channels(stack: Stack, free: Collection[int] = ()) -> ChannelPlan:
    """Plan the channels of a stack.

    Parameters
    ----------
    stack
        The stack, with known refractive indices.
    free
        Media, positions in (front, layers..., back), whose refractive index may change: each keeps its own
        block of channels.

    Raises
    ------
    InputRefusedError
        If a refractive index is being differentiated or compiled, or no layer scatters.
    """
    if not is_known(stack.indices):
        raise InputRefusedError(
            "channels cannot be planned while a refractive index is being differentiated or compiled; plan "
            "them beforehand with plan_channels(stack, free), where free gives the positions of these "
            "indices, and pass the result as plan."
        )
    if not stack.scattering:
        raise InputRefusedError("no layer of the stack scatters; give it a ScatteringLayer.")
    indices = [float(index) for index in stack.indices]
    scatters = [k - 1 in stack.scattering for k in range(len(indices))]
    varies = [k in free for k in range(len(indices))]
    return plan_media(indices, scatters, varies, has_backing=stack.backing is not None)


def plan_media(
    indices: Sequence[float],
    scatters: Sequence[bool],
    free: Sequence[bool],
    sources: Sequence[str] | None = None,
    has_backing: bool = False,
) -> ChannelPlan:
    """`plan_channels` from the arguments of `block_media`, and whether there is a diffuse backing."""
    # A backing also sends light in all directions.
    chosen = block_media(indices, [*scatters[:-1], has_backing], free, sources)
    lowest = chosen[0]
    exposed = any(
        scatters[k] and not free[k] and abs(indices[k] / indices[lowest] - 1) < _EQUAL
        for k in range(len(indices))
    )
    rarest = tuple(
        k for k, n in enumerate(indices) if not free[lowest] and not free[k] and n == indices[lowest]
    )
    # The order does not matter; a fixed one lets most stacks share a compiled program.
    return ChannelPlan(tuple(sorted(chosen)), exposed, rarest)


def block_media(
    indices: Sequence[float],
    scattering: Sequence[bool],
    free: Sequence[bool],
    sources: Sequence[str] | None = None,
) -> tuple[int, ...]:
    """Choose which media end the blocks of channels.

    Parameters
    ----------
    indices
        Refractive indices of front, layers and back.
    scattering, free
        Whether each scatters, and whether its index is a free parameter.
    sources
        What gives each index; media of the same source are of one index at all its values.

    Returns
    -------
    tuple[int, ...]
        Positions by ascending index. Equal fixed indices, and those of one source, appear once; indices above
        the largest of a scattering medium are left out, as no light is scattered there.
    """
    largest = max(n for n, scatters in zip(indices, scattering, strict=True) if scatters)
    chosen: list[int] = []
    for medium in sorted(range(len(indices)), key=lambda i: (indices[i], not scattering[i])):
        if indices[medium] > largest * (1 + 1e-9) and not free[medium]:
            continue
        same = any(
            (sources is not None and sources[medium] == sources[other])
            or (abs(indices[medium] / indices[other] - 1) < _EQUAL and not free[medium] and not free[other])
            for other in chosen
        )
        if not same:
            chosen.append(medium)
    return tuple(chosen)
