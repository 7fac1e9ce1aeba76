"""Light absorbed at each depth of an ink, and light emitted there that reaches the detector."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.model.volume import layer_optics
from jaxink.optics import Directions
from jaxink.solver import DEPTH_WEIGHTS, fluence


class DepthProfiles(eqx.Module):
    """Profiles over the depth of some layers, at each wavelength.

    The two sides are reflection and transmission; they differ for incident light if a backing is present in
    reflection only.

    Parameters
    ----------
    lit_mm
        Fluence per irradiance times the thickness that a depth stands for, in mm: times an absorption
        coefficient it is the share of the incident light that is absorbed there.
    leaving_per_sr
        BSDF per share of the incident light that is emitted at a depth, isotropically.
    absorption_per_mm
        Absorption coefficient at each depth.
    """

    __repr__ = brief_repr

    lit_mm: Float[Array, "*wavelengths sides depths incidences"]
    leaving_per_sr: Float[Array, "*wavelengths sides depths outgoing"]
    absorption_per_mm: Float[Array, "*wavelengths depths"]

    def emitted(
        self,
        coupling: Float[Array, "wavelengths wavelengths"],
        unmeasured_per_mm: Float[Array, " wavelengths"],
    ) -> Float[Array, "wavelengths sides incidences outgoing"]:
        """BSDF read at each emitted wavelength.

        Parameters
        ----------
        coupling
            Light emitted at the second wavelength over the light absorbed at the first, both relative to the
            incident light of their wavelength.
        unmeasured_per_mm
            Light emitted at a wavelength per fluence and length, for exciting light that is distributed over
            the depth as that of the shortest wavelength.
        """
        exciting = coupling[:, :, None] * self.absorption_per_mm[:, None]
        exciting = exciting.at[0].add(unmeasured_per_mm[:, None])
        sources = jnp.einsum("jkd,jsdi->ksdi", exciting, self.lit_mm)
        return jnp.einsum("ksdi,ksdo->ksio", sources, self.leaving_per_sr)

    def emitted_in_all(
        self, coupling: Float[Array, "wavelengths wavelengths"]
    ) -> Float[Array, "wavelengths sides incidences outgoing"]:
        """BSDF read at each exciting wavelength by a detector that is sensitive to all; see `emitted`."""
        sources = self.absorption_per_mm[:, None, :, None] * self.lit_mm
        leaving = jnp.einsum("jk,ksdo->jsdo", coupling, self.leaving_per_sr)
        return jnp.einsum("jsdi,jsdo->jsio", sources, leaving)


def at_pairs(
    bsdf: Float[Array, "wavelengths sides incidences outgoing"], directions: Directions
) -> Float[Array, "wavelengths pairs"]:
    """Values at pairs of directions."""
    side: Int[np.ndarray, " pairs"] = directions.is_transmission.astype(int)
    return bsdf[:, side, directions.incidence, directions.outgoing]


def profiles_at(stack, plan, config, builder, values, wavelength_nm, directions: Directions, layers):
    """`DepthProfiles` of one wavelength, without the leading axis.

    Parameters
    ----------
    stack, plan, config
        See `diffuse_bsdf`.
    builder, values, wavelength_nm
        Of the stack.
    directions
        Pairs of rays.
    layers
        Positions of the layers that emit.
    """
    n_in, n_out = len(directions.sin_incidence), len(directions.sin_outgoing)
    sines = directions.sin_incidence, directions.sin_outgoing
    kappa = jnp.concatenate(
        [stack.index_front * sines[0], stack.index_front * sines[1], stack.index_back * sines[1]]
    )
    into, front, back = slice(n_in), slice(n_in, n_in + n_out), slice(n_in + n_out, None)
    seen = alone = fluence(stack, plan, config, kappa, layers)
    if stack.backing is not None:
        # Transmission is that without the backing.
        alone = fluence(dataclasses.replace(stack, backing=None), plan, config, kappa, layers)
    named = [builder.sample.layers[k] for k in layers]
    optics = [layer_optics(layer, values, wavelength_nm, builder.mie_sizes)[1] for layer in named]
    n_depths = DEPTH_WEIGHTS.size
    index = jnp.repeat(jnp.stack([stack.layers[k].refractive_index for k in layers]), n_depths)[:, None]
    thickness = jnp.stack([values[f"{layer.name}.thickness_um"] / 1000 for layer in named])
    depth_mm = (thickness[:, None] * DEPTH_WEIGHTS).reshape(-1, 1)
    leaving = (
        stack.index_front**2 * seen.from_front[:, front],
        stack.index_back**2 * alone.from_back[:, back],
    )
    return DepthProfiles(
        depth_mm * jnp.stack([seen.from_front[:, into], alone.from_front[:, into]]),
        jnp.stack(leaving) / (4 * jnp.pi * index**2),
        jnp.repeat(jnp.stack([one.absorption_per_mm for one in optics if one is not None]), n_depths),
    )
