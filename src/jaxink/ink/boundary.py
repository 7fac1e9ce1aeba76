"""Table of a rough boundary between two clear half-spaces."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.version import installed_version
from jaxink.ink.boundary_file import RoughBoundary
from jaxink.ink.hemispherical_totals import power_sent_out
from jaxink.ink.polar_grid import critical_angles_deg, polar_grid, require_few_entries
from jaxink.ink.power_limit import within_incident_power
from jaxink.ink.table import InkTable
from jaxink.numerics.precision import computing
from jaxink.optics.fresnel import fresnel_reflectance, refracted_cosine
from jaxink.surfaces.facets import FacetRule, projected_area
from jaxink.surfaces.lobes import reflected_lobe, transmitted_lobe
from jaxink.surfaces.slopes import SlopeDensity, law_name
from jaxink.surfaces.spectrum import PowerSpectrum
from jaxink.surfaces.wave_optics import scattered_bsdf
from jaxink.surfaces.wave_surface import AMPLITUDES, WaveSurface, regular_power

# Facets less steep than this do not scatter: all light is regular.
_FLAT_SLOPE = 1e-6
_AREA_RULE = FacetRule(48, 24)
# Largest incidence of the power balance: linear interpolation is poor closer to grazing.
_LARGEST_THETA_DEG = 80.0


@dataclasses.dataclass(frozen=True)
class BoundaryOptions:
    """Options of a boundary's table.

    Parameters
    ----------
    index_inside, index_outside
        Refractive indices of side I and side A: one number, or one for each wavelength.
    n_theta, n_phi
        Numbers of polar angles and of equally spaced azimuths. Lobes narrower than the steps are lost or
        overestimated, which the attribute ``power_of_table`` shows.
    amplitude
        Amplitude of `WaveSurface`, not used for facets.
    """

    index_inside: float | Sequence[float]
    index_outside: float | Sequence[float]
    n_theta: int = 91
    n_phi: int = 73
    amplitude: str = "perturbation"

    def __post_init__(self):
        if self.n_phi < 3:
            raise InputRefusedError(f"n_phi is {self.n_phi}; it must be at least 3.")
        require_few_entries(self.n_theta, self.n_phi)
        require_one_of("amplitude", self.amplitude, AMPLITUDES)

    def indices(self, n_wavelengths: int) -> tuple[np.ndarray, np.ndarray]:
        """Refractive indices of both sides at every wavelength."""
        found = []
        for name in ("index_inside", "index_outside"):
            values = np.asarray(getattr(self, name), float)
            if values.shape not in ((), (n_wavelengths,)) or not np.all((values >= 1) & np.isfinite(values)):
                raise InputRefusedError(
                    f"{name} is {getattr(self, name)}; it must be one number of at least 1, or one for each "
                    f"of the {n_wavelengths} wavelengths."
                )
            found.append(np.broadcast_to(values, n_wavelengths).copy())
        return found[0], found[1]


def boundary_table(
    boundary: RoughBoundary, n_theta: int = 91, n_phi: int = 73, limit_power: bool = False
) -> InkTable:
    """Table of a boundary described by a file.

    Parameters
    ----------
    boundary
        From `jaxink.ink.boundary_file.load_boundary`.
    n_theta, n_phi
        As for `BoundaryOptions`.
    limit_power
        Whether to apply `within_incident_power`.

    Returns
    -------
    InkTable
        As from `facet_boundary` or `wave_boundary`. Its standard errors, if any, follow from that of the
        height scale by central differences.
    """
    options = BoundaryOptions(boundary.index_inside, boundary.index_outside, n_theta, n_phi)

    def at(height_scale: float) -> InkTable:
        with computing():
            shape = boundary.shape_at(height_scale)
        if isinstance(shape, SlopeDensity):
            table = facet_boundary(shape, boundary.wavelengths_nm, options)
        else:
            table = wave_boundary(shape, boundary.wavelengths_nm, options)
        return within_incident_power(table) if limit_power else table

    table, error = at(boundary.height_scale), boundary.height_scale_standard_error
    if error == 0:
        return table
    low, high = (at(boundary.height_scale + step) for step in (-error, error))
    return dataclasses.replace(
        table,
        bsdf_standard_error_per_sr=np.abs(high.bsdf_per_sr - low.bsdf_per_sr) / 2,
        regular_standard_error=np.abs(high.regular - low.regular) / 2,
    )


def facet_boundary(
    density: SlopeDensity, wavelengths_nm: Sequence[float], options: BoundaryOptions
) -> InkTable:
    """Table of a boundary made of facets, by ray optics.

    Valid if facets are much larger than the wavelength. Only light that meets a single facet is included,
    with Smith's masking on both sides.

    Parameters
    ----------
    density
        Slope density of the facets.
    wavelengths_nm
        Wavelengths, ascending.
    options
        Media and axes.

    Returns
    -------
    InkTable
        Its attribute ``power_of_table`` gives the smallest and largest share of the power that the table
        sends out, over both sides and incidences up to 80 degrees; the rest met several facets. A flat
        surface has its Fresnel power in ``regular``; other surfaces have no regular part.

    Raises
    ------
    InputRefusedError
        If the wavelengths, indices or numbers of angles are invalid.
    """
    with computing():

        def sides(_, here, there, axes):
            return _facet_side(density, jnp.asarray(here), jnp.asarray(there), axes)

        return _tabulate(sides, wavelengths_nm, options, f"facets, {law_name(density)}")


def wave_boundary(
    spectrum: PowerSpectrum, wavelengths_nm: Sequence[float], options: BoundaryOptions
) -> InkTable:
    """Table of a boundary by wave optics, from the power spectrum of its height.

    Parameters
    ----------
    spectrum
        Power spectrum of the height.
    wavelengths_nm
        Wavelengths, ascending.
    options
        Media, axes, and the amplitude of the scattering.

    Returns
    -------
    InkTable
        Its regular part is Fresnel's, reduced by the roughness. The deviation of ``power_of_table`` (see
        `facet_boundary`) from 1 is the error of the theory and of the table's steps; the error of the theory
        alone is `jaxink.surfaces.wave_power.balance`. The table is not renormalised, see
        `within_incident_power`.
    """
    with computing():
        # It may have been created in 32 bits.
        spectrum = jax.tree.map(lambda number: jnp.asarray(number, float), spectrum)

        def sides(wavelength_nm, here, there, axes):
            surface = WaveSurface(spectrum, here, there, wavelength_nm, options.amplitude)
            return _wave_side(surface, axes)

        return _tabulate(sides, wavelengths_nm, options, f"wave optics, {type(spectrum).__name__}")


def _tabulate(side, wavelengths_nm, options: BoundaryOptions, title: str) -> InkTable:
    wavelengths = np.asarray(wavelengths_nm, float)
    if wavelengths.ndim != 1 or len(wavelengths) == 0 or np.any(np.diff(wavelengths, prepend=0) <= 0):
        raise InputRefusedError(f"wavelengths_nm is {wavelengths_nm}; it must be positive and ascending.")
    inside, outside = options.indices(len(wavelengths))
    ratio = outside / inside
    kinks = critical_angles_deg([*(f(r) for f in (np.min, np.max) for r in (ratio, 1 / ratio))])
    theta_deg = polar_grid(options.n_theta, kinks)
    grazing_deg = 90 - (90 - theta_deg[-2]) / 4
    phi_deg = np.linspace(0.0, 180.0, options.n_phi)
    cosine = jnp.cos(jnp.deg2rad(jnp.minimum(theta_deg, grazing_deg)))
    axes = cosine, jnp.deg2rad(180.0 - phi_deg)
    bsdf, regular = [], []
    for wavelength, n_i, n_a in zip(wavelengths, inside, outside, strict=True):
        (r_ii, t_ia, regular_i), (r_aa, t_ai, regular_a) = (
            side(wavelength, n_i, n_a, axes),
            side(wavelength, n_a, n_i, axes),
        )
        bsdf.append([r_ii, t_ia, t_ai, r_aa])
        regular.append([*regular_i, *regular_a[::-1]])
    table = InkTable(
        wavelength_nm=wavelengths,
        theta_deg=theta_deg,
        phi_deg=phi_deg,
        bsdf_per_sr=np.swapaxes(np.array(bsdf), 0, 1),
        regular=np.swapaxes(np.array(regular), 0, 1),
        index_inside=inside,
        index_outside=outside,
    )
    table.attrs.update(_attrs(table, title, grazing_deg))
    return table


def _attrs(table: InkTable, title: str, grazing_deg: float) -> dict:
    power = power_sent_out(table)[:, :, table.theta_deg <= _LARGEST_THETA_DEG]
    return {
        "title": f"boundary: {title}",
        "grazing_theta_deg": float(grazing_deg),
        "power_of_table": f"{power.min():.6g} ... {power.max():.6g}",
        "interpolation_error": max(table.interpolation_error().values()),
        "jaxink_version": installed_version(),
    }


@eqx.filter_jit
def _facet_side(density, here, there, axes):
    """BRDF, BTDF and the regular power of both, for light from the medium ``here``."""
    cosine, azimuth = axes
    flat = density.scale < _FLAT_SLOPE
    into, out, turn = (axis.ravel() for axis in jnp.meshgrid(cosine, cosine, azimuth, indexing="ij"))
    shape = (len(cosine), len(cosine), len(azimuth))
    sine = jnp.sqrt(jnp.maximum(1 - cosine**2, 1e-12))
    area = projected_area(cosine, sine, density, _AREA_RULE)
    areas = area[:, None, None] * area[None, :, None]
    lobes = (
        reflected_lobe((here, there), out, into, turn, density),
        transmitted_lobe((here, there), out, into, turn, density) * there**2,
    )
    bsdf = (jnp.where(flat, 0.0, lobe.reshape(shape) / areas) for lobe in lobes)
    reflected = fresnel_reflectance(here, there, cosine, refracted_cosine(here, there, cosine))
    regular = jnp.where(flat, jnp.stack([reflected, 1 - reflected]), 0.0)
    return (*bsdf, regular)


def _wave_side(surface, axes):
    """As `_facet_side`, by wave optics."""
    cosine, azimuth = axes
    n = len(cosine)
    into, out = (axis.ravel() for axis in jnp.meshgrid(cosine, cosine, indexing="ij"))
    turns = jnp.broadcast_to(azimuth, (n * n, len(azimuth)))
    parts = [
        np.asarray(scattered_bsdf(surface, out, into, turns, to)).reshape(n, n, -1) for to in (False, True)
    ]
    regular = jnp.stack([regular_power(surface, cosine, to) for to in (False, True)])
    return (*parts, jax.device_get(regular))
