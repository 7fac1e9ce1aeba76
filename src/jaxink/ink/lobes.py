"""Lobes of light that meets one facet of a rough interface and is otherwise regular.

They are too narrow for the angles of a table. They follow in closed form from the slope density of the facets
and the share of light that passes regularly between either side of the ink and the facets, which is smooth.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

# Reflection or transmission, the side that light comes from, and the side that it leaves to.
COMPONENTS = ("R_II", "T_IA", "T_AI", "R_AA")
# Numbers of slopes and azimuths of the sum over facets.
_POWER_SLOPES, _POWER_AZIMUTHS = 400, 48
_SIDES = "IA"


@dataclasses.dataclass(frozen=True, eq=False)
class FacetLobes:
    """Lobes of the rough interfaces of an ink; axes of length 2 are side I and side A.

    Parameters
    ----------
    theta_deg
        Polar angles of the table, shape ``(angles,)``.
    index
        Refractive indices of side I and side A, shape ``(2, wavelengths)``.
    slope
        Slopes of the facets, ascending from 0, shape ``(slopes,)``.
    radial_density
        P(s) s, where P is the slope density per area of the slope plane; linear between the slopes, 0 beyond;
        shape ``(faces, wavelengths, slopes)``.
    face_index
        Refractive indices of the media on both sides of each face, shape ``(2, faces, wavelengths)``.
    passage
        Share of the light from each side and polar angle that reaches the face regularly, times Smith's
        masking; shape ``(2, faces, wavelengths, angles)``.
    grazing_theta_deg
        The lobes are constant beyond this angle, like the table.
    """

    theta_deg: Float[np.ndarray, " angles"]
    index: Float[np.ndarray, "2 wavelengths"]
    slope: Float[np.ndarray, " slopes"]
    radial_density: Float[np.ndarray, "faces wavelengths slopes"]
    face_index: Float[np.ndarray, "2 faces wavelengths"]
    passage: Float[np.ndarray, "2 faces wavelengths angles"]
    grazing_theta_deg: float = 90.0

    def bsdf(self, component: str, wavelength: int, theta_i_deg, theta_o_deg, phi_deg):
        """BSDF of the lobes alone, 1/sr; parameters as for `InkTable.interpolated`.

        References
        ----------
        Walter, Marschner, Li, Torrance 2007 EGSR, eqs. 20, 21.
        """
        sides = [_SIDES.index(side) for side in component[2:]]
        azimuth = np.deg2rad(180.0 - np.asarray(phi_deg, float))
        meets = _reflected if component[0] == "R" else _refracted
        total = 0.0
        for face in range(len(self.radial_density)):
            (into, comes), (out, leaves) = (
                self._at_face(side, face, wavelength, theta)
                for side, theta in zip(sides, (theta_i_deg, theta_o_deg), strict=True)
            )
            here, other = self.face_index[sides[0], face, wavelength], 1 - sides[0]
            slope, strength = meets(here, self.face_index[other, face, wavelength], into, out, azimuth)
            radial = np.interp(slope, self.slope, self.radial_density[face, wavelength], right=0.0)
            total = total + comes * leaves * strength * radial / slope * (1 + slope**2) ** 2
        return self.index[sides[1], wavelength] ** 2 * total

    def totals(self, component: str, wavelength: int) -> Float[np.ndarray, " angles"]:
        """Share of the incident power in the lobes, for each polar angle.

        The sum runs over the facets, and is therefore accurate for lobes of any width.
        """
        start, end = (_SIDES.index(side) for side in component[2:])
        # Steps grow with the slope, like those of the tabulated slopes.
        reach = np.arcsinh(self.slope[-1] / self.slope[1]) / _POWER_SLOPES
        at = reach * (np.arange(_POWER_SLOPES) + 0.5)
        slope, step = self.slope[1] * np.sinh(at), self.slope[1] * reach * np.cosh(at)
        azimuth = np.pi * (np.arange(_POWER_AZIMUTHS) + 0.5) / _POWER_AZIMUTHS
        up = 1 / np.sqrt(1 + slope**2)[:, None]
        total = np.zeros(len(self.theta_deg))
        for face, densities in enumerate(self.radial_density):
            density = np.interp(slope, self.slope, densities[wavelength])
            weight = (2 * np.pi / _POWER_AZIMUTHS * density * step)[:, None] / up
            media = self.face_index[[start, 1 - start], face, wavelength]
            for k, theta in enumerate(self.theta_deg):
                (sine, cosine), comes = self._at_face(start, face, wavelength, theta)
                facing = np.maximum(cosine * up + sine * slope[:, None] * up * np.cos(azimuth), 0.0)
                share, height = _sent(media, cosine, facing, up, is_reflected=start == end)
                leaving = np.sqrt(np.maximum(1 - height**2, 0.0))
                leaving *= self.face_index[end, face, wavelength] / self.index[end, wavelength]
                passes = np.interp(
                    np.rad2deg(np.arcsin(np.minimum(leaving, 1.0))),
                    self.theta_deg,
                    self.passage[end, face, wavelength],
                )
                passes = np.where((leaving < 1) & (height > 0), passes, 0.0)
                total[k] += comes * np.sum(weight * facing * share * passes)
        return total

    def _at_face(self, side, face, wavelength, theta_deg):
        """Sine and cosine in the medium of the face, and passage over cosine, 0 if evanescent."""
        theta_deg = np.minimum(theta_deg, self.grazing_theta_deg)
        ratio = self.index[side, wavelength] / self.face_index[side, face, wavelength]
        sine = np.minimum(ratio * np.sin(np.deg2rad(theta_deg)), 1.0)
        inside = sine < 1
        cosine = np.sqrt(np.where(inside, 1 - sine**2, 1.0))
        passage = np.interp(theta_deg, self.theta_deg, self.passage[side, face, wavelength])
        return (sine, cosine), np.where(inside, passage / cosine, 0.0)


def _across(into, out, azimuth):
    """Length of the difference of two vectors in the surface, without cancellation."""
    return np.sqrt(np.maximum((into - out) ** 2 + 4 * into * out * np.sin(azimuth / 2) ** 2, 1e-24))


def _reflected(here, there, into, out, azimuth):
    """Slope of the facet that reflects one direction into the other, and lobe over density and areas."""
    (sine_in, cosine_in), (sine_out, cosine_out) = into, out
    slope = _across(sine_in, sine_out, azimuth) / (cosine_in + cosine_out)
    towards = cosine_in * cosine_out - sine_in * sine_out * np.cos(azimuth)
    facing = np.sqrt(np.clip((1 + towards) / 2, 0.0, 1.0))
    return slope, _fresnel(here, there, facing) / (4 * here**2)


def _refracted(here, there, into, out, azimuth):
    """The same for refraction; the lobe is 0 if no facet refracts into this direction."""
    (sine_in, cosine_in), (sine_out, cosine_out) = into, out
    # The facet's normal is along here i + there o, where i points to the source and o away on the other side.
    towards = -sine_in * sine_out * np.cos(azimuth) - cosine_in * cosine_out
    sign = 1.0 if here > there else -1.0
    along = sign * (here * cosine_in - there * cosine_out)
    facing_in, facing_out = sign * (here + there * towards), -sign * (there + here * towards)
    possible = (along > 1e-9) & (facing_in > 1e-12) & (facing_out > 1e-12)
    slope = _across(here * sine_in, there * sine_out, azimuth) / np.where(possible, along, 1.0)
    squared = np.where(possible, here**2 + there**2 + 2 * here * there * towards, 1.0)
    passing = 1 - _fresnel(here, there, np.clip(facing_in / np.sqrt(squared), 0.0, 1.0))
    return slope, np.where(possible, facing_in * facing_out / squared**2 * passing, 0.0)


def _sent(media, cosine, facing, up, is_reflected):
    """Share that a facet reflects or refracts, and cosine of this direction with the exit normal."""
    here, there = media
    reflectance = _fresnel(here, there, facing)
    if is_reflected:
        return reflectance, 2 * facing * up - cosine
    ratio = here / there
    beyond = np.sqrt(np.maximum(1 - ratio**2 * (1 - facing**2), 0.0))
    return 1 - reflectance, ratio * cosine - (ratio * facing - beyond) * up


def _fresnel(here, there, cosine):
    """Unpolarised reflectance, 1 beyond the critical angle."""
    squared = 1 - (here / there) ** 2 * (1 - cosine**2)
    beyond = np.sqrt(np.maximum(squared, 0.0))
    s = (here * cosine - there * beyond) / (here * cosine + there * beyond + 1e-300)
    p = (there * cosine - here * beyond) / (there * cosine + here * beyond + 1e-300)
    return np.where(squared > 0, (s**2 + p**2) / 2, 1.0)
