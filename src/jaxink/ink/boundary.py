"""Table of a rough boundary between two clear half-spaces."""

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.files.version import installed_version
from jaxink.ink.boundary_file import RoughBoundary
from jaxink.ink.hemispherical_totals import (
    azimuth_weights,
    exit_angles_deg,
    power_sent_out,
    projected_weights,
)
from jaxink.ink.lobes import COMPONENTS, FacetLobes
from jaxink.ink.polar_grid import critical_angles_deg, polar_grid, require_few_entries
from jaxink.ink.several_facets import several_facets
from jaxink.ink.stack_lobes import one_facet_lobes
from jaxink.ink.table import InkTable
from jaxink.numerics.precision import computing
from jaxink.optics import fresnel_reflectance, refracted_cosine
from jaxink.surfaces import (
    AMPLITUDES,
    PowerSpectrum,
    SlopeDensity,
    WaveSurface,
    law_name,
    regular_power,
    scattered_bsdf,
)

# Facets less steep than this do not scatter: all light is regular.
_FLAT_SLOPE = 1e-6
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
        Numbers of polar angles and of equally spaced azimuths. By wave optics, lobes narrower than the steps
        are lost or overestimated, which the attribute ``power_of_table`` shows; those of facets are apart.
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
        Whether to apply `within_incident_power` to a boundary by wave optics.

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
        # The table of facets has the power that arrives.
        return within_incident_power(table) if limit_power and table.lobes is None else table

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

    Valid if facets are much larger than the wavelength. Light may meet any number of facets, with Smith's
    masking on both sides and heights that are not correlated.

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
        What leaves after one facet is in ``lobes``, in closed form, and in the entries; what leaves after
        several is smooth, see `several_facets`. ``power_of_table`` gives the smallest and largest share of
        the power that the table sends out, over both sides and incidences up to 80 degrees;
        ``share_of_several`` the largest share that meets several facets, and ``factors_of_several`` by how
        much the balance of power changed it. A flat surface has its Fresnel power in ``regular``; others have
        no regular part.

    Raises
    ------
    InputRefusedError
        If the wavelengths, indices or numbers of angles are invalid.
    """
    with computing():
        axes = _Axes.of(wavelengths_nm, options)
        if density.scale < _FLAT_SLOPE:
            return axes.table(*_of_flat(axes), f"facets, {law_name(density)}")
        lobes = one_facet_lobes(density, axes.theta_deg, (axes.inside, axes.outside), axes.grazing_deg)
        bsdf = np.array(
            [
                [
                    lobes.bsdf(
                        name, w, *np.meshgrid(axes.theta_deg, axes.theta_deg, axes.phi_deg, indexing="ij")
                    )
                    for w in range(len(axes.wavelengths))
                ]
                for name in COMPONENTS
            ]
        )
        once = np.array(
            [[lobes.totals(name, w) for w in range(len(axes.wavelengths))] for name in COMPONENTS]
        )
        left = np.stack([1 - once[0] - once[1], 1 - once[2] - once[3]])
        solid = projected_weights(axes.theta_deg)[:, None] * azimuth_weights(axes.phi_deg)
        factors: list[float] = []
        for w, indices in enumerate(zip(axes.inside, axes.outside, strict=True)):
            more = several_facets(density, indices, axes.evaluated_deg, axes.phi_deg, solid, left[:, w])
            for c, name in enumerate(COMPONENTS):
                come, leave = ("IA".index(side) for side in name[2:])
                bsdf[c, w] += indices[leave] ** 2 * more.kernel[come, leave]
            factors += more.factors
        regular = np.zeros((4, len(axes.wavelengths), len(axes.theta_deg)))
        table = axes.table(bsdf, regular, f"facets, {law_name(density)}", lobes)
    away = axes.theta_deg <= _LARGEST_THETA_DEG
    table.attrs["share_of_several"] = float(left[:, :, away].max())
    table.attrs["factors_of_several"] = f"{min(factors):.4g} ... {max(factors):.4g}"
    return table


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
        return _wave_table(spectrum, _Axes.of(wavelengths_nm, options), options.amplitude)


@dataclasses.dataclass(frozen=True)
class _Axes:
    """Wavelengths, media and directions of a table."""

    wavelengths: np.ndarray
    inside: np.ndarray
    outside: np.ndarray
    theta_deg: np.ndarray
    phi_deg: np.ndarray

    @classmethod
    def of(cls, wavelengths_nm, options: BoundaryOptions) -> "_Axes":
        wavelengths = np.asarray(wavelengths_nm, float)
        if wavelengths.ndim != 1 or len(wavelengths) == 0 or np.any(np.diff(wavelengths, prepend=0) <= 0):
            raise InputRefusedError(f"wavelengths_nm is {wavelengths_nm}; it must be positive and ascending.")
        inside, outside = options.indices(len(wavelengths))
        ratio = outside / inside
        kinks = critical_angles_deg([*(f(r) for f in (np.min, np.max) for r in (ratio, 1 / ratio))])
        theta_deg = polar_grid(options.n_theta, kinks)
        return cls(wavelengths, inside, outside, theta_deg, np.linspace(0.0, 180.0, options.n_phi))

    @property
    def grazing_deg(self) -> float:
        """The entries at 90 degrees are evaluated here."""
        return float(90 - (90 - self.theta_deg[-2]) / 4)

    @property
    def evaluated_deg(self) -> np.ndarray:
        return np.minimum(self.theta_deg, self.grazing_deg)

    def table(self, bsdf, regular, title: str, lobes: FacetLobes | None = None) -> InkTable:
        """The table; component before wavelength."""
        table = InkTable(
            wavelength_nm=self.wavelengths,
            theta_deg=self.theta_deg,
            phi_deg=self.phi_deg,
            bsdf_per_sr=bsdf,
            regular=regular,
            index_inside=self.inside,
            index_outside=self.outside,
            lobes=lobes,
        )
        table.attrs.update(_attrs(table, title, self.grazing_deg))
        return table


def _of_flat(axes: _Axes) -> tuple[np.ndarray, np.ndarray]:
    """No scattered light, and Fresnel's regular light."""
    cosine = jnp.cos(jnp.deg2rad(axes.evaluated_deg))
    regular = []
    for n_i, n_a in zip(axes.inside, axes.outside, strict=True):
        from_i, from_a = (
            np.asarray(fresnel_reflectance(here, there, cosine, refracted_cosine(here, there, cosine)))
            for here, there in ((n_i, n_a), (n_a, n_i))
        )
        regular.append([from_i, 1 - from_i, 1 - from_a, from_a])
    n_theta = len(axes.theta_deg)
    shape = 4, len(axes.wavelengths), n_theta, n_theta, len(axes.phi_deg)
    return np.zeros(shape), np.swapaxes(np.array(regular), 0, 1)


def _wave_table(spectrum: PowerSpectrum, axes: _Axes, amplitude: str) -> InkTable:
    directions = jnp.cos(jnp.deg2rad(axes.evaluated_deg)), jnp.deg2rad(180.0 - axes.phi_deg)
    bsdf, regular = [], []
    for wavelength, n_i, n_a in zip(axes.wavelengths, axes.inside, axes.outside, strict=True):
        (r_ii, t_ia, regular_i), (r_aa, t_ai, regular_a) = (
            _wave_side(WaveSurface(spectrum, here, there, wavelength, amplitude), directions)
            for here, there in ((n_i, n_a), (n_a, n_i))
        )
        bsdf.append([r_ii, t_ia, t_ai, r_aa])
        regular.append([*regular_i, *regular_a[::-1]])
    by_component, regular_power = (np.swapaxes(np.array(each), 0, 1) for each in (bsdf, regular))
    return axes.table(by_component, regular_power, f"wave optics, {type(spectrum).__name__}")


def _attrs(table: InkTable, title: str, grazing_deg: float) -> dict:
    power = power_sent_out(table)[:, :, table.theta_deg <= _LARGEST_THETA_DEG]
    return {
        "title": f"boundary: {title}",
        "grazing_theta_deg": float(grazing_deg),
        "power_of_table": f"{power.min():.6g} ... {power.max():.6g}",
        "interpolation_error": max(table.interpolation_error().values()),
        "jaxink_version": installed_version(),
    }


def _wave_side(surface, axes):
    """BRDF, BTDF and the regular power of both, for light from the first medium of the surface."""
    cosine, azimuth = axes
    n = len(cosine)
    into, out = (axis.ravel() for axis in jnp.meshgrid(cosine, cosine, indexing="ij"))
    turns = jnp.broadcast_to(azimuth, (n * n, len(azimuth)))
    parts = [
        np.asarray(scattered_bsdf(surface, out, into, turns, to)).reshape(n, n, -1) for to in (False, True)
    ]
    regular = jnp.stack([regular_power(surface, cosine, to) for to in (False, True)])
    return (*parts, jax.device_get(regular))


def within_incident_power(table: InkTable) -> InkTable:
    """Scale down a table for incidences at which it sends out more power than arrives, keeping reciprocity.

    Every direction of either side has one factor, which multiplies the BSDF of light that arrives from it and
    that leaves along it. The attribute ``least_power_factor`` of the result is the square of the smallest.
    """
    factor = np.ones((2, len(table.wavelength_nm), len(table.theta_deg)))
    limited = table
    # Each step at least halves the logarithm of the excess.
    for _ in range(40):
        excess = np.maximum(power_sent_out(limited), 1.0)
        if excess.max() < 1 + 1e-9:
            break
        factor /= np.sqrt(excess)
        limited = _scaled(table, factor)
    attrs = {**table.attrs, "least_power_factor": float(factor.min() ** 2)}
    return dataclasses.replace(limited, attrs=attrs)


def _scaled(table: InkTable, factor: np.ndarray) -> InkTable:
    """Table multiplied by the factors of the incident and of the exit direction."""
    bsdf, regular = table.bsdf_per_sr.copy(), table.regular.copy()
    for c, name in enumerate(COMPONENTS):
        come, leave = (factor["IA".index(side)] for side in name[2:])
        bsdf[c] *= come[:, :, None, None] * leave[:, None, :, None]
        for w in range(len(table.wavelength_nm)):
            exits = np.nan_to_num(exit_angles_deg(table, name, w, table.theta_deg), nan=90.0)
            regular[c, w] *= come[w] * np.interp(exits, table.theta_deg, leave[w])
    return dataclasses.replace(table, bsdf_per_sr=bsdf, regular=regular)
