"""A rough interface in wave optics: phases, spatial frequencies and regular light.

Regular light is specular or directly transmitted. Angles, A and f as in `jaxink.surfaces.wave_optics`.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from jaxink.errors import require_one_of
from jaxink.numerics.validity import as_float
from jaxink.optics import fresnel_reflectance, refracted_cosine
from jaxink.surfaces.spectrum import PowerSpectrum

AMPLITUDES = ("perturbation", "fresnel")


class WaveSurface(eqx.Module):
    """A rough interface in wave optics.

    Parameters
    ----------
    spectrum
        Power spectrum of the height.
    index_front, index_back
        Real refractive indices of the medium of incidence and of the other one.
    wavelength_nm
        Wavelength in vacuum.
    amplitude
        Scattering per unit of height. ``perturbation``: first-order vector perturbation theory, unpolarised,
        exact for a slightly rough surface at all angles, including evanescent light and total reflection.
        ``fresnel``: the scalar choice of generalised Harvey-Shack, A^2 times the geometric mean of the
        Fresnel coefficients at both directions, for small angles.
    several_orders
        Whether to include higher orders in A sigma (generalised Harvey-Shack); otherwise, with
        ``perturbation``, it is Rayleigh-Rice.
    """

    spectrum: PowerSpectrum
    index_front: Float[Array, ""] = eqx.field(converter=as_float)
    index_back: Float[Array, ""] = eqx.field(converter=as_float)
    wavelength_nm: Float[Array, ""] = eqx.field(converter=as_float)
    amplitude: str = eqx.field(static=True, default="perturbation")
    several_orders: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        require_one_of("amplitude", self.amplitude, AMPLITUDES)

    @property
    def reversed(self) -> "WaveSurface":
        """The same interface, illuminated from the other side."""
        return eqx.tree_at(lambda s: (s.index_front, s.index_back), self, (self.index_back, self.index_front))

    def index_out(self, is_transmission: bool | Bool[Array, ""]) -> Float[Array, ""]:
        """Refractive index of the exit side."""
        return jnp.where(is_transmission, self.index_back, self.index_front)

    @property
    def wavelength_um(self) -> Float[Array, ""]:
        """Wavelength in vacuum."""
        return self.wavelength_nm / 1000


def phase_per_height(
    surface: WaveSurface,
    cosine_out: Float[ArrayLike, "*#shape"],
    cosine_in: Float[ArrayLike, "*#shape"],
    is_transmission: bool | Bool[Array, ""],
) -> Float[Array, "*shape"]:
    """A, the phase per height, rad/um; each cosine is with the normal in its own medium.

    References
    ----------
    Krywonos, Harvey, Choi 2011 JOSA A 28, 1121.
    """
    wavenumber, into = 2 * jnp.pi / surface.wavelength_um, surface.index_front * cosine_in
    out = surface.index_out(is_transmission) * cosine_out
    return wavenumber * jnp.where(is_transmission, jnp.abs(out - into), out + into)


def spatial_frequency(
    surface: WaveSurface,
    kappa_out: Float[Array, "*#shape"],
    kappa_in: Float[Array, "*#shape"],
    azimuth_rad: Float[ArrayLike, "*#shape"],
) -> Float[Array, "*shape"]:
    """Spatial frequency, 1/um, above 0, that scatters light from one direction into another.

    ``kappa_out`` and ``kappa_in`` are optical sines n sin(theta).
    """
    # Law of cosines without cancellation near the specular direction.
    squared = (kappa_out - kappa_in) ** 2 + 4 * kappa_out * kappa_in * jnp.sin(azimuth_rad / 2) ** 2
    return jnp.sqrt(jnp.maximum(squared, 1e-30)) / surface.wavelength_um


def regular_power(
    surface: WaveSurface, cosine_in: Float[Array, " angles"], is_transmission: bool
) -> Float[Array, " angles"]:
    """Fraction of the power in regular light, reflected or transmitted: Fresnel times exp(-A^2 sigma^2).

    In transmission it is 0 beyond the critical angle.
    """
    n_i, n_t = surface.index_front, surface.index_back
    beyond = refracted_cosine(n_i, n_t, cosine_in)
    reflected = fresnel_reflectance(n_i, n_t, cosine_in, beyond)
    power, cosine_out = (1 - reflected, beyond) if is_transmission else (reflected, cosine_in)
    phase = phase_per_height(surface, cosine_out, cosine_in, is_transmission)
    return power * jnp.exp(-(phase**2) * surface.spectrum.height_variance_um2)
