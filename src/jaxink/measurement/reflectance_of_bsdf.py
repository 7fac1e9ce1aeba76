"""Diffuse reflectance of a measured BRDF, and the spectra that the publication derives from it."""

import dataclasses

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.measurement.dataset import GonioData

# Steps of the integral over the polar angles, deg.
_STEP = 0.25


@dataclasses.dataclass(frozen=True, eq=False)
class DiffuseReflectance:
    """K_d of a measured BRDF by wavelength, without the regular peak.

    Parameters
    ----------
    wavelength_nm
        Ascending.
    value
        Share of uniformly diffuse light that is reflected diffusely, 0 to 1.
    incidences
        Number of incidences over which it is averaged, the fewest of any wavelength.
    """

    __repr__ = brief_repr

    wavelength_nm: Float[np.ndarray, " wavelengths"]
    value: Float[np.ndarray, " wavelengths"]
    incidences: int

    def absorption_index(self, path_um: float) -> Float[np.ndarray, " wavelengths"]:
        """K = -lambda ln K_d / (4 pi d) of light absorbed along a path d.

        Parameters
        ----------
        path_um
            d, um; the ratios of k at the wavelengths do not depend on it.

        References
        ----------
        Sokolov, Potemin, Zhdanov, Barladian 2021 CEUR-WS 3027, paper 13.
        """
        if not np.all((self.value > 0) & (self.value < 1)):
            wrong = self.wavelength_nm[np.argmin((self.value > 0) & (self.value < 1))]
            raise InputRefusedError(
                f"the diffuse reflectance at {wrong:g} nm is not between 0 and 1, so no absorption follows."
            )
        return -self.wavelength_nm * np.log(self.value) / (4 * np.pi * path_um * 1000)

    @property
    def scattering_shape(self) -> Float[np.ndarray, " wavelengths"]:
        """Ratios of the scattering coefficient of Henyey-Greenstein, mean 1: those of K_d itself."""
        return self.value / self.value.mean()

    @property
    def absorption_index_shape(self) -> Float[np.ndarray, " wavelengths"]:
        """Ratios of k, mean 1."""
        k = self.absorption_index(1.0)
        return k / k.mean()


def diffuse_reflectance(data: GonioData) -> DiffuseReflectance:
    """Average a measured BRDF over all directions of illumination.

    For each incidence, f cos(theta_o) is integrated over the hemisphere in steps of 0.25 degrees: linear in
    theta_o between the readings of each azimuth, constant beyond the first and the last, and each azimuth,
    with its mirror image, stands for the directions nearer to it than to any other. The reflectances of the
    incidences are then averaged over uniformly diffuse light, with weights sin(2 theta_i), linear between
    the incidences and constant beyond.

    Parameters
    ----------
    data
        The measurement; points that are masked or in transmission do not count.

    Raises
    ------
    InputRefusedError
        If there are no readings in reflection.
    """
    keep = data.used & ~data.is_transmission
    if not keep.any():
        raise InputRefusedError(
            f"{data.source or 'the measurement'}: has no readings in reflection, from which alone a diffuse "
            "reflectance follows."
        )
    waves, values, counts = np.unique(data.wavelength_nm[keep]), [], []
    for wave in waves:
        here = keep & (data.wavelength_nm == wave)
        incidences = np.unique(data.theta_i_deg[here])
        of_each = [_reflected(data, here & (data.theta_i_deg == theta)) for theta in incidences]
        values.append(_over_hemisphere(incidences, np.array(of_each)))
        counts.append(len(incidences))
    return DiffuseReflectance(waves, np.array(values), min(counts))


def _over_hemisphere(theta_deg, values) -> float:
    """Average, for uniformly diffuse light, of a function of the polar angle."""
    theta = np.arange(_STEP / 2, 90, _STEP)
    weight = np.sin(np.deg2rad(2 * theta))
    return float(np.interp(theta, theta_deg, values) @ weight / weight.sum())


def _reflected(data: GonioData, here) -> float:
    """Share of light of one incidence that is reflected diffusely."""
    azimuth = np.abs(data.phi_deg[here])
    theta, bsdf = data.theta_o_deg[here], data.bsdf_per_sr[here]
    # The normal belongs to every azimuth.
    azimuths = np.unique(azimuth[theta > 0]) if np.any(theta > 0) else np.unique(azimuth)
    ends = np.concatenate([[0.0], (azimuths[1:] + azimuths[:-1]) / 2, [180.0]])
    total = 0.0
    for one, share in zip(azimuths, np.diff(ends) / 180, strict=True):
        mine = (azimuth == one) | (theta == 0)
        angles, place = np.unique(theta[mine], return_inverse=True)
        mean = np.bincount(place.reshape(-1), bsdf[mine]) / np.bincount(place.reshape(-1))
        total += share * np.pi * _over_hemisphere(angles, mean)
    return float(total)
