"""Reader of Speos' volume files, written from the format's description and not from the writer."""

from pathlib import Path
from typing import NamedTuple

import numpy as np


class SpeosMaterial(NamedTuple):
    """What a volume file of Speos states.

    Parameters
    ----------
    index, absorption_per_mm, scattering_per_mm
        Rows of a wavelength in nm and a value.
    angles_deg
        Scattering angles.
    phases
        Relative intensities, a row for each wavelength.
    """

    index: np.ndarray
    absorption_per_mm: np.ndarray
    scattering_per_mm: np.ndarray
    angles_deg: np.ndarray
    phases: np.ndarray

    def phase(self, cosines: np.ndarray, wavelength: int = 0) -> np.ndarray:
        """Relative intensity, linear between the angles."""
        return np.interp(np.rad2deg(np.arccos(cosines)), self.angles_deg, self.phases[wavelength])


def read_speos_material(path: Path) -> SpeosMaterial:
    """Read a file with a table of phase functions; anything else in it is an error."""
    lines = iter(path.read_text(encoding="ascii").splitlines())

    def curve() -> np.ndarray:
        return np.array([next(lines).split() for _ in range(int(next(lines)))], float)

    def require(*wanted: str) -> None:
        for one in wanted:
            if (found := next(lines)) != one:
                raise ValueError(f"{path}: '{found}' is where '{one}' should be.")

    require("OPTIS - Material file v13")
    next(lines)
    require("Isotropic", "Dispersion_Curve")
    index, absorption = curve(), curve()
    require("1", "1", "1", "OPTIS - Volumic Scattering file v1", "0")
    scattering = curve()
    n_waves, n_angles = int(next(lines)), int(next(lines))
    if n_waves > 1 and not np.array_equal(np.array(next(lines).split(), float), scattering[:, 0]):
        raise ValueError(f"{path}: the phase functions are of other wavelengths.")
    table = np.array([next(lines).split() for _ in range(n_angles)], float)
    if table.shape != (n_angles, n_waves + 1) or next(lines, None) is not None:
        raise ValueError(f"{path}: the table of phase functions has another size than stated.")
    return SpeosMaterial(index, absorption, scattering, table[:, 0], table[:, 1:].T)
