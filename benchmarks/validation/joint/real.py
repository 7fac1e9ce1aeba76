"""Real measurements as projects: what several wavelengths of one sample share, and whether they agree on it.

The files are read where they are; nothing of them is kept.
"""

import jaxink
from benchmarks.pages import data_folder
from jaxink.fitting import FitOptions
from jaxink.projects import Project, parse_project

_OPTIONS = FitOptions(accuracy=1e-3, profile="none")
# Sintered PTFE: one face for all wavelengths, the volume scatters differently at each.
_PTFE = """
schema_version = 1
title = "Sintered PTFE plaque (Germer, NIST), one face at four wavelengths"

[sample]
[[sample.layers]]
name = "ptfe"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = { free = true, value = 1.3, min = 1.02, max = 1.6 }
thickness_um = "opaque"
single_scattering_albedo = 0.99
asymmetry_parameter = { free = true, value = 0.3, min = -0.5, max = 0.95 }
[sample.layers.front_roughness]
density = "ggx"
sigma_deg = { free = true, value = 30, min = 1, max = 45 }
# sigma_per_sr of the file is the residual of a published fit, not a noise: estimate it from the pairs.
[sample.noise]
use_file_sigma = false
[sample.masks]
specular_half_angle_deg = 0
undeviated_half_angle_deg = 0
retro_half_angle_deg = 0
"""
_PAINT = """
schema_version = 1
title = "Aeroglaze Z307 black paint, one face at two wavelengths"

[sample]
[[sample.layers]]
name = "paint"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = { free = true, value = 1.3, min = 1.02, max = 1.7 }
thickness_um = "opaque"
single_scattering_albedo = 0.4
asymmetry_parameter = { free = true, value = 0.0, min = -0.6, max = 0.9 }
[sample.layers.front_roughness]
density = "ggx"
sigma_deg = { free = true, value = 30, min = 1, max = 45 }
[sample.masks]
# What is near the specular direction is the surface's own light.
specular_half_angle_deg = 0
"""
_ALBEDO = "{ free = true, value = %g, min = %g, max = %g }"
SAMPLES = {
    "ptfe_nist_germer": (_PTFE, "ptfe", "brdf_regular.csv", (351, 532, 633, 1064), (0.99, 0.9, 1.0)),
    "paint_z307_black": (_PAINT, "paint", "brdf_inplane.csv", (630.79, 852.23), (0.4, 0.01, 0.999)),
}


def project(name: str) -> Project:
    """The measurements of a sample at each wavelength; the albedo is that of the wavelength."""
    text, layer, file, wavelengths, albedo = SAMPLES[name]
    for wavelength in wavelengths:
        text += (
            f'\n[[measurements]]\nname = "at_{wavelength:.0f}_nm"\ndata = "{file}"\n'
            f"changes.wavelength_nm = {wavelength}\n"
            f"changes.{layer}.single_scattering_albedo = {_ALBEDO % albedo}\n"
        )
    return parse_project(text, name, data_folder("measured") / name)


def fitted(name: str) -> dict:
    """What a joint fit finds, beside fits of each wavelength alone."""
    made = project(name)
    joint = jaxink.fit(made, options=_OPTIONS)
    alone = {}
    for one in made.measurements:
        result = jaxink.fit(one.data, one.sample, _OPTIONS)
        alone[one.name] = {
            "reduced_chi_square": result.merit.reduced_chi_square,
            "rms": result.deviation and result.deviation.rms,
            "values": {p.name: p.value for p in result.parameters.free},
        }
    compared = joint.agreement
    return {
        "reduced_chi_square": joint.reduced_chi_square,
        "values": {p.name: p.value for p in joint.parameters.free},
        "rms": {n: r.deviation and r.deviation.rms for n, r in joint.measurements.items()},
        "reduced": {p.name: p.reduced_chi_square for p in compared.parts} if compared else {},
        "agreement": compared.sentence if compared else None,
        "alone": alone,
    }
