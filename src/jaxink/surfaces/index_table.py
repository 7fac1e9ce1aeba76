"""Rough interfaces tabulated over the range of a refractive index."""

from collections.abc import Iterable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.chebyshev import chebyshev_nodes, node_weights
from jaxink.optics.channels import CLOSE
from jaxink.surfaces.table import AngleTable

# Nodes of a piece: so many, and one more for each such width of its range; more above another medium's index,
# where a block of channels opens as the root of the difference.
_NODES, _WIDTH_PER_NODE, _NODES_OF_OPENING = 2, 0.05, 2
# Nodes of a piece in which two indices are practically equal.
_NODES_OF_CLOSE = 2


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
