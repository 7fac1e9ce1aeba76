"""A rough interface between two media: matrices between channels.

Smith's model with uncorrelated heights: light that leaves a facet along a direction of cosine mu escapes with
probability mu / A, where A is the projected area of the facets, and otherwise meets another facet. With X the
radiance arriving at facets over A, and Q the average over the facets visible from a direction,

    A X = mu L_incident + Q X,    L_leaving = Q X / A

on the four hemispheres of directions (either medium, towards the surface or away from it). Light that meets
one facet has sharp lobes and is computed for all azimuthal orders; the rest is smooth and needs few.
"""

import dataclasses
from collections.abc import Callable
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.linear_algebra import inverse
from jaxink.optics import ChannelGrid, propagating_cosine
from jaxink.surfaces.channel_rows import rows_of_samples
from jaxink.surfaces.facets import FacetRule, views
from jaxink.surfaces.slopes import SlopeDensity
from jaxink.surfaces.spectrum import BroadenedSpectrum

# Receivers that are computed at a time.
_AT_ONCE = 4
# Refractive indices on the outer and on the inner side.
Indices = tuple[Float[Array, ""], Float[Array, ""]]


class RoughResponse(eqx.Module):
    """Basic radiance that leaves a rough interface along channels, over that incident along channels.

    Regular (specular or directly transmitted) light comes from the outer side. Rows belong to the leaving
    channel. Each row is exact for smooth light, but a single entry is not, because lobes may be narrower than
    the spacing of the channels. Light that enters is therefore described by the transpose of ``leaving``.

    Parameters
    ----------
    outer_reflection, inner_reflection
        Light incident from and leaving to the outer or inner side, shape ``(orders, channels, channels)``,
        incident channel last, without the first axis for a single order; ``(channels,)`` if diagonal.
    leaving
        Light incident from the inner side and leaving to the outer one.
    """

    outer_reflection: Float[Array, "*shape"]
    inner_reflection: Float[Array, "*shape"]
    leaving: Float[Array, "*shape"]


class WaveLobes(eqx.Module):
    """Lobes of an interface in wave optics, for light of given directions.

    Parameters
    ----------
    factors
        Factors of each channel's direction on the outer and on the inner side: the product of two is the
        ratio of `RoughInterface.one` to the lobe of the theory, except for light that stays outside.
    table
        The spectra of the theory.
    """

    factors: tuple[Float[Array, " channels"], Float[Array, " channels"]]
    table: BroadenedSpectrum


class RoughInterface(eqx.Module):
    """Reflection and transmission of a rough interface between channels.

    Parameters
    ----------
    one
        Light that meets one facet.
    several
        Light that meets several, which has only low azimuthal orders.
    """

    one: RoughResponse
    several: RoughResponse

    @property
    def total(self) -> RoughResponse:
        """All light."""
        return jax.tree.map(lambda one, more: one.at[: more.shape[0]].add(more), self.one, self.several)

    def of_fluxes(self, scale: Float[Array, " channels"], outer, inner) -> "RoughInterface":
        """The interface in the basis of fluxes, in which no light of any channel is lost.

        Rows are exact for smooth light, but the power of light entering along a single channel would be
        conserved only as accurately as the facets resolve the channels. The missing power of its column is
        distributed over all directions.

        Parameters
        ----------
        scale
            Square root of the channels' etendue weights, above 0.
        outer, inner
            Whether each channel propagates on the outer and on the inner side.
        """
        one, several = jax.tree.map(lambda matrix: scale[:, None] * matrix / scale, (self.one, self.several))
        total = dataclasses.replace(self, one=one, several=several).total
        outer, inner = jnp.where(outer, scale, 0.0), jnp.where(inner, scale, 0.0)

        def missing(matrix, column_sums, leaving):
            return leaving[:, None] * (column_sums - leaving @ matrix) / (leaving @ leaving)

        # By reciprocity, light along a channel is reflected as much as uniform light is reflected into it.
        reflected = total.inner_reflection[0] @ inner
        to_leaving = missing(total.leaving[0], inner - reflected, outer)
        left = (total.leaving[0] + to_leaving) @ inner
        additions = RoughResponse(
            missing(total.outer_reflection[0], outer - left, outer),
            missing(total.inner_reflection[0], reflected, inner),
            to_leaving,
        )
        one = jax.tree.map(lambda matrix, addition: matrix.at[0].add(addition), one, additions)
        return dataclasses.replace(self, one=one, several=several)


class WaveInterface(RoughInterface):
    """A rough interface in wave optics, which leaves some of the light regular.

    Parameters
    ----------
    regular
        Fraction of the power of each channel that remains regular, shape ``(channels,)``.
    lobes
        Its lobes.
    """

    regular: RoughResponse
    lobes: WaveLobes

    @property
    def total(self) -> RoughResponse:
        """All light."""
        return jax.tree.map(lambda matrix, share: matrix + jnp.diag(share), super().total, self.regular)


class RoughSizes(eqx.Module):
    """Resolution of a rough interface.

    Parameters
    ----------
    rule, coarse_rule
        Quadratures over facets for light that meets one facet, and for light that meets several.
    n_outer
        Number of channels, the first ones, that propagate in the outer medium, if that has the lowest index
        of the stack; otherwise None.
    coarse_nodes
        Number of channels in each block for light that meets several facets.
    coarse_orders
        Number of azimuthal orders of such light.
    """

    rule: FacetRule = FacetRule(72, 20)
    coarse_rule: FacetRule = FacetRule(72, 16)
    n_outer: int | None = eqx.field(static=True, default=None)
    coarse_nodes: int = eqx.field(static=True, default=12)
    coarse_orders: int = eqx.field(static=True, default=4)


def _collect(grid: ChannelGrid, source, index, weights, n_orders):
    """`rows_of_samples` of light from the vectors ``source``, which point against its propagation."""
    sine = jnp.sqrt(jnp.maximum(source[0] ** 2 + source[1] ** 2, 1e-30))
    return rows_of_samples(grid, index * sine, -source[0] / sine, weights, n_orders)


def _receivers(cosine):
    """Cosine, sine and whether the channel propagates; harmless numbers if it does not."""
    propagates = cosine > 0
    safe = jnp.where(propagates, cosine, 0.5)
    return safe, jnp.sqrt(1 - safe**2), propagates


class CoarseChannels(eqx.Module):
    """Channels for light that meets several facets; in a table, with a leading axis of wavelengths.

    Parameters
    ----------
    cosines
        On the outer and on the inner side, 0 where a channel does not propagate.
    to_fine, from_fine
        Interpolation to the channels of the stack, and from them.
    """

    cosines: Float[Array, "*table 2 coarse"]
    to_fine: Float[Array, "*table channels coarse"]
    from_fine: Float[Array, "*table coarse channels"]

    @classmethod
    def of(cls, grid: ChannelGrid, coarse: ChannelGrid, indices: Indices) -> "CoarseChannels":
        """From the channels of the stack and the coarse ones."""
        cosines = jnp.stack([propagating_cosine(coarse.squared_cosine(index)) for index in indices])
        return cls(cosines, coarse.interpolation(grid.kappa), grid.interpolation(coarse.kappa))


class FacetResponse(eqx.Module):
    """What facets of one density do with light at each meeting; in a table, with leading axes.

    Parameters
    ----------
    one
        Light that meets one facet.
    areas
        Projected area of the facets along the channels on the outer and on the inner side; 1 where a channel
        does not propagate.
    step
        One more meeting, between the coarse channels of the four hemispheres.
    coarse_areas
        See ``areas``, along the coarse channels.
    """

    one: RoughResponse
    areas: Float[Array, "*table 2 channels"]
    step: Float[Array, "*table orders hemispheres hemispheres"]
    coarse_areas: Float[Array, "*table 2 coarse"]

    def mixed(self, other: "FacetResponse", share: Float[Array, ""]) -> "FacetResponse":
        """Facets of which a share has the other density.

        Facets contribute to what is seen along a direction in proportion to their projected areas.
        """
        own, others = 1 - share, share
        areas = own * self.areas + others * other.areas
        coarse_areas = own * self.coarse_areas + others * other.coarse_areas
        parts = []
        for part, weight in ((self, own), (other, others)):
            seen, coarse = part.areas / areas, jnp.tile(part.coarse_areas / coarse_areas, (1, 2)).ravel()
            one = RoughResponse(
                weight * seen[0][:, None] * part.one.outer_reflection * seen[0],
                weight * seen[1][:, None] * part.one.inner_reflection * seen[1],
                weight * seen[0][:, None] * part.one.leaving * seen[1],
            )
            parts.append((one, weight * coarse[:, None] * part.step))
        one, step = jax.tree.map(jnp.add, *parts)
        return FacetResponse(one, areas, step, coarse_areas)

    def interface(self, coarse: CoarseChannels) -> RoughInterface:
        """The interface, with light that meets several facets."""
        n = coarse.cosines.shape[1]
        # Light arrives along directions towards the surface and leaves along those away from it.
        towards = np.r_[0:n, 2 * n : 3 * n]
        away = towards + n
        enter = (coarse.cosines / self.coarse_areas).ravel()
        twice = self.step @ self.step[..., towards]
        whole = inverse(jnp.eye(4 * n) - self.step)[..., away, :] @ twice * enter
        several = RoughResponse(whole[..., :n, :n], whole[..., n:, n:], whole[..., :n, n:])
        several = jax.tree.map(lambda matrix: coarse.to_fine @ matrix @ coarse.from_fine, several)
        return RoughInterface(self.one, several)


def _by_receiver(of: Callable, cosine, sine):
    """What a function of cosines and sines gives for each receiver, along a new leading axis.

    A few are computed at a time: the samples of all do not fit into the cache of a processor.
    """
    return jax.lax.map(lambda one: of(one[0][None], one[1][None]), (cosine, sine), batch_size=_AT_ONCE)


def _rule_in(here, outer, n_outer: int | None, rule: FacetRule) -> FacetRule:
    """The rule for receivers in one of the media; nothing is reflected totally in the rarest one."""
    return rule.without_total_reflection if here is outer and n_outer is not None else rule


def _one_facet(grid, outer, inner, density, rule, n_orders, n_outer):
    """Light that meets one facet, and projected areas."""
    rows, areas, leave, enter = [], [], [], []
    n_channels = grid.kappa.shape[0]

    def seen(here, there, cosine, sine):
        view = views(cosine, sine, here, there, density, _rule_in(here, outer, n_outer, rule), are_held=True)
        weight = view.weight * view.reflectance * (view.mirrored[2] > 0)
        parts = [_collect(grid, view.mirrored, here, [weight], n_orders)[0, :, 0]]
        if here is outer:
            weight = view.weight * (1 - view.reflectance) * (view.refracted[2] < 0)
            parts.append(_collect(grid, view.refracted, there, [weight], n_orders)[0, :, 0])
        return jnp.sum(view.weight), jnp.stack(parts)

    for here, there in ((outer, inner), (inner, outer)):
        n = n_channels if here is inner or n_outer is None else n_outer
        all_cosines = propagating_cosine(grid.squared_cosine(here))
        cosine, sine, propagates = _receivers(all_cosines[:n])
        area, parts = _by_receiver(partial(seen, here, there), cosine, sine)
        missing = (0, n_channels - n)
        areas.append(jnp.pad(jnp.where(propagates, area, 1.0), missing, constant_values=1.0))
        leave.append(jnp.pad(jnp.where(propagates, 1 / area, 0.0), missing))
        enter.append(leave[-1] * all_cosines)
        rows += [jnp.pad(part, ((0, 0), missing, (0, 0))) for part in jnp.moveaxis(parts, 0, 2)]
    reflected_outside, passing, reflected_inside = rows
    one = RoughResponse(
        leave[0][:, None] * reflected_outside * enter[0],
        leave[1][:, None] * reflected_inside * enter[1],
        leave[0][:, None] * passing * enter[1],
    )
    return one, jnp.stack(areas)


def next_facet(grid, outer, inner, density, rule, n_orders, n_outer):
    """One more meeting of light that leaves a facet, and projected areas."""
    blocks, areas, per_area = [], [], []
    n_channels = grid.kappa.shape[0]

    def seen(here, there, cosine, sine):
        view = views(cosine, sine, here, there, density, _rule_in(here, outer, n_outer, rule), are_held=True)
        parts = []
        for source, share, index, side in (
            (view.mirrored, view.reflectance, here, 1.0),
            (view.refracted, 1 - view.reflectance, there, -1.0),
        ):
            # It came from outside, or from another facet.
            weights = [view.weight * share * (sign * source[2] > 0) for sign in (side, -side)]
            parts += list(_collect(grid, source, index, weights, n_orders)[:, :, 0])
        return jnp.sum(view.weight), jnp.concatenate(parts, axis=-1)

    for here, there in ((outer, inner), (inner, outer)):
        n = n_channels if here is inner or n_outer is None else n_outer
        cosine, sine, propagates = _receivers(propagating_cosine(grid.squared_cosine(here))[:n])
        # Light that leaves a facet towards the surface, then light that leaves it away from it.
        both = jnp.concatenate([-cosine, cosine]), jnp.tile(sine, 2)
        area, rows = _by_receiver(partial(seen, here, there), *both)
        missing = (0, n_channels - n)
        rows = jnp.pad(rows.reshape(2, n, *rows.shape[1:]), ((0, 0), missing, (0, 0), (0, 0)))
        blocks.append(jnp.moveaxis(rows.reshape(-1, *rows.shape[2:]), 0, 1))
        areas.append(jnp.pad(jnp.where(propagates, area[n:], 1.0), missing, constant_values=1.0))
        per_area.append(jnp.tile(jnp.pad(jnp.where(propagates, 1 / area[n:], 0.0), missing), 2))
    first, second = blocks
    half = 2 * n_channels
    second = jnp.concatenate([second[..., half:], second[..., :half]], axis=-1)
    step = jnp.concatenate(per_area)[:, None] * jnp.concatenate([first, second], axis=-2)
    return step, jnp.stack(areas)


def facet_response(
    grid: ChannelGrid,
    coarse: ChannelGrid,
    indices: Indices,
    density: SlopeDensity,
    n_orders: int,
    sizes: RoughSizes,
) -> FacetResponse:
    """What facets do with light at each meeting, along the channels and the coarse ones."""
    n_outer = sizes.n_outer
    one, areas = _one_facet(grid, *indices, density, sizes.rule, n_orders, n_outer)
    n_coarse_orders = min(sizes.coarse_orders, n_orders)
    # The medium of lowest index has the first block of channels.
    n_outer = None if n_outer is None else coarse.nodes_per_block[0]
    step, coarse_areas = next_facet(coarse, *indices, density, sizes.coarse_rule, n_coarse_orders, n_outer)
    return FacetResponse(one, areas, step, coarse_areas)


def coarse_grid(grid: ChannelGrid, sizes: RoughSizes) -> ChannelGrid:
    """Channels for light that meets several facets."""
    n_nodes = (sizes.coarse_nodes,) * len(grid.nodes_per_block)
    return ChannelGrid(grid.block_index, grid.scatters, n_nodes, False)


def rough_interface(
    grid: ChannelGrid, indices: Indices, density: SlopeDensity, n_orders: int, sizes: RoughSizes
) -> RoughInterface:
    """Reflection and transmission of a rough interface between channels.

    References
    ----------
    Heitz, Hanika, d'Eon, Dachsbacher 2016 ACM Trans. Graph. 35(4), 58 (multiple scattering by facets).
    """
    coarse = coarse_grid(grid, sizes)
    response = facet_response(grid, coarse, indices, density, n_orders, sizes)
    return response.interface(CoarseChannels.of(grid, coarse, indices))
