"""A stack of layers between two half spaces."""

from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from jaxink.display.brief import brief_repr
from jaxink.numerics.validity import known_float
from jaxink.optics import ClearLayer, ScatteringLayer, propagating_cosine
from jaxink.solver.lateral import LateralField
from jaxink.surfaces import SlopeDensity, WaveFace, kept_regular


class Stack(eqx.Module):
    """Layers in the order in which light meets them, between two half spaces.

    Parameters
    ----------
    layers
        From the illuminated side to the far side.
    index_front, index_back
        Refractive indices of the surroundings on the illuminated and on the far side.
    faces
        Roughness of each interface, from the front to the back: a density of facet slopes, or surface heights
        treated by wave optics; None for a smooth interface; empty if all are smooth.
    backing
        Reflectance of an ideally diffuse reflector behind the stack, in the medium of ``index_back``; None
        without one. It affects reflection only: transmission is that of the stack alone.
    lateral
        Beam and field of view of the detector; None if light is seen wherever it leaves the sample.
    """

    __repr__ = brief_repr

    layers: tuple[ClearLayer | ScatteringLayer, ...]
    index_front: Float[Array, ""] = eqx.field(converter=known_float)
    index_back: Float[Array, ""] = eqx.field(converter=known_float)
    faces: tuple[SlopeDensity | WaveFace | None, ...] = ()
    backing: Float[Array, ""] | None = None
    lateral: LateralField | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            layers: tuple[ClearLayer | ScatteringLayer, ...],
            index_front: ArrayLike,
            index_back: ArrayLike,
            faces: tuple[SlopeDensity | WaveFace | None, ...] = (),
            backing: Array | None = None,
            lateral: LateralField | None = None,
        ) -> None: ...

    @property
    def indices(self) -> list:
        """Refractive indices of front, layers and back."""
        return [
            self.index_front,
            *(layer.refractive_index for layer in self.layers),
            self.index_back,
        ]

    @property
    def scattering(self) -> dict[int, ScatteringLayer]:
        """Layers that scatter, by ascending position."""
        return {k: layer for k, layer in enumerate(self.layers) if isinstance(layer, ScatteringLayer)}

    @property
    def rough(self) -> dict[int, SlopeDensity | WaveFace]:
        """Rough interfaces by ascending position."""
        return {k: face for k, face in enumerate(self.faces) if face is not None}

    def outer_is_front(self, interface: int) -> bool:
        """Whether regular light reaches a rough interface from its front.

        It comes from the side without scattering layers, or from the front if both sides scatter.
        """
        return min(self.scattering) >= interface or max(self.scattering) >= interface

    def sides(self, interface: int) -> tuple[int, int]:
        """Positions of the media on the outer and on the inner side of a rough interface."""
        return (interface, interface + 1) if self.outer_is_front(interface) else (interface + 1, interface)

    def kept_regular(self, squared_cosine: Float[Array, "media directions"]):
        """Share of regular light that remains regular at each interface.

        Parameters
        ----------
        squared_cosine
            mu^2 of directions in front, layers and back.

        Returns
        -------
        Float[Array, "3 interfaces directions"] or None
            Factors of reflection to the front, to the back, and of transmission; None if all are smooth.
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
