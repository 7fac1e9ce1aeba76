"""Sample files that several tests read, and what measurements of them were made with."""


def edited(good: str, changes: tuple[str, ...]) -> str:
    """A text with every second change in the place of the one before it, which it has once."""
    for old, new in zip(changes[::2], changes[1::2], strict=True):
        assert good.count(old) == 1, old
        good = good.replace(old, new)
    return good


# Effects and diagnosis are tested on this print, with three free numbers.
PRINTED_INK = """
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
thickness_um = 60
scattering_per_mm = { free = true, min = 1, max = 500, value = 60 }
absorption_per_mm = { free = true, min = 0, max = 50, value = 1 }
asymmetry_parameter = { free = true, min = -0.9, max = 0.95, value = 0.5 }
[noise]
relative = 0.005
floor_per_sr = 1e-4
scan_relative = 0.002
"""

# An ink with a gap of air between it and its plate, declared as a layer.
BEHIND_AIR = """
schema_version = 1
wavelength_nm = [550]
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 2.0
[[layers]]
name = "air_gap"
kind = "clear"
refractive_index = 1.0
thickness_mm = 0.01
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 30
scattering_per_mm = 60
absorption_per_mm = 1
asymmetry_parameter = 0.3
"""

# What bad sample files are made from.
GOOD_SAMPLE = """\
schema_version = 1
wavelength_nm = [450, 550]
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
thickness_um = 80
scattering_per_mm = { free = true, min = 1, max = 1000 }
absorption_per_mm = 1.0
asymmetry_parameter = 0.6
[noise]
scan_relative = 0.002
"""

# A plate that is not matched to the binder and absorbs; an ink without absorption.
UNMATCHED = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.49
thickness_mm = 1.0
absorption_per_mm = 0.05
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.53
thickness_um = 40
scattering_per_mm = 80
absorption_per_mm = 0
asymmetry_parameter = 0.5
"""

# To be filled with the ink of a truth file; more tables may follow.
PLATE_AND_INK = """
schema_version = 1
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
thickness_um = {d_mm}e3
scattering_per_mm = {mus}
absorption_per_mm = {mua}
asymmetry_parameter = {g}
"""

# Reports are tested on a simulated measurement of this one, with stray light.
STRAY_LIGHT = """
schema_version = 1
title = "Simulated: <ink> & plate"
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
thickness_um = 90
scattering_per_mm = { free = true, value = 100, min = 1, max = 1000 }
absorption_per_mm = { free = true, value = 2, min = 0, max = 50 }
asymmetry_parameter = 0.6
[noise]
scan_relative = 0.002
"""
STRAY_PER_SR = 0.008
TRUTH = {"ink.scattering_per_mm": 120.0, "ink.absorption_per_mm": 1.0}
