"""A stack of layers between two half spaces, and the sizes of its discretisation."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.errors import require_integer
from jaxink.optics.channels import ChannelGrid
from jaxink.optics.fresnel import propagating_cosine
from jaxink.optics.layers import ClearLayer, ScatteringLayer
from jaxink.solver.lateral import LateralField
from jaxink.surfaces.interface import RoughInterface, RoughSizes
from jaxink.surfaces.slopes import SlopeDensity
from jaxink.surfaces.wave_face import WaveFace, kept_regular

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
        return SolverConfig(*(max(getattr(self, s), getattr(other, s)) for s in _SIZES), self.layer_method)


class Stack(eqx.Module):
    """Layers in the order in which light meets them, between two half spaces.

    Parameters
    ----------
    layers
        From the lit side to the far side.
    index_front, index_back
        Refractive indices of the surroundings on the lit and on the far side.
    block_media
        Which refractive indices end the blocks of channels: positions in (front, layers..., back).
    exposed
        True where a scattering layer has the index of the surroundings, see `ChannelGrid`.
    faces
        What makes each interface rough, from the front to the back: a density of facet slopes, or a spectrum
        of heights by wave optics; None where it is smooth; empty if all are.
    known
        For each interface, what it does between the channels where that is known beforehand; empty if
        none is.
    rarest
        Positions in (front, layers..., back) of the media that have the lowest index of all, where it is
        fixed: a rough interface then need not look at the channels that do not propagate there.
    backing
        Reflectance of an ideally diffuse reflector that stands behind the stack while its reflection is
        looked at, in the medium of ``index_back``; None where nothing does. Transmission is always that of
        the stack alone.
    lateral
        Beam and field of the detector; None where all light is seen, wherever it comes out.
    """

    layers: tuple[ClearLayer | ScatteringLayer, ...]
    index_front: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    index_back: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    block_media: tuple[int, ...] = eqx.field(static=True)
    exposed: bool = eqx.field(static=True, default=False)
    faces: tuple[SlopeDensity | WaveFace | None, ...] = ()
    known: tuple[RoughInterface | None, ...] = ()
    rarest: tuple[int, ...] = eqx.field(static=True, default=())
    backing: Float[Array, ""] | None = None
    lateral: LateralField | None = None

    @property
    def rough(self) -> list[int]:
        """Positions of the rough interfaces."""
        return [k for k, face in enumerate(self.faces) if face is not None]

    def outer_is_front(self, interface: int) -> bool:
        """Whether regular light comes to a rough interface from its front side.

        That is the side where no layer scatters; the front if there is none.
        """
        return min(self.scattering) >= interface or max(self.scattering) >= interface

    def sides(self, interface: int) -> tuple[int, int]:
        """Positions of the media on the outer and on the inner side of a rough interface."""
        return (interface, interface + 1) if self.outer_is_front(interface) else (interface + 1, interface)

    def rough_arguments(self, interface: int, config: SolverConfig) -> tuple:
        """Arguments of `rough_interface` for an interface, after the grid."""
        sides = self.sides(interface)
        outer, inner = (self.indices[side] for side in sides)
        sizes = RoughSizes(n_outer=config.nodes_escaping if sides[0] in self.rarest else None)
        return outer, inner, self.faces[interface], config.n_orders, sizes

    def kept_regular(self, squared_cosine: Float[Array, "media directions"]):
        """What roughness leaves of the regular light of each interface.

        Parameters
        ----------
        squared_cosine
            mu^2 of directions in front, layers and back.

        Returns
        -------
        Float[Array, "3 interfaces directions"] or None
            Factors of what is reflected to the front, to the back, and passes; None where all is smooth.
        """
        if not self.rough:
            return None
        cosines = propagating_cosine(squared_cosine)
        kept = []
        for k in range(len(self.layers) + 1):
            face = self.faces[k]
            if isinstance(face, WaveFace):
                media = (self.indices[k], self.indices[k + 1]), (cosines[k], cosines[k + 1])
                kept.append(jnp.stack(kept_regular(face, *media)))
            else:
                kept.append(jnp.full((3, cosines.shape[1]), 1.0 if face is None else 0.0))
        return jnp.stack(kept, axis=1)

    @property
    def indices(self) -> list:
        """Refractive indices of front, layers and back."""
        return [
            self.index_front,
            *(layer.refractive_index for layer in self.layers),
            self.index_back,
        ]

    @property
    def scattering(self) -> list[int]:
        """Positions of the layers that scatter."""
        return [k for k, layer in enumerate(self.layers) if isinstance(layer, ScatteringLayer)]

    def grid(self, config: SolverConfig) -> ChannelGrid:
        """Channels for this stack."""
        scattering = {k + 1 for k in self.scattering}
        # Of equal indices that of a scattering medium comes first: the block of the other one is then empty.
        media = sorted(self.block_media, key=lambda medium: medium not in scattering)
        ends = jnp.stack([self.indices[medium] for medium in media])
        order = jnp.argsort(ends)
        scatters = jnp.array([medium in scattering for medium in media])
        n_trapped_blocks = len(self.block_media) - 1
        return ChannelGrid(
            ends[order],
            scatters[order],
            (config.nodes_escaping,) + (config.nodes_trapped,) * n_trapped_blocks,
            self.exposed,
        )


def block_media(indices: list[float], scattering: list[bool], free: list[bool]) -> tuple[int, ...]:
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
            abs(indices[medium] / indices[other] - 1) < 1e-5 and not free[medium] and not free[other]
            for other in chosen
        )
        if not same:
            chosen.append(medium)
    return tuple(chosen)
