"""Rough interfaces tabulated over the ranges of their angles and of a refractive index."""

import math
from collections.abc import Iterable
from typing import Generic, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.chebyshev import chebyshev_nodes, node_weights
from jaxink.numerics.compiling import jit_unoptimised
from jaxink.numerics.fingerprint import fingerprint
from jaxink.numerics.weak_cache import WeakCache
from jaxink.optics import CLOSE, ChannelGrid
from jaxink.surfaces.facets import FacetRule
from jaxink.surfaces.interface import (
    CoarseChannels,
    FacetResponse,
    Indices,
    RoughInterface,
    RoughResponse,
    RoughSizes,
    coarse_grid,
    facet_response,
    rough_interface,
)
from jaxink.surfaces.slopes import SlopeLaw, slope_density

# Added to the angle before taking the logarithm; below this, in degrees, a surface is practically smooth.
_SMOOTH_DEG = 0.3
# Distance beyond the ends of the range, relative to half its logarithm, that is due to rounding.
_ROUNDING = 1e-9
# Nodes of the angle per factor of e in its range, and their largest and smallest number.
_NODES_PER_E, _MOST_NODES, _FEWEST_NODES = 4, 24, 6

# Quadratures over the facets of one table, and of one for each node of a refractive index, which take half as
# long; both keep the BSDF within about 1e-3, most of it by the slopes of light that meets several facets.
FINE = RoughSizes()
QUICK = RoughSizes(FacetRule(36, 8), FacetRule(72, 8), coarse_nodes=12)

Content = TypeVar("Content", RoughInterface, FacetResponse)
# The law of a density, and the range of its angle, with equal limits if it is fixed.
Density = tuple[SlopeLaw, tuple[float, float]]
# Nodes of a piece: so many, and one more for each such width of its range; more above another medium's index,
# where a block of channels opens as the root of the difference.
_NODES, _WIDTH_PER_NODE, _NODES_OF_OPENING = 2, 0.05, 2
# Nodes of a piece in which two indices are practically equal.
_NODES_OF_CLOSE = 2


class RoughTable(eqx.Module, Generic[Content]):
    """What facets of one density do at Chebyshev nodes of log(sigma + 0.3 deg).

    Parameters
    ----------
    at_nodes
        The interface, or the response of the facets, at the nodes, along the leading axis.
    sigma_deg
        Range of the angle.
    """

    at_nodes: Content
    sigma_deg: tuple[float, float] = eqx.field(static=True)

    def at(self, sigma_deg: Float[Array, ""]) -> Content:
        """The same at an angle within the range; differentiable."""
        n_nodes = jax.tree.leaves(self.at_nodes)[0].shape[0]
        if n_nodes == 1:
            return jax.tree.map(lambda values: values[0], self.at_nodes)
        low, high = (math.log(limit + _SMOOTH_DEG) for limit in self.sigma_deg)
        x = (2 * jnp.log(sigma_deg + _SMOOTH_DEG) - low - high) / (high - low)
        # A clipped value has no one-sided derivative at the ends of the range.
        x = jnp.where(jnp.abs(x) > 1 + _ROUNDING, jnp.clip(x, -1.0, 1.0), x)
        weights = node_weights(x, n_nodes)
        return jax.tree.map(lambda values: jnp.tensordot(weights, values, axes=1), self.at_nodes)


class MixtureTable(eqx.Module):
    """A rough interface with facets of two densities.

    What both do with light is added; how often they meet it follows from the sum.

    Parameters
    ----------
    first, second
        The densities.
    coarse
        Channels for light that meets several facets.
    """

    first: RoughTable[FacetResponse]
    second: RoughTable[FacetResponse]
    coarse: CoarseChannels

    def at(
        self, sigma_deg: Float[Array, ""], second_sigma_deg: Float[Array, ""], second_weight: Float[Array, ""]
    ) -> RoughInterface:
        """Interface at angles within their ranges, and with a share of the second density."""
        mixed = self.first.at(sigma_deg).mixed(self.second.at(second_sigma_deg), second_weight)
        return mixed.interface(self.coarse)


AngleTable = RoughTable[RoughInterface] | MixtureTable


def rough_table(
    grid: ChannelGrid, indices: Indices, density: Density, n_orders: int, sizes: RoughSizes
) -> RoughTable[RoughInterface]:
    """Tabulate a rough interface over the range of its angle.

    Parameters
    ----------
    grid
        The channels, not traced.
    indices
        Refractive indices on the outer and on the inner side.
    density
        Law of the slope density and the range of its angle.
    n_orders
        Number of azimuthal orders.
    sizes
        `FINE` or `QUICK`, with the channels that propagate outside.
    """
    program = _programs(n_orders, sizes, grid.nodes_per_block, grid.exposed, False)
    leaves = program(grid, indices, *_law_and_nodes(density))
    return RoughTable(RoughInterface(RoughResponse(*leaves[:3]), RoughResponse(*leaves[3:])), density[1])


def mixture_table(
    grid: ChannelGrid,
    indices: Indices,
    densities: tuple[Density, Density],
    n_orders: int,
    sizes: RoughSizes,
) -> MixtureTable:
    """Tabulate a rough interface with two densities over the ranges of their angles; see `rough_table`."""

    def table(density: Density) -> tuple[RoughTable[FacetResponse], CoarseChannels]:
        program = _programs(n_orders, sizes, grid.nodes_per_block, grid.exposed, True)
        *leaves, cosines, to_fine, from_fine = program(grid, indices, *_law_and_nodes(density))
        response = FacetResponse(RoughResponse(*leaves[:3]), *leaves[3:])
        return RoughTable(response, density[1]), CoarseChannels(cosines, to_fine, from_fine)

    (first, coarse), (second, _) = map(table, densities)
    return MixtureTable(first, second, coarse)


def _law_and_nodes(density: Density):
    return jax.tree.map(jnp.asarray, density[0]), jnp.asarray(_nodes(density[1]))


def _nodes(sigma_deg: tuple[float, float]) -> np.ndarray:
    low, high = (math.log(limit + _SMOOTH_DEG) for limit in sigma_deg)
    if low == high:
        return np.array([sigma_deg[0]])
    n_nodes = min(max(round(_NODES_PER_E * (high - low)), _FEWEST_NODES), _MOST_NODES)
    return np.exp((low + high) / 2 + (high - low) / 2 * chebyshev_nodes(n_nodes)) - _SMOOTH_DEG


def _at_angles(
    n_orders: int,
    sizes: RoughSizes,
    nodes_per_block: tuple[int, ...],
    exposed: bool,
    to_be_mixed: bool,
):
    def interfaces(grid, indices, law, nodes):
        def at(sigma_deg):
            return rough_interface(grid, indices, slope_density(law, sigma_deg), n_orders, sizes)

        return tuple(jax.tree.leaves(jax.lax.map(at, nodes)))

    def responses(grid, indices, law, nodes):
        coarse = coarse_grid(grid, sizes)

        def at(sigma_deg):
            return facet_response(grid, coarse, indices, slope_density(law, sigma_deg), n_orders, sizes)

        channels = CoarseChannels.of(grid, coarse, indices)
        return tuple(jax.tree.leaves((jax.lax.map(at, nodes), channels)))

    # Runs once for each face. Besides arrays, the grid consists of its nodes and of whether it is exposed.
    key = fingerprint("rough table", n_orders, sizes, nodes_per_block, exposed, to_be_mixed)
    return jit_unoptimised(responses if to_be_mixed else interfaces, level=1, key=key)


_programs = WeakCache(_at_angles)


class Piece(NamedTuple):
    """Part of the range of an index in which the channels change smoothly with it.

    Parameters
    ----------
    low, high
        Its ends.
    n_nodes
        Number of Chebyshev nodes that suffices.
    """

    low: float
    high: float
    n_nodes: int

    def nodes(self, n_nodes: int) -> Float[np.ndarray, " nodes"]:
        """The indices at which the interface is computed."""
        return (self.low + self.high) / 2 + (self.high - self.low) / 2 * chebyshev_nodes(n_nodes)


def pieces_of(
    span: tuple[float, float], scatters: bool, others: Iterable[tuple[float, bool]]
) -> tuple[Piece, ...]:
    """Divide the range of an index where the order of the channels' blocks, or what defines them, changes.

    Parameters
    ----------
    span
        The range.
    scatters
        Whether the medium scatters.
    others
        Index of each other medium that has channels of its own, and whether it scatters.
    """
    ends, openings, close = set(span), list[float](), set()
    for index, other_scatters in others:
        # The nodes of a block are taken from the next medium, if that is hardly denser and scatters.
        below = index / (1 + CLOSE) if other_scatters else index
        above = index * (1 + CLOSE) if scatters else index
        inside = {end for end in (below, index, above) if span[0] < end < span[1]}
        ends |= inside
        close |= {end for end in (below, index) if end < above}
        openings.append(above)
    ordered = sorted(ends)

    def n_nodes(low, high):
        if low in close:
            return _NODES_OF_CLOSE
        wide = _NODES + int(np.ceil((high - low) / _WIDTH_PER_NODE))
        opens = any(0 <= low - opening < _WIDTH_PER_NODE for opening in openings)
        return wide + _NODES_OF_OPENING if opens else wide

    return tuple(Piece(a, b, n_nodes(a, b)) for a, b in zip(ordered[:-1], ordered[1:], strict=True))


class IndexTable(eqx.Module):
    """What facets do between media of which one index is free.

    Parameters
    ----------
    at_nodes
        Their tables at the nodes of all pieces, one after the other, along the leading axis.
    low, high
        Ends of the pieces.
    n_nodes
        Number of nodes of each piece.
    index
        Name of the parameter.
    """

    at_nodes: AngleTable
    low: Float[Array, "*table pieces"]
    high: Float[Array, "*table pieces"]
    n_nodes: tuple[int, ...] = eqx.field(static=True)
    index: str = eqx.field(static=True)

    def at(self, index: Float[Array, ""]) -> AngleTable:
        """The table of angles at an index within the range; differentiable."""
        piece = jnp.clip(jnp.searchsorted(self.low, index, side="right") - 1, 0)
        x = (2 * index - self.low - self.high) / (self.high - self.low)
        weights = jnp.concatenate(
            [jnp.where(piece == k, node_weights(x[k], n), 0.0) for k, n in enumerate(self.n_nodes)]
        )
        # Only the nodes of the piece, and some of its neighbours' if those have more, are read.
        starts, widest = np.cumsum([0, *self.n_nodes[:-1]]), max(self.n_nodes)
        start = jnp.minimum(jnp.asarray(starts)[piece], weights.shape[0] - widest)

        def window(values):
            return jax.lax.dynamic_slice_in_dim(values, start, widest)

        return jax.tree.map(
            lambda values: jnp.tensordot(window(weights), window(values), axes=1), self.at_nodes
        )
