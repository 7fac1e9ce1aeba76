"""Light scattered by a rough interface between clear media, from the power spectrum of its height.

Polar angles are those in the medium of the light; the azimuth is that between the directions of propagation,
0 for forward. A change of height dz changes the phase of light from i to o by A dz, with

    A = k0 n_i (cos_i + cos_o) in reflection,    A = k0 |n_o cos_o - n_i cos_i| in transmission,

and scattering is due to the spatial frequency f = |n_o sin_o - n_i sin_i| / lambda (vectors in the plane).
Both are symmetric in i and o, and so is every BSDF here over the squared index of the exit side: reciprocity
is exact. Power is not exactly conserved, see `jaxink.surfaces.wave_power`.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from jaxink.numerics.precision import require_float64
from jaxink.optics import fresnel_reflectance, refracted_cosine
from jaxink.surfaces.spectrum import broadened
from jaxink.surfaces.wave_surface import WaveSurface, phase_per_height, spatial_frequency


def _complex_cosine(squared):
    """Root of the squared cosine; imaginary, for decaying light, if the channel is evanescent."""
    passes = squared > 0
    root = jnp.sqrt(jnp.maximum(jnp.abs(squared), 1e-30))
    return jnp.where(passes, root, 0.0) + 1j * jnp.where(passes, 0.0, root)


def _surface_fields(index_here, index_there, cosine):
    """Fields at a smooth interface over 2 cos, for unit incident amplitude: s, p tangential, p D_z."""
    squared = 1 - (index_here / index_there) ** 2 * (1 - cosine**2)
    beyond = _complex_cosine(squared)
    s = index_here / (index_here * cosine + index_there * beyond)
    p = index_here / (index_there * cosine + index_here * beyond)
    return s, p * beyond, p * jnp.sqrt(jnp.maximum(1 - cosine**2, 1e-24))


def perturbation_factor(
    surface: WaveSurface,
    cosine_out: Float[Array, "*#points"],
    cosine_in: Float[Array, "*#points"],
    azimuth_rad: Float[ArrayLike, "*#points"],
    is_transmission: bool | Bool[Array, ""],
) -> Float[Array, "*points"]:
    """BSDF over the PSD, um^-4 / sr, to first order in the height, unpolarised: Rayleigh-Rice for both sides.

    The heights act as a surface polarisation (n_i^2 - n_t^2) h, driven by the continuous fields at the smooth
    interface, tangential E and normal D. By reciprocity, the emission into a direction is given by the field
    at the interface of light from that direction. In reflection: 16 pi^2 n_i^4 cos_i cos_o Q / lambda^4.

    Parameters
    ----------
    surface
        The interface.
    cosine_out, cosine_in
        Cosines of the angles with the normal, each in its own medium.
    azimuth_rad
        Azimuth between the directions of propagation.
    is_transmission
        Whether light leaves on the other side.

    References
    ----------
    Rice 1951 Comm. Pure Appl. Math. 4, 351; Stover 2012 Optical Scattering, 3rd ed.; for the
    fields at a shifted interface Johnson et al. 2002 Phys. Rev. E 65, 066611.
    """
    n_i, n_t = surface.index_front, surface.index_back
    n_o, n_beyond = surface.index_out(is_transmission), jnp.where(is_transmission, n_i, n_t)
    s_in, along_in, normal_in = _surface_fields(n_i, n_t, cosine_in)
    s_out, along_out, normal_out = _surface_fields(n_o, n_beyond, cosine_out)
    across, turned = jnp.cos(azimuth_rad), jnp.sin(azimuth_rad)
    # Normal fields of waves from opposite sides have the same sign, those of waves from one side do not.
    sign = jnp.where(is_transmission, -1.0, 1.0)
    squares = (
        jnp.abs(s_in * s_out * across) ** 2
        + jnp.abs(s_in * along_out * turned) ** 2
        + jnp.abs(along_in * s_out * turned) ** 2
        + jnp.abs(along_in * along_out * across - sign * normal_in * normal_out) ** 2
    )
    step = (n_i**2 - n_t**2) ** 2
    whole = 16 * jnp.pi**2 / surface.wavelength_um**4 * n_o / n_i
    return whole * cosine_in * cosine_out * step * squares / 2


def _fresnel_factor(surface, cosine_out, cosine_in, is_transmission):
    """BSDF over the PSD in scalar theory: n_o^2 A^2 / lambda^2 and the mean Fresnel coefficient."""
    n_i, n_t = surface.index_front, surface.index_back
    n_o, n_beyond = surface.index_out(is_transmission), jnp.where(is_transmission, n_i, n_t)
    at_in = fresnel_reflectance(n_i, n_t, cosine_in, refracted_cosine(n_i, n_t, cosine_in))
    at_out = fresnel_reflectance(n_o, n_beyond, cosine_out, refracted_cosine(n_o, n_beyond, cosine_out))
    product = jnp.where(is_transmission, (1 - at_in) * (1 - at_out), at_in * at_out)
    mean = jnp.where(product > 0, jnp.sqrt(jnp.where(product > 0, product, 1.0)), 0.0)
    phase = phase_per_height(surface, cosine_out, cosine_in, is_transmission)
    return n_o**2 * phase**2 / surface.wavelength_um**2 * mean


def amplitude_factor(
    surface: WaveSurface,
    cosine_out: Float[Array, "*#points"],
    cosine_in: Float[Array, "*#points"],
    azimuth_rad: Float[ArrayLike, "*#points"],
    is_transmission: bool | Bool[Array, ""],
) -> Float[Array, "*#points"]:
    """BSDF over the broadened PSD, um^-4 / sr, by the surface's ``amplitude``; see `perturbation_factor`.

    If it does not depend on the azimuth, that axis has length 1.
    """
    if surface.amplitude == "perturbation":
        return perturbation_factor(surface, cosine_out, cosine_in, azimuth_rad, is_transmission)
    return _fresnel_factor(surface, cosine_out, cosine_in, is_transmission)


@eqx.filter_jit
def _bsdf(surface, cosine_out, cosine_in, azimuth_rad, is_transmission):
    n_i, n_o = surface.index_front, surface.index_out(is_transmission)
    out, into = cosine_out[:, None], cosine_in[:, None]
    sine_out, sine_in = (jnp.sqrt(jnp.maximum(1 - c**2, 0.0)) for c in (out, into))
    frequency = spatial_frequency(surface, n_o * sine_out, n_i * sine_in, azimuth_rad)
    spectrum = surface.spectrum
    if surface.several_orders:
        phase = phase_per_height(surface, cosine_out, cosine_in, is_transmission)
        position = jnp.log(2 * jnp.pi * frequency * spectrum.length_um)
        density = broadened(spectrum, phase**2 * spectrum.height_variance_um2, position)
    else:
        density = spectrum.density_um4(frequency)
    return amplitude_factor(surface, out, into, azimuth_rad, is_transmission) * density


def scattered_bsdf(
    surface: WaveSurface,
    cosine_out: Float[ArrayLike, " pairs"],
    cosine_in: Float[ArrayLike, " pairs"],
    azimuth_rad: Float[ArrayLike, "pairs azimuths"],
    is_transmission: bool,
) -> Float[Array, "pairs azimuths"]:
    """BSDF of scattered light, 1/sr, without the cosine and without regular (specular or direct) light.

    Valid for small slopes (sharp edges, shadowing and light that meets the surface twice are neglected) if
    the spectrum is known at f; `jaxink.surfaces.wave_power.validity` gives the criteria. For A sigma << 1 it
    is `perturbation_factor` times the PSD; for A sigma >> 1 it is the lobe of facets with the spectrum's
    slope variance. Values below about 1e-10 of a lobe's peak are rounding errors.

    Parameters as for `perturbation_factor`; several azimuths for each pair of polar angles cost little. The
    result is differentiable in the fields of the surface.

    References
    ----------
    Krywonos, Harvey, Choi 2011 JOSA A 28, 1121 (generalised Harvey-Shack); Rice 1951 Comm. Pure Appl.
    Math. 4, 351.
    """
    require_float64()
    cosine_out, cosine_in = jnp.asarray(cosine_out), jnp.asarray(cosine_in)
    return _bsdf(surface, cosine_out, cosine_in, jnp.asarray(azimuth_rad), is_transmission)
