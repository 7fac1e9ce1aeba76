"""Inks and guides that the tests of renderings share."""

import functools

from jaxink.render import Guide, RenderedInk
from jaxink.sample import load_sample

# Thin, so that the rim of a dot matters little.
PRINTED = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 10
scattering_per_mm = 400
absorption_per_mm = 4
asymmetry_parameter = 0.5
"""
GUIDE = Guide()


@functools.cache
def written(folder, text=PRINTED):
    """The sample file of an ink."""
    path = folder / "ink.toml"
    path.write_text(text, encoding="utf-8")
    return path


@functools.cache
def ink(folder, text=PRINTED):
    return RenderedInk.of(load_sample(written(folder, text)))
