"""Rough interfaces tabulated over the range of their angle, if nothing else is free."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.compiling import hastily
from jaxink.numerics.weak_cache import WeakCache
from jaxink.optics.channels import ChannelGrid
from jaxink.surfaces.facets import FacetRule
from jaxink.surfaces.interface import RoughInterface, RoughSizes, rough_interface
from jaxink.surfaces.slopes import slope_density

# Added to the angle before taking the logarithm; below this, in degrees, a surface is practically smooth.
_SMOOTH_DEG = 0.3
# Distance beyond the ends of the range, relative to half its logarithm, that is due to rounding.
_ROUNDING = 1e-9
# Nodes of the angle per factor of e in its range, and their largest and smallest number.
_NODES_PER_E, _MOST_NODES, _FEWEST_NODES = 4, 24, 6


class RoughTable(eqx.Module):
    """A rough interface at Chebyshev nodes of log(sigma + 0.3 deg).

    Parameters
    ----------
    interface
        Interfaces at the nodes, along the leading axis.
    sigma_deg
        Range of the angle.
    """

    interface: RoughInterface
    sigma_deg: tuple[float, float] = eqx.field(static=True)

    def at(self, sigma_deg: Float[Array, ""]) -> RoughInterface:
        """Interface at an angle within the range; differentiable."""
        n_nodes = jax.tree.leaves(self.interface)[0].shape[0]
        if n_nodes == 1:
            return jax.tree.map(lambda values: values[0], self.interface)
        low, high = (math.log(limit + _SMOOTH_DEG) for limit in self.sigma_deg)
        x = (2 * jnp.log(sigma_deg + _SMOOTH_DEG) - low - high) / (high - low)
        # At the ends of the range a clipped value, and an angle arccos(x), have no one-sided derivative.
        x = jnp.where(jnp.abs(x) > 1 + _ROUNDING, jnp.clip(x, -1.0, 1.0), x)
        polynomials = [jnp.ones_like(x), x]
        while len(polynomials) < n_nodes:
            polynomials.append(2 * x * polynomials[-1] - polynomials[-2])
        degrees = np.arange(n_nodes)
        share = np.where(degrees == 0, 1.0, 2.0) * jnp.stack(polynomials) / n_nodes
        weights = share @ np.cos(np.outer(degrees, _angles(n_nodes)))
        return jax.tree.map(lambda values: jnp.tensordot(weights, values, axes=1), self.interface)


def _angles(n_nodes: int) -> np.ndarray:
    return (np.arange(n_nodes) + 0.5) * np.pi / n_nodes


def rough_table(
    grid: ChannelGrid,
    indices: tuple[Float[Array, ""], Float[Array, ""]],
    density: str,
    sigma_deg: tuple[float, float],
    n_orders: int,
    n_outer: int | None,
) -> RoughTable:
    """Tabulate a rough interface over the range of its angle.

    Parameters
    ----------
    grid
        The channels, not traced.
    indices
        Refractive indices on the outer and on the inner side.
    density
        Name of the slope density, one of `jaxink.surfaces.slopes.DENSITIES`.
    sigma_deg
        Range of the angle; equal limits if it is fixed.
    n_orders
        Number of azimuthal orders.
    n_outer
        As in `RoughSizes`.
    """
    low, high = (math.log(limit + _SMOOTH_DEG) for limit in sigma_deg)
    if low == high:
        nodes = np.array([sigma_deg[0]])
    else:
        n_nodes = min(max(round(_NODES_PER_E * (high - low)), _FEWEST_NODES), _MOST_NODES)
        nodes = np.exp((low + high) / 2 + (high - low) / 2 * np.cos(_angles(n_nodes))) - _SMOOTH_DEG
    # The quadratures may be fine, because they are computed once and not in every step.
    sizes = RoughSizes(FacetRule(72, 20), FacetRule(36, 8), n_outer, coarse_nodes=12)
    at_angles = _programs(density, n_orders, sizes)
    return RoughTable(at_angles(grid, indices, jnp.asarray(nodes)), sigma_deg)


def _at_angles(density: str, n_orders: int, sizes: RoughSizes):
    def at_angles(grid, indices, nodes):
        def at(sigma_deg):
            return rough_interface(grid, *indices, slope_density(density, sigma_deg), n_orders, sizes)

        return jax.lax.map(at, nodes)

    # Runs once for each face.
    return hastily(at_angles, level=1)


_programs = WeakCache(_at_angles)
