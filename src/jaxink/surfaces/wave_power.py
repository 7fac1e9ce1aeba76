"""Power balance at an interface in wave optics, and criteria for the validity of the theory."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.precision import require_float64
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.optics import propagating_cosine, refracted_cosine
from jaxink.surfaces.wave_optics import scattered_bsdf
from jaxink.surfaces.wave_surface import WaveSurface, phase_per_height, regular_power

# Root mean square slope up to which perturbation theory is valid.
LARGEST_SLOPE = 0.3
# Nodes over the distance from the specular direction, in the plane of direction cosines, and around it.
_N_RADIAL, _N_AROUND = 64, 40


def _disc(index_out, sine_in_optical, scale):
    """Optical sines, azimuths and area weights of nodes over all propagating directions.

    The nodes are polar around the specular direction in the plane of direction cosines; weights include both
    halves of the plane.
    """
    psi_unit, psi_weight = gauss_legendre_unit(_N_AROUND)
    inside = sine_in_optical < index_out
    # From a point outside the disc of directions, only a cone of azimuths meets it.
    cone = jnp.arcsin(jnp.minimum(index_out / sine_in_optical, 1.0))
    opening = jnp.where(inside, jnp.pi, cone)
    psi = jnp.pi - opening * (1 - (1 - psi_unit) ** 2)
    psi_weight = opening * 2 * (1 - psi_unit) * psi_weight
    root = jnp.sqrt(jnp.maximum(index_out**2 - (sine_in_optical * jnp.sin(psi)) ** 2, 1e-24))
    towards = -sine_in_optical * jnp.cos(psi)
    low, high = jnp.where(inside, 0.0, towards - root), towards + root
    start, end = (jnp.arcsinh(jnp.maximum(r, 0.0) / scale)[:, None] for r in (low, high))
    unit, weight = gauss_legendre_unit(_N_RADIAL)
    v = start + (end - start) * unit
    radius = scale * jnp.sinh(v)
    area = psi_weight[:, None] * (end - start) * weight * jnp.sqrt(scale**2 + radius**2) * radius
    x = sine_in_optical + radius * jnp.cos(psi)[:, None]
    y = radius * jnp.sin(psi)[:, None]
    return jnp.sqrt(x**2 + y**2).ravel(), jnp.arctan2(y, x).ravel(), 2 * area.ravel()


@eqx.filter_jit
def scattered_power(
    surface: WaveSurface, cosine_in: Float[ArrayLike, ""], is_transmission: bool
) -> Float[Array, ""]:
    """Fraction of the power scattered into one hemisphere: the integral of the BSDF times the cosine.

    The quadrature is centred on the specular direction; the cosine of incidence must be below 1.
    """
    n_i, n_o = surface.index_front, surface.index_out(is_transmission)
    sine = n_i * jnp.sqrt(jnp.maximum(1 - cosine_in**2, 1e-12))
    scale = surface.wavelength_um / (2 * jnp.pi * surface.spectrum.length_um)
    optical_sine, azimuth, area = _disc(n_o, sine, jnp.minimum(scale, 1.0))
    cosine_out = propagating_cosine(1 - (optical_sine / n_o) ** 2)
    cosine_in = jnp.full_like(cosine_out, cosine_in)
    at = scattered_bsdf(surface, cosine_out, cosine_in, azimuth[:, None], is_transmission)
    return jnp.sum(at[:, 0] * area) / n_o**2


class PowerBalance(eqx.Module):
    """Fractions of the incident power.

    Parameters
    ----------
    regular_reflected, regular_transmitted
        Regular light: in the specular and in the refracted direction.
    scattered_reflected, scattered_transmitted
        Scattered into either hemisphere.
    """

    regular_reflected: Float[Array, ""]
    regular_transmitted: Float[Array, ""]
    scattered_reflected: Float[Array, ""]
    scattered_transmitted: Float[Array, ""]

    @property
    def total(self) -> Float[Array, ""]:
        """Total fraction that leaves, not renormalised; 1 for an exact theory."""
        regular = self.regular_reflected + self.regular_transmitted
        return regular + self.scattered_reflected + self.scattered_transmitted


def balance(surface: WaveSurface, cosine_in: Float[ArrayLike, ""]) -> PowerBalance:
    """Power balance at one angle of incidence.

    Regular light loses the fraction 1 - exp(-A^2 sigma^2) whatever the spectrum, but light is scattered
    according to the spectrum. The total therefore differs from 1 if frequencies above 1/lambda, which scatter
    into no direction, have much of the height variance, and near grazing and the critical angle.
    """
    require_float64()
    cosine = jnp.atleast_1d(jnp.asarray(cosine_in))
    return PowerBalance(
        regular_power(surface, cosine, False)[0],
        regular_power(surface, cosine, True)[0],
        scattered_power(surface, cosine[0], False),
        scattered_power(surface, cosine[0], True),
    )


def validity(surface: WaveSurface, cosine_in: float) -> dict[str, float]:
    """Criteria for the validity of the theory at an angle of incidence.

    Returns
    -------
    dict[str, float]
        ``a_sigma_reflection``, ``a_sigma_transmission``: phases in the specular and refracted directions;
        first order alone (Rayleigh-Rice) requires values below about 0.3. ``slope``: root mean square slope
        of the frequencies that scatter into the hemisphere; it should be below `LARGEST_SLOPE` and, to avoid
        shadowing, below ``grazing_slope``, the tangent of the light's elevation.
        ``highest_frequency_per_um``: highest frequency that scatters light on either side.
        ``height_variance_beyond``: fraction of the height
        variance above it, which scatters into no direction but attenuates regular light. ``uncovered``:
        fraction of the frequencies from 0 to the highest at which the spectrum is extrapolated.
        ``power_error``: `balance` minus 1.
    """
    cosine = jnp.asarray(cosine_in)
    n_i, n_t, spectrum = surface.index_front, surface.index_back, surface.spectrum
    sigma = jnp.sqrt(spectrum.height_variance_um2)
    beyond = refracted_cosine(n_i, n_t, cosine)
    sine = jnp.sqrt(1 - cosine**2)
    highest = float((jnp.maximum(n_i, n_t) + n_i * sine) / surface.wavelength_um)
    low, high = spectrum.covered_per_um()
    within = jnp.asarray(highest)
    beyond_highest = 1 - spectrum.height_variance_below(within) / jnp.maximum(sigma**2, 1e-300)
    return {
        "a_sigma_reflection": float(sigma * phase_per_height(surface, cosine, cosine, False)),
        "a_sigma_transmission": float(sigma * phase_per_height(surface, beyond, cosine, True)),
        "slope": float(jnp.sqrt(spectrum.slope_variance_below(within))),
        "grazing_slope": float(cosine / jnp.maximum(sine, 1e-12)),
        "highest_frequency_per_um": highest,
        "height_variance_beyond": float(jnp.where(sigma > 0, beyond_highest, 0.0)),
        "uncovered": 1 - max(min(high, highest) - low, 0.0) / highest,
        "power_error": float(balance(surface, cosine).total) - 1,
    }
