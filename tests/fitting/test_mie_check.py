"""The Mie series at the solution of a fit beside that of miepython."""

import miepython
import numpy as np

from jaxink.fitting.assembly import mie_check
from jaxink.numerics.precision import computing
from jaxink.particles.independent_series import difference_from_miepython
from jaxink.sample import parse_sample

PIGMENTS = """
schema_version = 1
wavelength_nm = [450, 650]

[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.485
thickness_um = 12
radius_nm = 110
radius_variance_ln = 0.07
volume_fraction = 0.12
particle_index = 2.7
particle_absorption_index = 0.01

[[layers.populations]]
name = "filler"
radius_nm = 600
volume_fraction = 0.06
particle_index = 1.64
"""


def checked(text, wavelengths_nm=(550.0,)):
    sample = parse_sample(text)
    with computing():
        return mie_check(sample, sample.parameters.values_with({}), wavelengths_nm)


def test_both_programs_agree_for_spheres_of_all_sizes():
    rng = np.random.default_rng(7)
    sizes = np.geomspace(0.003, 39.0, 40)
    absorption = np.where(np.arange(40) % 2, 10.0 ** rng.uniform(-6, -0.5, 40), 0.0)
    with computing():
        found = difference_from_miepython(sizes, rng.uniform(1.02, 2.6, 40) + 1j * absorption)
    assert found.shape == (40,)
    assert np.max(found) < 1e-6


def test_every_kind_of_sphere_is_compared_at_every_wavelength():
    found = checked(PIGMENTS, (450.0, 650.0))
    # Three of the distributed pigment, one of the filler.
    assert found.spheres == 8
    assert 0 < found.largest_relative_difference < 1e-6
    assert found.warning is None


RAYLEIGH = """
schema_version = 1
wavelength_nm = 550

[[layers]]
name = "ink"
kind = "scattering"
phase_function = "rayleigh"
refractive_index = 1.485
thickness_um = 12
scattering_per_mm = 10
absorption_per_mm = 1
"""


def test_without_particles_nothing_is_compared():
    assert checked(RAYLEIGH) is None


def test_a_difference_is_noticed_and_told(monkeypatch):
    series = miepython.efficiencies_mx
    monkeypatch.setattr(miepython, "efficiencies_mx", lambda m, x: series(m, 1.001 * x))
    found = checked(PIGMENTS)
    assert found.largest_relative_difference > 1e-4
    assert found.warning.startswith("The Mie series at the solution differs from that of miepython by 0.00")
