"""A Mie ink with a rough face, printed thin and thick, each lit from both sides.

The measurements are drawn by the repository's own Monte Carlo. The fits know the kind of face and the range
of its slopes, not their width.
"""

import dataclasses
import json
import zlib
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.montecarlo import Facets
from benchmarks.montecarlo import Layer as PhotonLayer
from benchmarks.montecarlo import Sample as PhotonSample
from benchmarks.validation.joint.four import OPTIONS, told, with_free_thickness
from benchmarks.validation.names.cases import INCIDENCES_DEG, WAVELENGTH_NM, Ink
from benchmarks.validation.names.drawing import (
    directions,
    followed,
    layer_of,
    only,
    rows_at,
    through_rough_face,
)
from jaxink.projects import Measurement
from jaxink.sample import opposite_medium, turned_over

DRAWN = Path(__file__).with_name("rough.json")
SHEETS = {
    "thin, plate lit": ("thin", "plate"),
    "thin, ink lit": ("thin", "ink"),
    "thick, plate lit": ("thick", "plate"),
    "thick, ink lit": ("thick", "ink"),
}
CHOSEN = (
    *((title,) for title in SHEETS),
    ("thin, plate lit", "thin, ink lit"),
    ("thin, plate lit", "thick, plate lit"),
    tuple(SHEETS),
)
THICKNESS_UM = {"thin": 25.0, "thick": 60.0}
TRUTH = {
    "ink.radius_nm": 200.0,
    "ink.volume_fraction": 0.015,
    "ink.particle_index": 2.2,
    "ink.particle_absorption_index": 3e-4,
    "ink.back_roughness.sigma_deg": 12.0,
}
_PLATE_INDEX, _PLATE_MM = 1.5, 1.0
_RELATIVE, _FLOOR_PER_SR, _SCAN_RELATIVE = 0.005, 1e-4, 0.004
_SAMPLE = f"""
schema_version = 1
title = "simulated: a rough ink"
wavelength_nm = {WAVELENGTH_NM:g}
[[layers]]
name = "plate"
kind = "clear"
refractive_index = {_PLATE_INDEX}
thickness_mm = {_PLATE_MM}
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = 25
radius_nm = {{ free = true, min = 100, max = 600 }}
volume_fraction = {{ free = true, min = 0.002, max = 0.5 }}
particle_index = {{ free = true, min = 1.6, max = 2.8 }}
particle_absorption_index = {{ free = true, min = 0, max = 0.01 }}
back_roughness = {{ density = "ggx", sigma_deg = {{ free = true, min = 1, max = 40 }} }}
[noise]
relative = {_RELATIVE}
floor_per_sr = {_FLOOR_PER_SR}
scan_relative = {_SCAN_RELATIVE}
[masks]
specular_half_angle_deg = 0
undeviated_half_angle_deg = 0
retro_half_angle_deg = 0
"""


def _stack(title: str) -> PhotonSample:
    """Layers and rough face of a sheet, from the lit side."""
    sheet, side = SHEETS[title]
    ink = Ink(
        index=1.5,
        thickness_um=THICKNESS_UM[sheet],
        radius_nm=TRUTH["ink.radius_nm"],
        particle_index=TRUTH["ink.particle_index"],
        particle_absorption_index=TRUTH["ink.particle_absorption_index"],
        volume_fraction=TRUTH["ink.volume_fraction"],
    )
    layers = PhotonLayer(_PLATE_INDEX, _PLATE_MM), layer_of(ink)
    faces = None, None, Facets("ggx", np.tan(np.deg2rad(TRUTH["ink.back_roughness.sigma_deg"])))
    return (
        PhotonSample(layers, faces=faces)
        if side == "plate"
        else PhotonSample(layers[::-1], faces=faces[::-1])
    )


def _draw(title: str) -> dict:
    """BSDF without noise, and its standard error from the Monte Carlo."""
    stack, parts = _stack(title), []
    through = through_rough_face(stack, title) if SHEETS[title][1] == "plate" else None
    for number, theta_i_deg in enumerate(INCIDENCES_DEG):
        seen = directions(theta_i_deg)
        seed = zlib.crc32(f"rough {title} {number}".encode())
        parts.append(followed(stack, theta_i_deg, seed, only(seen, False)))
        if through is None:
            parts.append(followed(stack, theta_i_deg, seed, only(seen, True)))
        else:
            parts.append(rows_at(through, number, only(seen, True)))
    means, errors = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    return {
        "bsdf_per_sr": [float(f"{value:.5g}") for value in means],
        "standard_error_per_sr": [float(f"{error:.2g}") for error in errors],
    }


def drawn() -> dict:
    """What the Monte Carlo found of each sheet, kept in a file."""
    found = json.loads(DRAWN.read_text(encoding="utf-8")) if DRAWN.exists() else {}
    for title in SHEETS:
        if title not in found:
            found[title] = _draw(title)
            DRAWN.write_text(json.dumps(found) + "\n", encoding="utf-8")
    return found


def _measured(title: str) -> jaxink.GonioData:
    """A sheet with noise; what each direction has of its own from the Monte Carlo is part of its sigma."""
    found = drawn()[title]
    values, own = np.array(found["bsdf_per_sr"]), np.array(found["standard_error_per_sr"])
    sigma = np.hypot(_RELATIVE * values, _FLOOR_PER_SR)
    seen = [directions(theta) for theta in INCIDENCES_DEG]
    rng = np.random.default_rng(zlib.crc32(f"rough {title} noise".encode()))
    return jaxink.GonioData(
        theta_i_deg=np.repeat(INCIDENCES_DEG, [view.theta_deg.size for view in seen]),
        theta_o_deg=np.concatenate([view.theta_deg for view in seen]),
        phi_deg=np.concatenate([view.phi_deg for view in seen]),
        wavelength_nm=np.full(values.size, WAVELENGTH_NM),
        is_transmission=np.concatenate([view.is_transmission for view in seen]),
        bsdf_per_sr=values + sigma * rng.standard_normal(values.size),
        sigma_per_sr=np.hypot(sigma, own),
    )


def project(chosen: tuple[str, ...], is_thickness_free: bool) -> jaxink.Project:
    """Some of the sheets; with free thicknesses, one for thin and one for thick."""
    measurements = []
    for title in chosen:
        sheet, side = SHEETS[title]
        sample = jaxink.parse_sample(_SAMPLE)
        table = sample.parameters.replace("ink.thickness_um", value=THICKNESS_UM[sheet])
        sample = dataclasses.replace(sample, parameters=table)
        if is_thickness_free:
            sample = with_free_thickness(sample, "ink.thickness_um")
        names = {n: f"{sheet}/{n}" if n == "ink.thickness_um" else n for n in sample.parameters}
        if side == "ink":
            turned = turned_over(sample)
            assert turned is not None
            sample, names = turned, {opposite_medium(own): name for own, name in names.items()}
        name = title.replace(", ", "_").replace(" ", "_")
        measurements.append(Measurement(name, _measured(title), sample, names))
    return jaxink.Project(tuple(measurements))


def fitted(chosen: tuple[str, ...], is_thickness_free: bool) -> dict:
    """What a fit finds of some of the sheets."""
    truth = TRUTH | {f"{sheet}/ink.thickness_um": value for sheet, value in THICKNESS_UM.items()}
    return told(jaxink.fit(project(chosen, is_thickness_free), options=OPTIONS), truth.__getitem__)
