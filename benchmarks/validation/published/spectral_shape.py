"""The published way to a coloured ink: the spectrum follows from the diffuse reflectance up to its mean."""

import numpy as np

from jaxink.measurement import GonioData


def diffuse_reflectance(data: GonioData) -> dict[float, float]:
    """K_d by wavelength: reflectance without the regular peak, averaged over the incidences measured.

    Each half-plane of a scan stands for half of the azimuths; between the angles measured, and to 0 and 90
    degrees, the BSDF is interpolated.
    """
    theta = np.linspace(0.0, 90.0, 361)
    weight = np.cos(np.deg2rad(theta)) * np.sin(np.deg2rad(theta))
    found: dict[float, list[float]] = {}
    for scan in data.select(side="R").scans:
        here = data.select(
            side="R", wavelength_nm=scan.wavelength_nm, theta_i_deg=scan.theta_i_deg, used_only=True
        )
        halves = []
        for phi in (0.0, 180.0):
            half = np.flatnonzero(here.phi_deg == phi)
            half = half[np.argsort(here.theta_o_deg[half])]
            bsdf = np.interp(theta, here.theta_o_deg[half], here.bsdf_per_sr[half])
            halves.append(2 * np.pi * np.trapezoid(bsdf * weight, np.deg2rad(theta)))
        found.setdefault(scan.wavelength_nm, []).append(float(np.mean(halves)))
    return {wavelength: float(np.mean(of_scans)) for wavelength, of_scans in sorted(found.items())}


def shape_of_absorption_index(data: GonioData) -> list[float]:
    """Ratios of k(lambda) = -lambda ln K_d / (4 pi d), mean 1, for spheres; d is constant and drops out."""
    reflectance = diffuse_reflectance(data)
    k = np.array([-wavelength * np.log(one) for wavelength, one in reflectance.items()])
    return (k / k.mean()).tolist()


def shape_of_scattering(data: GonioData) -> list[float]:
    """Ratios of the scattering coefficient, mean 1, for Henyey-Greenstein: those of K_d itself."""
    reflectance = np.array(list(diffuse_reflectance(data).values()))
    return (reflectance / reflectance.mean()).tolist()
