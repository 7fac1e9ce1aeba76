"""Cases of the power study: simulated measurements, and patterns of our own for effects those cannot show."""

import dataclasses
from collections.abc import Callable

import numpy as np

import jaxink
from benchmarks.simulated_data import data_file, declared_text
from jaxink.model.forward import ForwardModel
from jaxink.numerics.precision import computing
from jaxink.sample import ParameterTable

_THIN = """
schema_version = 1
wavelength_nm = [380, 450, 550, 650]
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 3.0
absorption_per_mm = 0.02
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.55
thickness_um = 8.0
scattering_per_mm = { value = 150, free = true, min = 10, max = 2000 }
absorption_per_mm = 5.0
asymmetry_parameter = { value = 0.6, free = true, min = -0.9, max = 0.95 }
[instrument]
detector_mode = "broadband"
[noise]
relative = 0.005
floor_per_sr = 0.0001
scan_relative = 0.002
"""
_OPAQUE = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.0
thickness_um = "opaque"
single_scattering_albedo = { value = 0.99, free = true, min = 0.5, max = 1.0 }
asymmetry_parameter = { value = 0.5, free = true, min = -0.9, max = 0.95 }
[noise]
relative = 0.005
floor_per_sr = 0.0001
scan_relative = 0.002
"""
_MASKS = """
[masks]
specular_half_angle_deg = 0
undeviated_half_angle_deg = 0
retro_half_angle_deg = 0
"""


def _filed(name: str) -> tuple[jaxink.GonioData, jaxink.Sample]:
    """A simulated measurement and its sample as declared."""
    return jaxink.read(data_file(name)), jaxink.parse_sample(declared_text(name))


def _thin_ink() -> tuple[jaxink.GonioData, jaxink.Sample]:
    """Four wavelengths, a thin absorbing ink, scans through the direction to the source."""
    rows = []
    for side in (False, True):
        for incidence in (0.0, 30.0, 60.0):
            near = [] if side else [incidence + d for d in (-2, -1, -0.5, 0.5, 1, 2)]
            for signed in sorted({*np.arange(-80.0, 81.0, 5.0), *near}):
                # Signed towards the source; the regular peaks are left out.
                if abs(signed + incidence) > 2.5 and (side or abs(signed - incidence) > 0.1):
                    rows += [
                        (incidence, abs(signed), 0.0 if signed > 0 else 180.0, nm, side)
                        for nm in (380.0, 450.0, 550.0, 650.0)
                    ]
    return _drawn(np.array(rows), jaxink.parse_sample(_THIN + _MASKS))


def _opaque_ink() -> tuple[jaxink.GonioData, jaxink.Sample]:
    """An opaque ink without a plate or a face, in and out of the plane of incidence."""
    rows = [
        (incidence, polar, azimuth, 550.0, 0.0)
        for incidence in (0.0, 30.0, 60.0)
        for azimuth in (0.0, 60.0, 120.0, 180.0)
        for polar in np.arange(5.0, 81.0, 5.0)
        # The regular peak is left out.
        if azimuth != 180.0 or abs(polar - incidence) > 2.5
    ]
    return _drawn(np.array(rows), jaxink.parse_sample(_OPAQUE + _MASKS))


def _drawn(rows, sample) -> tuple[jaxink.GonioData, jaxink.Sample]:
    """Measurement of a sample at its start values, with the noise that its file states."""
    columns = (*rows[:, :4].T, rows[:, 4] > 0.5)
    with computing():
        model = ForwardModel(sample, *columns)
        exact = np.asarray(model.bsdf({n: p.value for n, p in sample.parameters.items() if p.tie is None}))
    rng = np.random.default_rng(1812)
    noise = sample.noise
    sigma = np.hypot(noise.relative * exact, noise.floor_per_sr)
    empty = jaxink.GonioData(*columns, exact, sigma)
    common = noise.scan_relative * rng.standard_normal(empty.scan_index.max() + 1)[empty.scan_index]
    measured = exact * (1 + common) + sigma * rng.standard_normal(exact.size)
    return jaxink.GonioData(*columns, measured, sigma), sample


def _dense_ink() -> tuple[jaxink.GonioData, jaxink.Sample]:
    """The directions of `white_ink_mie`, of an ink with three tenths of small particles of known material."""
    return _white_ink(radius_nm=120.0, volume_fraction=0.3, particle_index=2.5)


def _dilute_ink() -> tuple[jaxink.GonioData, jaxink.Sample]:
    """The same with few large particles, an optical thickness of about 1."""
    return _white_ink(radius_nm=300.0, volume_fraction=0.003, particle_index=2.7)


def _white_ink(**known: float) -> tuple[jaxink.GonioData, jaxink.Sample]:
    """Particles that do not absorb, of which the radius and the fraction are free."""
    data, sample = _filed("white_ink_mie")
    values = {f"ink.{key}": value for key, value in (known | {"particle_absorption_index": 0.0}).items()}
    free = ("ink.radius_nm", "ink.volume_fraction")
    parameters = [
        dataclasses.replace(p, value=values.get(n, p.value), free=n in free)
        for n, p in sample.parameters.items()
    ]
    sample = dataclasses.replace(sample, parameters=ParameterTable(parameters))
    return _drawn(np.stack([*data.directions], axis=1), sample)


MADE: dict[str, Callable] = {
    "thin_ink": _thin_ink,
    "dense_ink": _dense_ink,
    "dilute_ink": _dilute_ink,
    "opaque_ink": _opaque_ink,
}
# Accuracy of the discretisation, where it is not the default: so coarse that its errors are seen.
ACCURACY = {"coarse_plain_hg": 0.02}


def case_of(name: str) -> tuple[jaxink.GonioData, jaxink.Sample]:
    """Measurement and declared sample of a case."""
    return MADE[name]() if name in MADE else _filed(name.removeprefix("coarse_"))
