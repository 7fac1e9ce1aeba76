"""What jaxink exports it reads: the table comes back, in air; other media are rejected."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.export import ExportOptions, write
from tests.ink.analytic_tables import lobe, smooth, table_of

ALLOWED = ExportOptions(
    drop=("regular", "beyond_critical", "standard_errors", "index_step"),
    radial_deg=[*np.arange(0, 90, 7.5).tolist(), *range(90, 181, 15)],
    azimuth_deg=[*range(0, 181, 15)],
)
LIGHTTOOLS = {"R_AA": ("front", "R"), "T_AI": ("front", "T"), "R_II": ("back", "R"), "T_IA": ("back", "T")}
SPEOS = {"R_II": "inside", "T_IA": "inside", "T_AI": "outside", "R_AA": "outside"}


def bsdf(component, wavelength_nm, theta_i, theta_o, phi):
    """Different in every component, and highest off the plane of incidence."""
    angles = (component, wavelength_nm, theta_i, theta_o, phi)
    return smooth(*angles) * (1 + lobe(*angles))


def table(index_inside=1.0):
    return table_of(bsdf, np.linspace(0, 90, 19), np.linspace(0, 180, 19), index_inside=index_inside)


@pytest.fixture(scope="module", params=["zemax", "lighttools", "speos", "integra"])
def exported(request, tmp_path_factory):
    folders = {index: tmp_path_factory.mktemp(request.param) for index in (1.0, 1.5)}
    for index, folder in folders.items():
        write(table(index), request.param, folder, ALLOWED)
    return request.param, folders


def read_component(kind, folder, component):
    if kind == "zemax":
        return jaxink.read(folder / f"ink_550nm_{component}.bsdf")
    if kind == "integra":
        return jaxink.read(folder / f"ink_550nm_{component}.dd{component[0].lower()}")
    if kind == "lighttools":
        face, side = LIGHTTOOLS[component]
        return jaxink.read(folder / "ink_550nm.bsdf", face=face, side=side)
    return jaxink.read(folder / f"ink_550nm_{SPEOS[component]}.anisotropicbsdf", side=component[0])


@pytest.mark.parametrize("component", ["R_II", "T_IA", "T_AI", "R_AA"])
def test_the_table_comes_back(exported, component):
    kind, folders = exported
    data = read_component(kind, folders[1.0], component)
    assert set(data.side.tolist()) == {component[0]}
    np.testing.assert_allclose(data.wavelength_nm, 550, rtol=1e-9)
    # Zemax's axes are not those of the table, between the entries of which the exporter interpolates.
    exact = table().interpolated(component, data.theta_i_deg, data.theta_o_deg, np.abs(data.phi_deg))
    np.testing.assert_allclose(data.bsdf_per_sr, exact, atol=1e-7 * exact.max())
    assert len(data) > 1500
    assert not any("scaled" in note or "TIS" in note for note in data.notes)


def test_directions_in_other_media_are_no_measurement(exported):
    kind, folders = exported
    assert len(read_component(kind, folders[1.5], "R_AA")) > 1500
    for component in ("R_II", "T_AI", "T_IA"):
        with pytest.raises(InputRefusedError, match=f"{component} .* index 1.5"):
            read_component(kind, folders[1.5], component)


def test_regular_light_of_integra_comes_back(tmp_path):
    share = np.random.default_rng(1).uniform(0, 0.1, (4, 1, 19))
    write(dataclasses.replace(table(), regular=share), "integra", tmp_path, ALLOWED)
    for c, component in enumerate(("R_II", "T_IA", "T_AI", "R_AA")):
        readings = jaxink.read_readings(tmp_path / f"ink_550nm_{component}.sd{component[0].lower()}")
        assert set(readings.quantity.tolist()) == {"R_specular" if component[0] == "R" else "T_collimated"}
        # All incidences but that along the surface.
        np.testing.assert_allclose(readings.value, share[c, 0, :-1], rtol=1e-8)
        np.testing.assert_allclose(readings.theta_i_deg, table().theta_deg[:-1], rtol=1e-8)


def test_regular_light_in_other_media_is_no_reading(tmp_path, refused):
    write(dataclasses.replace(table(1.5), regular=np.full((4, 1, 19), 0.01)), "integra", tmp_path, ALLOWED)
    with refused("R_II", "index 1.5"):
        jaxink.read_readings(tmp_path / "ink_550nm_R_II.sdr")
