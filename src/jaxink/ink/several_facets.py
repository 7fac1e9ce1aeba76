"""Light that meets several facets of a rough boundary, on the directions of a table.

The meetings are those of `jaxink.surfaces.interface`, between channels of their own. What leaves after two or
more of them has no narrow lobes and is interpolated to the table. Its power is known from elsewhere: a
boundary that does not absorb sends out all that does not leave after one meeting. One factor for each
direction of either side gives the table exactly this power and keeps reciprocity.
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.ink.polar_grid import linear_matrix
from jaxink.optics import ChannelGrid, propagating_cosine
from jaxink.surfaces import FacetRule, SlopeDensity, next_facet

# Channels of each block, azimuthal orders, and facets that each channel sees.
_N_NODES, _N_ORDERS, _RULE = 32, 12, FacetRule(96, 24)
_LEAST_STEP = 1e-9
_MOST_STEPS, _BALANCED = 500, 1e-10
# Largest angle of the factors that are reported.
_LARGEST_THETA_DEG = 80.0


@dataclasses.dataclass(frozen=True)
class SeveralFacets:
    """Basic radiance that leaves after two or more facets, over irradiance.

    Axes of length 2 are side I and side A.

    Parameters
    ----------
    kernel
        By the side of incidence and of exit, 1/sr, shape ``(2, 2, angles, angles, azimuths)``, incidence
        first.
    factors
        Smallest and largest factor of an entry away from grazing that the power of the table required.
    """

    kernel: Float[np.ndarray, "2 2 angles angles azimuths"]
    factors: tuple[float, float]


def several_facets(
    density: SlopeDensity,
    indices: tuple[float, float],
    theta_deg: Float[np.ndarray, " angles"],
    phi_deg: Float[np.ndarray, " azimuths"],
    projected_solid_angle: Float[np.ndarray, "angles azimuths"],
    power: Float[np.ndarray, "2 angles"],
) -> SeveralFacets:
    """Light that meets several facets.

    Parameters
    ----------
    density
        Slope density of the facets.
    indices
        Refractive indices of side I and side A.
    theta_deg, phi_deg
        Directions of the table; azimuth 180 is straight on.
    projected_solid_angle
        Weights with which the table is integrated.
    power
        Share of the incident power that is left after one meeting, by side and angle of incidence.
    """
    outer, inner = sorted(indices)
    # Without an index step, there is no second block; it must not be empty.
    inner = max(inner, outer * (1 + _LEAST_STEP))
    # Laws consist of numbers; as arrays, one program serves them all.
    density = jax.tree.map(lambda number: jnp.asarray(number, float), density)
    kernels, cosines = _kernels(density, jnp.asarray(outer), jnp.asarray(inner))
    kernels, cosines = np.asarray(kernels), np.asarray(cosines)
    turned = slice(None) if indices[0] == outer else slice(None, None, -1)
    kernels, cosines = kernels[:, turned][:, :, :, turned], cosines[turned]
    orders = np.arange(_N_ORDERS)
    series = np.where(orders == 0, 1.0, 2.0)[:, None] * np.cos(orders[:, None] * np.deg2rad(180.0 - phi_deg))
    rows = [_rows(np.rad2deg(np.arccos(c)), theta_deg, c > 0) for c in cosines]
    kernel = np.array(
        [
            [
                np.einsum("mio,mp->iop", into @ kernels[:, come, :, leave] @ out.T, series, optimize=True)
                for leave, out in enumerate(rows)
            ]
            for come, into in enumerate(rows)
        ]
    )
    away = theta_deg <= _LARGEST_THETA_DEG
    return _with_power(np.maximum(kernel, 0.0), projected_solid_angle, indices, power, away)


def _rows(known_deg, theta_deg, propagates) -> np.ndarray:
    """Matrix of linear interpolation from the channels of a side, constant beyond the last."""
    order = np.argsort(known_deg[propagates])
    known = known_deg[propagates][order]
    rows = np.zeros((len(theta_deg), len(known_deg)))
    at = np.flatnonzero(propagates)[order]
    rows[:, at] = linear_matrix(known, np.clip(theta_deg, known[0], known[-1]))
    return rows


@eqx.filter_jit
def _kernels(density: SlopeDensity, outer: Float[Array, ""], inner: Float[Array, ""]):
    """Kernels between channels, ``(orders, 2, channels, 2, channels)``, and cosines; the outer side first."""
    n_nodes = (_N_NODES, _N_NODES)
    grid = ChannelGrid(jnp.stack([outer, inner]), jnp.zeros(2, bool), n_nodes, False)
    step, areas = next_facet(grid, outer, inner, density, _RULE, _N_ORDERS, _N_NODES)
    n = len(grid.kappa)
    cosines = jnp.stack([propagating_cosine(grid.squared_cosine(index)) for index in (outer, inner)])
    # Light arrives along directions towards the surface and leaves along those away from it.
    towards = np.r_[0:n, 2 * n : 3 * n]
    twice = step @ step[..., towards]
    leaving = jnp.linalg.solve(jnp.eye(4 * n) - step, twice)[..., towards + n, :]
    # From basic radiance along channels to a kernel, whose integral over kappa and azimuth is the radiance.
    weight = 2 * jnp.pi * jnp.tile(grid.etendue_weight, 2)
    rows = leaving * (cosines / areas).ravel()
    # Rows are exact for smooth light; by reciprocity each entry is known from two. A channel of small weight
    # is hardly met by other rows, so that its own row counts more.
    kernel = (rows + rows.swapaxes(-1, -2)) / (weight + weight[:, None])
    seen = (cosines > 0).ravel()
    kernel = jnp.where(seen[:, None] & seen, kernel, 0.0)
    return kernel.reshape(_N_ORDERS, 2, n, 2, n), cosines


def _with_power(kernel, solid, indices, power, away) -> SeveralFacets:
    """The kernel with one factor for each direction, so that it sends out the stated power."""
    squared = np.square(indices)
    # Power that leaves to each direction of each side, of light from each direction of each side.
    sent = np.einsum("abiop,op,b->aibo", kernel, solid, squared, optimize=True)
    n = kernel.shape[2]
    sent, wanted = sent.reshape(2 * n, 2 * n), np.maximum(power, 0.0).ravel()
    factor = np.ones(2 * n)
    for _ in range(_MOST_STEPS):
        total = factor * (sent @ factor)
        ratio = np.where(total > 0, wanted / np.where(total > 0, total, 1.0), 1.0)
        if np.max(np.abs(total - wanted)) < _BALANCED:
            break
        factor *= np.sqrt(ratio)
    factor = factor.reshape(2, n)
    scaled = kernel * factor[:, None, :, None, None] * factor[None, :, None, :, None]
    away = factor[:, away]
    return SeveralFacets(scaled, (float(away.min() ** 2), float(away.max() ** 2)))
