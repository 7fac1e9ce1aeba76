"""Volume files of Ansys Speos (``.material``): index, absorption, and scattering with a table of the phase.

References
----------
Ansys, "Speos Scattering Material File Format" and "Speos Non-Scattering Material File Format"
(optics.ansys.com, articles 23530158309011 and 17553951403027); the reader and writer of the format in Ansys'
PySpeos (github.com/ansys/pyspeos, MIT).
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.special import roots_legendre

from jaxink.export.medium import Medium
from jaxink.export.text import row, write_lines
from jaxink.files.version import installed_version

_HEADER, _SCATTERING = "OPTIS - Material file v13", "OPTIS - Volumic Scattering file v1"
# The model of a phase function that is a table.
_TABLE = "0"
# Angles of a table, doubled until the mean cosine of the linear interpolation is this accurate.
_FEWEST_ANGLES, _MOST_ANGLES, _ACCURATE = 181, 5761, 1e-4
_NODES = 4000


def write_speos_material(medium: Medium, path: Path) -> None:
    """Write a medium at all its wavelengths.

    Parameters
    ----------
    medium
        From `medium_of`.
    path
        The file.

    Notes
    -----
    The phase function is a relative intensity, per solid angle, by the angle from the direction of flight.
    """
    waves = medium.wavelength_nm
    angles_deg, phases = phase_table(medium)
    # The wavelength of a single column is not stated.
    of_columns = [row(waves)] if len(waves) > 1 else []
    lines = [
        _HEADER,
        f"{medium.name} by jaxink {installed_version()}",
        "Isotropic",
        "Dispersion_Curve",
        *_curve(waves, medium.refractive_index),
        *_curve(waves, medium.absorption_per_mm),
        # Concentrations that the absorption was measured at and is wanted for.
        "1",
        "1",
        # It scatters.
        "1",
        _SCATTERING,
        _TABLE,
        *_curve(waves, medium.scattering_per_mm),
        str(len(waves)),
        str(len(angles_deg)),
        *of_columns,
        *(row([angle, *values]) for angle, values in zip(angles_deg, phases.T, strict=True)),
    ]
    write_lines(path, lines)


def phase_table(
    medium: Medium,
) -> tuple[Float[np.ndarray, " angles"], Float[np.ndarray, "wavelengths angles"]]:
    """Scattering angles in degrees, dense where light goes straight on, and the phase functions there."""
    node, weight = roots_legendre(_NODES)
    at_deg = np.rad2deg(np.arccos(node))
    n = _FEWEST_ANGLES
    while True:
        angles_deg = 180 * np.linspace(0, 1, n) ** 2
        cosine = np.cos(np.deg2rad(angles_deg))
        phases = np.array([np.maximum(phase(cosine), 0.0) for phase in medium.phase])
        read = np.array([np.interp(at_deg, angles_deg, values) for values in phases]) * weight
        means = read @ node / read.sum(axis=1)
        if np.all(np.abs(means - medium.asymmetry) < _ACCURATE) or n >= _MOST_ANGLES:
            return angles_deg, phases
        n = 2 * n - 1


def _curve(waves: Sequence[float] | np.ndarray, values: np.ndarray) -> list[str]:
    """Number of wavelengths, then each in nm with its value."""
    return [str(len(waves)), *(row(pair) for pair in zip(waves, values, strict=True))]
