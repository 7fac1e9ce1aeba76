"""Rows of matrices between channels for light scattered by an interface in wave optics.

Each row is an integral over the directions that scatter into a channel. The integral runs over the azimuth
first: its moments at a polar angle serve all the polynomials of a block. Both quadratures are centred on the
regular direction, and that over the polar angle ends with the block, where the kernel or its derivatives
may jump.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from jaxink.numerics.chebyshev import chebyshev_moments
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.optics.channels import ChannelGrid
from jaxink.optics.fresnel import propagating_cosine
from jaxink.surfaces.broadened_spectrum import BroadenedSpectrum
from jaxink.surfaces.channel_rows import block_polynomials, node_coefficients
from jaxink.surfaces.wave_optics import amplitude_factor
from jaxink.surfaces.wave_surface import WaveSurface, phase_per_height, spatial_frequency

# Nodes over the optical sine in each block, and over half a turn of the azimuth.
_N_RADIAL, _N_AROUND = 32, 24
# Largest width of a lobe in azimuth, beyond which nodes are spread evenly.
_WIDEST = 3.0


def lobe_kernel(
    surface: WaveSurface,
    table: BroadenedSpectrum,
    cosine_out: Float[Array, "*#points"],
    cosine_in: Float[Array, "*#points"],
    azimuth_rad: Float[ArrayLike, "*#points"],
    frequency_per_um: Float[Array, "*#points"],
    is_transmission: bool | Bool[Array, ""],
) -> Float[Array, "*points"]:
    """BSDF of scattered light over the squared index of the exit side; the cosines must be above 0."""
    factor = amplitude_factor(surface, cosine_out, cosine_in, azimuth_rad, is_transmission)
    phase = phase_per_height(surface, cosine_out, cosine_in, is_transmission)
    return factor * table.density_um4(phase, frequency_per_um) / surface.index_out(is_transmission) ** 2


def _radial_nodes():
    """Nodes and weights on (0, 1) that crowd at both ends, where a cosine has the slope of a square root."""
    unit, weight = gauss_legendre_unit(_N_RADIAL)
    x = 2 * unit - 1
    return (1 + (x - x**7 / 7) * 7 / 6) / 2, weight * (1 - x**6) * 7 / 6


def _around(optical_sine, sine, lobe_width):
    """Azimuths from 0 to pi and weights of both halves of the turn, on a new last axis, without derivatives.

    The integral does not depend on where its nodes are.
    """
    distance = jnp.sqrt((optical_sine - sine) ** 2 + lobe_width**2)
    width = jnp.minimum(distance / jnp.sqrt(optical_sine * sine + 1e-12), _WIDEST)[..., None]
    width = jax.lax.stop_gradient(width)
    end = jnp.arcsinh(jnp.pi / width)
    unit, weight = gauss_legendre_unit(_N_AROUND)
    return width * jnp.sinh(end * unit), 2 * end * weight * width * jnp.cosh(end * unit)


def row_in_block(
    grid: ChannelGrid,
    block: int,
    surface: WaveSurface,
    table: BroadenedSpectrum,
    lobe_width: Float[Array, ""],
    cosine: Float[Array, ""],
    is_transmission: bool | Bool[Array, ""],
    n_orders: int,
) -> Float[Array, "orders nodes"]:
    """Light scattered into a direction from a field, as weights of its values at the channels of one block.

    Parameters
    ----------
    grid, block
        The channels and the position of the block.
    surface
        The interface as seen from the side on which the light leaves; by reciprocity its kernel is that of
        light propagating the other way.
    table
        Its broadened spectra.
    lobe_width
        Result of `typical_lobe_width`, on which only the nodes depend.
    cosine
        Cosine of the direction on that side, above 0.
    is_transmission
        Whether the light comes from the other side.
    n_orders
        Number of azimuthal orders. Odd ones act on the field over the optical sine.
    """
    index_source = surface.index_out(is_transmission)
    sine = surface.index_front * jnp.sqrt(jnp.maximum(1 - cosine**2, 1e-12))
    start = grid.block_index[block - 1] if block else jnp.zeros(())
    end = grid.block_index[block]
    first, last = (jnp.arcsinh((limit - sine) / lobe_width) for limit in (start, end))
    unit, unit_weight = _radial_nodes()
    distance = lobe_width * jnp.sinh(first + (last - first) * unit)
    kappa = jnp.clip(sine + distance, start, end)
    area = (last - first) * unit_weight * jnp.sqrt(lobe_width**2 + distance**2) * kappa
    azimuth, azimuth_weight = _around(kappa, sine, lobe_width)
    cosine_source = propagating_cosine(1 - (kappa / index_source) ** 2)[:, None]
    safe = jnp.maximum(cosine_source, 1e-9)
    frequency = spatial_frequency(surface, sine, kappa[:, None], azimuth)
    density = lobe_kernel(surface, table, safe, cosine, azimuth, frequency, is_transmission)
    density = jnp.where(cosine_source > 0, density * azimuth_weight, 0.0)
    moments = area * chebyshev_moments(jnp.cos(azimuth), density, n_orders)
    # Odd orders vanish like the sine towards the normal; they are interpolated without it.
    moments = moments * jnp.where((np.arange(n_orders) % 2 == 1)[:, None], kappa, 1.0)
    polynomials = block_polynomials(grid, block, kappa)
    return moments @ polynomials.T @ node_coefficients(grid.nodes_per_block[block])


def typical_lobe_width(
    surface: WaveSurface, table: BroadenedSpectrum, is_transmission: bool | Bool[Array, ""]
) -> Float[Array, ""]:
    """Typical distance of scattered light from the regular direction in optical sines; not differentiated."""
    regular = phase_per_height(surface, jnp.ones(()), jnp.ones(()), is_transmission)
    highest = 2 * jnp.maximum(surface.index_front, surface.index_back) / surface.wavelength_um
    typical = table.typical_frequency_per_um(regular, highest) * surface.wavelength_um
    return jax.lax.stop_gradient(jnp.minimum(typical, 1.0))
