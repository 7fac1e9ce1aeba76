"""Resolution of the solver."""

import dataclasses
from typing import Any

import equinox as eqx

from jaxink.display.brief import brief_repr
from jaxink.errors import require_integer

_SIZES = ("nodes_escaping", "nodes_trapped", "n_moments", "n_orders")
# Far beyond what any accuracy needs, while matrices of this size still fit into memory.
_LARGEST_SIZE = 4096


class SolverConfig(eqx.Module):
    """Resolution of the solver: streams, Legendre moments and azimuthal orders.

    Parameters
    ----------
    nodes_escaping
        Streams that leave into the surroundings (block 0).
    nodes_trapped
        Streams of each further block, which are totally reflected at some interface.
    n_moments
        Legendre moments kept by delta-M.
    n_orders
        Azimuthal orders.
    layer_method
        How a layer's response is computed: ``"discrete_ordinates"``, ``"adding_doubling"``, or the
        ``"fastest"``, which is the former on every device measured. The two agree to 1e-8.

    Raises
    ------
    InputRefusedError
        If a number is not an integer from 1 to 4096.
    """

    # equinox's own omits numbers that are the defaults.
    __repr__ = brief_repr

    nodes_escaping: int = eqx.field(static=True, default=16)
    nodes_trapped: int = eqx.field(static=True, default=12)
    n_moments: int = eqx.field(static=True, default=32)
    n_orders: int = eqx.field(static=True, default=12)
    layer_method: str = eqx.field(static=True, default="fastest")

    def __check_init__(self):
        for size in _SIZES:
            require_integer(size, getattr(self, size), 1, _LARGEST_SIZE)

    def at_least(self, other: "SolverConfig") -> "SolverConfig":
        """The larger of the two in every number, with this one's layer method."""
        sizes: dict[str, Any] = {s: max(getattr(self, s), getattr(other, s)) for s in _SIZES}
        return dataclasses.replace(self, **sizes)
