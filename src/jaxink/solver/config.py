"""Sizes of the solver's discretisation."""

import dataclasses
from typing import Any

import equinox as eqx

from jaxink.errors import require_integer

_SIZES = ("nodes_escaping", "nodes_trapped", "n_moments", "n_orders")
# Far above what any accuracy asks for; matrices of such a size still fit into a memory.
_LARGEST_SIZE = 4096


class SolverConfig(eqx.Module):
    """Sizes of the discretisation.

    Parameters
    ----------
    nodes_escaping
        Channels that leave into the surroundings (block 0).
    nodes_trapped
        Channels of each further block, totally reflected somewhere.
    n_moments
        Legendre moments kept by delta-M.
    n_orders
        Azimuthal orders.
    layer_method
        How a layer's response is computed: ``"discrete_ordinates"``, ``"adding_doubling"``, or the
        ``"fastest"`` of them on JAX's default backend. They agree to 1e-8.

    Raises
    ------
    InputRefusedError
        If a size is not a whole number from 1 to 4096.
    """

    nodes_escaping: int = eqx.field(static=True, default=16)
    nodes_trapped: int = eqx.field(static=True, default=12)
    n_moments: int = eqx.field(static=True, default=32)
    n_orders: int = eqx.field(static=True, default=12)
    layer_method: str = eqx.field(static=True, default="fastest")

    def __check_init__(self):
        for size in _SIZES:
            require_integer(size, getattr(self, size), 1, _LARGEST_SIZE)

    def at_least(self, other: "SolverConfig") -> "SolverConfig":
        """The larger of two in every size, with this one's method."""
        sizes: dict[str, Any] = {s: max(getattr(self, s), getattr(other, s)) for s in _SIZES}
        return dataclasses.replace(self, **sizes)
