"""What instruments other than a goniometer read: totals of spheres, regular light, reflectance factors."""

import dataclasses

# Of a share of the incident power, which noise may bring above 1 and below 0.
_SHARE = 1.5
# Of a ratio to an ideal diffuser or to the illuminating radiance, which exceeds 1 towards a peak or in a
# denser medium.
_FACTOR = 4.0
LOWEST = -0.1


@dataclasses.dataclass(frozen=True)
class Quantity:
    """One kind of reading.

    Parameters
    ----------
    meaning
        For the manual and for messages.
    is_transmission
        Whether light is read behind the sample.
    theta_i_deg, theta_o_deg
        Angles of incidence and of view that are taken as stated if a file leaves them out; None for a
        hemisphere, and of regular light for the angle that follows from the other one.
    largest
        Above it, a value is taken for per cent.
    is_regular
        Whether only regular light is read.
    """

    meaning: str
    is_transmission: bool
    theta_i_deg: float | None
    theta_o_deg: float | None = None
    largest: float = _SHARE
    is_regular: bool = False

    @property
    def has_azimuth(self) -> bool:
        """Whether light is read in one direction for light from one direction."""
        return self.theta_i_deg is not None and self.theta_o_deg is not None

    @property
    def is_of_sphere(self) -> bool:
        """Whether an integrating sphere illuminates the sample or collects its light."""
        return not (self.is_regular or self.has_azimuth)


# Geometries as in CIE 15: di and de are diffuse illumination with the specular (or regular)
# component included and excluded.
QUANTITIES = {
    "R_total": Quantity("reflectance 8:di, specular included", False, 8.0),
    "R_diffuse": Quantity("reflectance 8:de, specular excluded", False, 8.0),
    "T_total": Quantity("transmittance into the hemisphere, regular light included", True, 8.0),
    "T_diffuse": Quantity("transmittance into the hemisphere, regular light excluded", True, 8.0),
    "T_collimated": Quantity("regular transmittance", True, 0.0, is_regular=True),
    "R_specular": Quantity("regular reflectance", False, 8.0, is_regular=True),
    "R_di_8": Quantity("reflectance factor di:8, specular included", False, None, 8.0),
    "R_de_8": Quantity("reflectance factor de:8, specular excluded", False, None, 8.0),
    "T_di_8": Quantity("diffuse light seen through, regular light included", True, None, 8.0, _FACTOR),
    "T_de_8": Quantity("diffuse light seen through, regular light excluded", True, None, 8.0, _FACTOR),
    "R_45_0": Quantity("reflectance factor 45:0", False, 45.0, 0.0, _FACTOR),
    "R_0_45": Quantity("reflectance factor 0:45", False, 0.0, 45.0, _FACTOR),
}
