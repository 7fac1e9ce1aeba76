"""A rough interface by wave optics: what a change of its height does to light, and its regular light.

Angles, A and f as in `jaxink.surfaces.wave_optics`.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from jaxink.errors import require_one_of
from jaxink.optics.fresnel import fresnel_reflectance, refracted_cosine
from jaxink.surfaces.spectrum import PowerSpectrum

AMPLITUDES = ("perturbation", "fresnel")


class WaveSurface(eqx.Module):
    """A rough interface by wave optics.

    Parameters
    ----------
    spectrum
        Of the height.
    index_front, index_back
        Refractive indices of the medium that light comes from and of the other; real.
    wavelength_nm
        In vacuum.
    amplitude
        How strongly each unit of height scatters. ``perturbation``: by first-order vector perturbation
        theory, unpolarised, exact for a slightly rough surface at all angles; evanescent light and total
        reflection are in it. ``fresnel``: the scalar choice of generalised Harvey-Shack, A^2 times the
        geometric mean of the Fresnel coefficients at both directions, for small angles.
    several_orders
        Whether scattering by more than the first order in A sigma is counted (generalised Harvey-Shack);
        without, and with ``perturbation``, it is Rayleigh-Rice.
    """

    spectrum: PowerSpectrum
    index_front: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    index_back: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    wavelength_nm: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    amplitude: str = eqx.field(static=True, default="perturbation")
    several_orders: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        require_one_of("amplitude", self.amplitude, AMPLITUDES)

    @property
    def reversed(self) -> "WaveSurface":
        """The same interface, lit from its other side."""
        return eqx.tree_at(lambda s: (s.index_front, s.index_back), self, (self.index_back, self.index_front))

    def index_out(self, is_transmission: bool | Bool[Array, ""]) -> Float[Array, ""]:
        """Refractive index of the medium that light leaves to."""
        return jnp.where(is_transmission, self.index_back, self.index_front)

    @property
    def wavelength_um(self) -> Float[Array, ""]:
        """In vacuum."""
        return self.wavelength_nm / 1000


def phase_per_height(
    surface: WaveSurface,
    cosine_out: Float[ArrayLike, "*#shape"],
    cosine_in: Float[ArrayLike, "*#shape"],
    is_transmission: bool | Bool[Array, ""],
) -> Float[Array, "*shape"]:
    """A, the phase by which light changes for each um of height.

    Parameters
    ----------
    surface
        The interface.
    cosine_out, cosine_in
        With the normal, each in its own medium.
    is_transmission
        Whether light leaves on the other side.

    Returns
    -------
    Float[Array, "*shape"]
        rad/um.

    References
    ----------
    Krywonos, Harvey, Choi 2011 JOSA A 28, 1121.
    """
    wavenumber, into = 2 * jnp.pi / surface.wavelength_um, surface.index_front * cosine_in
    out = surface.index_out(is_transmission) * cosine_out
    return wavenumber * jnp.where(is_transmission, jnp.abs(out - into), out + into)


def spatial_frequency(
    surface: WaveSurface,
    kappa_out: Float[ArrayLike, "*#shape"],
    kappa_in: Float[ArrayLike, "*#shape"],
    azimuth_rad: Float[ArrayLike, "*#shape"],
) -> Float[Array, "*shape"]:
    """Frequency of the heights that scatter light from one direction into another.

    Parameters
    ----------
    surface
        The interface.
    kappa_out, kappa_in
        Optical sines n sin(theta) of both directions.
    azimuth_rad
        Between the directions of propagation.

    Returns
    -------
    Float[Array, "*shape"]
        1/um, above 0.
    """
    # Law of cosines without cancellation near the specular direction.
    squared = (kappa_out - kappa_in) ** 2 + 4 * kappa_out * kappa_in * jnp.sin(azimuth_rad / 2) ** 2
    return jnp.sqrt(jnp.maximum(squared, 1e-30)) / surface.wavelength_um


def regular_power(
    surface: WaveSurface, cosine_in: Float[Array, " angles"], is_transmission: bool
) -> Float[Array, " angles"]:
    """Share of the power that leaves in the specular or refracted direction: Fresnel exp(-A^2 sigma^2).

    Parameters
    ----------
    surface
        The interface.
    cosine_in
        Of incidence.
    is_transmission
        Whether light leaves on the other side; 0 beyond the critical angle.
    """
    n_i, n_t = surface.index_front, surface.index_back
    beyond = refracted_cosine(n_i, n_t, cosine_in)
    reflected = fresnel_reflectance(n_i, n_t, cosine_in, beyond)
    power, cosine_out = (1 - reflected, beyond) if is_transmission else (reflected, cosine_in)
    phase = phase_per_height(surface, cosine_out, cosine_in, is_transmission)
    return power * jnp.exp(-(phase**2) * surface.spectrum.height_variance_um2)
