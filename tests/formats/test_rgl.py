"""Values of a file with azimuths of the source are those of EPFL's loader at the same directions."""

import numpy as np
import pytest

import jaxink
from tests.formats import files

# theta_i, theta_o and phi in degrees, and fr / cos(theta_o) at 500 nm, evaluated by powitacq
# (rgl-epfl/brdf-loader).
POWITACQ = np.array(
    [
        [0.00000, 4.65236, -90.00000, 0.0332955],
        [0.00000, 56.07647, -50.70021, 0.0875173],
        [0.00000, 25.17867, 38.32257, 0.0311296],
        [0.00000, 3.98344, 138.58727, 0.0316933],
        [0.00000, 51.06607, -177.11325, 0.0667856],
        [25.00000, 28.40322, -152.68067, 0.0437346],
        [25.00000, 59.97448, -71.41982, 0.0921576],
        [25.00000, 17.27994, 127.09256, 0.0288851],
        [25.00000, 71.10993, 123.19129, 0.0922773],
        [25.00000, 27.44140, -175.01348, 0.0365904],
        [60.00000, 77.79912, -152.37961, 0.209306],
        [60.00000, 4.39588, -163.12251, 0.0313418],
        [60.00000, 75.32830, 96.86358, 0.055622],
        [60.00000, 76.74644, -173.66384, 0.18138],
    ]
)


def _material(phi_i_deg):
    """A smooth material of formulas that closes in azimuth; at the poles, nothing depends on the azimuth."""

    def table(ny, nx, k):
        x, y = np.meshgrid(np.linspace(0, 1, nx), 2 * np.pi * np.linspace(0, 1, ny))
        return 1 + 0.4 * np.sin(2 * x + k) + 0.3 * x * np.cos(y + k) + 0.2 * x * np.sin(2 * y)

    theta_i, phi_i = np.deg2rad([0, 25, 60]), np.deg2rad(phi_i_deg)

    def conditional(n, k):
        return np.array([[table(n, n, k + t * (1 + 0.5 * np.cos(p - k))) for t in theta_i] for p in phi_i])

    fields = {
        "theta_i": theta_i,
        "phi_i": phi_i,
        "wavelengths": np.array([400.0, 500.0, 600.0]),
        "ndf": table(20, 14, 0.3),
        "sigma": table(12, 18, 0.7),
        "vndf": conditional(21, 0.1),
        "luminance": conditional(9, 0.5),
        "spectra": np.stack([conditional(9, k) / 10 for k in (0.2, 0.5, 0.9)], axis=2),
    }
    made = {"description": np.frombuffer(b"made for a test", "u1"), "jacobian": np.array([0], "u1")}
    return made | {name: array.astype("f4") for name, array in fields.items()}


# The whole circle of sources, and the half that is stored for a material with a symmetry.
@pytest.mark.parametrize("phi_i_deg", [(-180, -90, 0, 90, 180), (-180, -90, 0)])
def test_values_at_an_azimuth_are_those_of_the_open_loader(phi_i_deg, tmp_path):
    path = tmp_path / "anisotropic.bsdf"
    path.write_bytes(files.tensor_file(_material(phi_i_deg)))
    data = jaxink.read(path, wavelength_nm=500, rotation_deg=-90)
    read = np.column_stack([*data.directions[:3], data.bsdf_per_sr])
    apart = np.abs(read[:, None, :3] - POWITACQ[:, :3]).max(axis=2)
    nearest = apart.argmin(axis=0)
    assert apart.min(axis=0).max() < 1e-3
    np.testing.assert_allclose(read[nearest, 3], POWITACQ[:, 3], rtol=2e-5)
