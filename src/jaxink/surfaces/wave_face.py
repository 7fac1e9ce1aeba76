"""A rough interface in wave optics inside a stack: matrices between channels, regular light, lobes.

Regular light is specular or directly transmitted. The theory of `jaxink.surfaces.wave_optics` is reciprocal
but does not conserve power. Here light reflected back to the outer side follows the theory unchanged; light
that crosses the interface or is reflected inside is multiplied by a factor for each of the two directions,
which preserves reciprocity, such that power is conserved.

Rows of matrices between channels for light scattered by an interface in wave optics.

Each row is an integral over the directions that scatter into a channel. The integral runs over the azimuth
first: its moments at a polar angle serve all the polynomials of a block. Both quadratures are centred on the
regular direction, and that over the polar angle ends with the block, where the kernel or its derivatives
may jump.
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from jaxink.numerics.chebyshev import chebyshev_moments
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.numerics.validity import as_float
from jaxink.optics import ChannelGrid, fresnel_reflectance, propagating_cosine
from jaxink.surfaces.channel_rows import block_polynomials, node_coefficients
from jaxink.surfaces.interface import RoughResponse, WaveInterface, WaveLobes
from jaxink.surfaces.spectrum import BroadenedSpectrum, PowerSpectrum
from jaxink.surfaces.wave_optics import amplitude_factor
from jaxink.surfaces.wave_surface import WaveSurface, phase_per_height, spatial_frequency

# Steps of the scaling, and power below which it has no effect.
_N_SCALINGS, _NOTHING = 60, 1e-12
# Nodes over the optical sine in each block, and over half a turn of the azimuth.
_N_RADIAL, _N_AROUND = 32, 24
# Largest width of a lobe in azimuth, beyond which nodes are spread evenly.
_WIDEST = 3.0


class WaveFace(eqx.Module):
    """A rough face of a layer in wave optics: a `WaveSurface` without the indices, which the stack has."""

    spectrum: PowerSpectrum
    wavelength_nm: Float[Array, ""] = eqx.field(converter=as_float)
    amplitude: str = eqx.field(static=True, default="perturbation")

    def between(self, index_here: Float[Array, ""], index_there: Float[Array, ""]) -> WaveSurface:
        """The interface as seen from the medium ``index_here``."""
        return WaveSurface(self.spectrum, index_here, index_there, self.wavelength_nm, self.amplitude)


def kept_regular(face: WaveFace, indices: Sequence, cosines: Sequence) -> tuple:
    """Factors exp(-A^2 sigma^2) of regular light reflected in front, reflected behind, and transmitted.

    ``indices`` and ``cosines`` are those in front and behind.
    """
    front, back = cosines
    surface = face.between(*indices)
    phases = (
        phase_per_height(surface, front, front, False),
        phase_per_height(surface.reversed, back, back, False),
        phase_per_height(surface, back, front, True),
    )
    return tuple(jnp.exp(-face.spectrum.height_variance_um2 * phase**2) for phase in phases)


def _broadened_for(face: WaveFace, index_1: Float[Array, ""], index_2: Float[Array, ""]) -> BroadenedSpectrum:
    """Table for all light at an interface; reflection in the medium of higher index has the largest phase."""
    wavenumber = 2 * jnp.pi / face.wavelength_nm * 1000
    return BroadenedSpectrum.of(face.spectrum, 2 * wavenumber * jnp.maximum(index_1, index_2))


def _raw_matrices(grid, indices, cosines, face, table, n_orders, n_outer):
    """Matrices of light reflected outside and inside, leaving and entering, power not yet conserved."""
    n, first_channel = cosines[0].shape[0], np.cumsum((0, *grid.nodes_per_block))
    sides = [(0, 0), (1, 1), (0, 1), (1, 0)]
    receivers = [np.arange(n_outer if here == 0 else n) for here, _ in sides]
    matrices = [jnp.zeros((n_orders, n, n)) for _ in sides]

    def lobe_width(here, there):
        return typical_lobe_width(face.between(indices[here], indices[1 - here]), table, here != there)

    widths = jax.vmap(lobe_width)(*jnp.array(sides).T)
    for block, first in enumerate(first_channel[:-1]):
        lit = [k for k, (_, there) in enumerate(sides) if there == 1 or first < n_outer]

        def row(here, there, width, channel, block=block):
            surface, cosine = face.between(indices[here], indices[1 - here]), cosines[here, channel]
            return row_in_block(grid, block, surface, table, width, cosine, here != there, n_orders)

        # All at once, to reduce compilation.
        sizes = [receivers[k].size for k in lit]
        pair, channel = np.repeat(lit, sizes), np.concatenate([receivers[k] for k in lit])
        here, there = jnp.array(sides)[pair].T
        rows = jax.vmap(row, out_axes=1)(here, there, widths[pair], jnp.array(channel))
        columns = slice(first, first_channel[block + 1])
        for k, found in zip(lit, jnp.split(rows, np.cumsum(sizes)[:-1], axis=1), strict=True):
            matrices[k] = matrices[k].at[:, receivers[k], columns].set(found)
    odd = (np.arange(n_orders) % 2 == 1)[:, None, None]
    return [matrix / jnp.where(odd, grid.kappa, 1.0) for matrix in matrices]


def wave_interface(
    grid: ChannelGrid,
    index_outer: Float[Array, ""],
    index_inner: Float[Array, ""],
    face: WaveFace,
    n_orders: int,
    n_outer: int | None = None,
) -> WaveInterface:
    """Reflection and transmission of an interface in wave optics between channels, with its regular light.

    Power is conserved as described at the top of this module.

    Parameters
    ----------
    grid
        The channels.
    index_outer, index_inner
        Refractive indices on either side.
    face
        The interface.
    n_orders
        Number of azimuthal orders.
    n_outer
        Number of channels, the first ones, that propagate outside; None if unknown.
    """
    table = _broadened_for(face, index_outer, index_inner)
    cosines = [propagating_cosine(grid.squared_cosine(n)) for n in (index_outer, index_inner)]
    inside = [jnp.where(cosine > 0, 1.0, 0.0) for cosine in cosines]
    index, exists = jnp.stack([index_outer, index_inner]), jnp.stack(inside)
    safe = jnp.where(exists > 0, jnp.stack(cosines), 0.5)
    matrices = _raw_matrices(grid, index, safe, face, table, n_orders, n_outer or exists.shape[1])
    receiver, source = exists[jnp.array([0, 1, 0, 1])], exists[jnp.array([0, 1, 1, 0])]
    *others, entering = receiver[:, None, :, None] * jnp.stack(matrices) * source[:, None, None, :]
    raw = RoughResponse(*others)
    fresnel = fresnel_reflectance(index_outer, index_inner, *cosines)
    shares = fresnel * inside[0], fresnel * inside[1], (1 - fresnel) * inside[0] * inside[1]
    kept = kept_regular(face, (index_outer, index_inner), cosines)
    regular = tuple(share * factor for share, factor in zip(shares, kept, strict=True))
    # For light of a single channel, the rows of `entering` are more accurate than the transpose of `leaving`.
    at_outer, at_inner = _scales(raw, entering[0], regular, inside)
    one = RoughResponse(
        raw.outer_reflection,
        at_inner[:, None] * raw.inner_reflection * at_inner,
        at_outer[:, None] * raw.leaving * at_inner,
    )
    none = jax.tree.map(lambda matrix: matrix[:0], one)
    return WaveInterface(one, none, RoughResponse(*regular), WaveLobes((at_outer, at_inner), table))


def _scales(raw: RoughResponse, entering, regular, inside):
    """Factors of the directions on either side that conserve power.

    With M the matrix of light that crosses or is reflected inside, between all channels of both sides, and t
    the power available for it, solve x (M x) = t by a damped iteration that keeps x above 0.
    """
    n = entering.shape[0]
    crossing, within = raw.leaving[0], raw.inner_reflection[0]
    outside = jnp.sum(raw.outer_reflection[0], axis=1) + regular[0] + regular[2]
    target = jnp.concatenate([1 - outside, 1 - regular[1] - regular[2]])
    # The factor is 1 if nothing is scattered or a channel does not exist.
    exists = jnp.concatenate(inside) > 0
    target = jnp.where(exists, jnp.maximum(target, 0.0), 0.0) + _NOTHING

    def scaled(x, _):
        outer, inner = x[:n], x[n:]
        met = jnp.concatenate([crossing @ inner, entering @ outer + within @ inner])
        return jnp.sqrt(x * target / (jnp.where(exists, met, 0.0) + _NOTHING / x)), None

    factors, _ = jax.lax.scan(scaled, jnp.ones(2 * n), length=_N_SCALINGS)
    return factors[:n], factors[n:]


def wave_lobes(
    face: WaveFace,
    table: BroadenedSpectrum,
    index: tuple[Float[Array, ""], Float[Array, ""]],
    cosines_out: tuple[Float[Array, " points"], Float[Array, " points"]],
    cosine_in: Float[Array, " points"],
    azimuth_rad: Float[ArrayLike, " points"],
) -> tuple[Float[Array, " points"], Float[Array, " points"]]:
    """Reflected and transmitted lobes, basic radiance per irradiance in 1/sr, without `WaveLobes.factors`.

    Parameters
    ----------
    face
        The interface.
    table
        Of `WaveLobes`, valid for both sides.
    index
        Refractive indices of the medium of incidence and of the other one.
    cosines_out
        Cosines of the outgoing direction in either medium, above 0.
    cosine_in
        Cosine of incidence, above 0.
    azimuth_rad
        Azimuth between the directions of propagation.
    """
    surface = face.between(*index)
    sine_in = index[0] * jnp.sqrt(jnp.maximum(1 - cosine_in**2, 1e-24))

    def lobe(is_transmission, cosine_out):
        index_out = surface.index_out(is_transmission)
        sine_out = index_out * jnp.sqrt(jnp.maximum(1 - cosine_out**2, 1e-24))
        frequency = spatial_frequency(surface, sine_out, sine_in, azimuth_rad)
        return lobe_kernel(surface, table, cosine_out, cosine_in, azimuth_rad, frequency, is_transmission)

    return tuple(jax.vmap(lobe)(jnp.array([False, True]), jnp.stack(cosines_out)))


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
