"""A rough interface between two media: matrices between channels.

Smith's model with uncorrelated heights: light that leaves a facet along a direction of cosine mu escapes with
probability mu / A, where A is the projected area of the facets, and otherwise meets another facet. With X the
radiance arriving at facets over A, and Q the average over the facets visible from a direction,

    A X = mu L_incident + Q X,    L_leaving = Q X / A

on the four hemispheres of directions (either medium, towards the surface or away from it). Light that meets
one facet has sharp lobes and is computed for all azimuthal orders; the rest is smooth and needs few.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.linear_algebra import inverse
from jaxink.optics.channels import ChannelGrid
from jaxink.optics.fresnel import propagating_cosine
from jaxink.surfaces.channel_rows import rows_of_samples
from jaxink.surfaces.facets import FacetRule, views
from jaxink.surfaces.slopes import SlopeDensity


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


class RoughInterface(eqx.Module):
    """Reflection and transmission of a rough interface between channels.

    Parameters
    ----------
    one
        Light that meets one facet.
    several
        Light that meets several, which has only low azimuthal orders.
    regular
        Fraction of the power of each channel that remains regular, shape ``(channels,)``, or None.
    lobe_factors
        Factors of each channel's direction on the outer and on the inner side: the product of two is the
        ratio of ``one`` to the lobe of the theory, except for light that stays outside. None: 1.
    """

    one: RoughResponse
    several: RoughResponse
    regular: RoughResponse | None = None
    lobe_factors: tuple[Float[Array, " channels"], Float[Array, " channels"]] | None = None

    @property
    def total(self) -> RoughResponse:
        """All light."""
        total = jax.tree.map(lambda one, more: one.at[: more.shape[0]].add(more), self.one, self.several)
        if self.regular is None:
            return total
        return jax.tree.map(lambda matrix, share: matrix + jnp.diag(share), total, self.regular)

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
        total = RoughInterface(one, several, self.regular).total
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
        return RoughInterface(one, several, self.regular, self.lobe_factors)


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

    rule: FacetRule = FacetRule(36, 8)
    coarse_rule: FacetRule = FacetRule(36, 8)
    n_outer: int | None = eqx.field(static=True, default=None)
    coarse_nodes: int = eqx.field(static=True, default=10)
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


def _one_facet(grid, outer, inner, density, rule, n_orders, n_outer):
    """Light that meets one facet."""
    rows, leave, enter = [], [], []
    n_channels = grid.kappa.shape[0]
    for here, there, n in ((outer, inner, n_outer), (inner, outer, n_channels)):
        all_cosines = propagating_cosine(grid.squared_cosine(here))
        cosine, sine, propagates = _receivers(all_cosines[:n])
        rarer = here is outer and n_outer < n_channels
        view = views(cosine, sine, here, there, density, rule.without_total_reflection if rarer else rule)
        outside = view.weight * view.reflectance * (view.mirrored[2] > 0)
        per_area = jnp.where(propagates, 1 / jnp.sum(view.weight, axis=1), 0.0)
        leave.append(jnp.pad(per_area, (0, n_channels - n)))
        enter.append(leave[-1] * all_cosines)
        rows.append(_collect(grid, view.mirrored, here, [outside], n_orders)[0])
        if here is outer:
            passing = view.weight * (1 - view.reflectance) * (view.refracted[2] < 0)
            passing = _collect(grid, view.refracted, there, [passing], n_orders)[0]
    missing = ((0, 0), (0, n_channels - n_outer), (0, 0))
    return RoughResponse(
        leave[0][:, None] * jnp.pad(rows[0], missing) * enter[0],
        leave[1][:, None] * rows[1] * enter[1],
        leave[0][:, None] * jnp.pad(passing, missing) * enter[1],
    )


def _several_facets(grid, outer, inner, density, rule, n_orders):
    """Light that meets at least two facets."""
    blocks, per_area, cosines = [], [], []
    for here, there in ((outer, inner), (inner, outer)):
        cosine, sine, propagates = _receivers(propagating_cosine(grid.squared_cosine(here)))
        # Light that leaves a facet towards the surface, then light that leaves it away from it.
        view = views(jnp.concatenate([-cosine, cosine]), jnp.tile(sine, 2), here, there, density, rule)
        parts = []
        for source, share, index, side in (
            (view.mirrored, view.reflectance, here, 1.0),
            (view.refracted, 1 - view.reflectance, there, -1.0),
        ):
            # It came from outside, or from another facet.
            weights = [view.weight * share * (sign * source[2] > 0) for sign in (side, -side)]
            parts += list(_collect(grid, source, index, weights, n_orders))
        blocks.append(jnp.concatenate(parts, axis=-1))
        area = jnp.sum(view.weight[cosine.shape[0] :], axis=1)
        per_area.append(jnp.where(propagates, 1 / area, 0.0))
        cosines.append(jnp.where(propagates, cosine, 0.0))
    n = cosines[0].shape[0]
    first, second = blocks
    second = jnp.concatenate([second[..., 2 * n :], second[..., : 2 * n]], axis=-1)
    per_area = jnp.concatenate([jnp.tile(part, 2) for part in per_area])
    step = per_area[:, None] * jnp.concatenate([first, second], axis=-2)
    # Light arrives along directions towards the surface and leaves along those away from it.
    towards = np.r_[0:n, 2 * n : 3 * n]
    away = towards + n
    enter = jnp.concatenate(cosines) * per_area[towards]
    twice = step @ step[..., towards]
    whole = inverse(jnp.eye(4 * n) - step)[..., away, :] @ twice * enter
    return RoughResponse(whole[..., :n, :n], whole[..., n:, n:], whole[..., :n, n:])


def rough_interface(
    grid: ChannelGrid,
    index_outer: Float[Array, ""],
    index_inner: Float[Array, ""],
    density: SlopeDensity,
    n_orders: int,
    sizes: RoughSizes,
) -> RoughInterface:
    """Reflection and transmission of a rough interface between channels.

    References
    ----------
    Heitz, Hanika, d'Eon, Dachsbacher 2016 ACM Trans. Graph. 35(4), 58 (multiple scattering by facets).
    """
    n_outer = sizes.n_outer or grid.kappa.shape[0]
    one = _one_facet(grid, index_outer, index_inner, density, sizes.rule, n_orders, n_outer)
    n_coarse = (sizes.coarse_nodes,) * len(grid.nodes_per_block)
    coarse = ChannelGrid(grid.block_index, grid.scatters, n_coarse, False)
    n_coarse_orders = min(sizes.coarse_orders, n_orders)
    several = _several_facets(coarse, index_outer, index_inner, density, sizes.coarse_rule, n_coarse_orders)
    to_fine, from_fine = coarse.interpolation(grid.kappa), grid.interpolation(coarse.kappa)
    return RoughInterface(one, jax.tree.map(lambda matrix: to_fine @ matrix @ from_fine, several))
