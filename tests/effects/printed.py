"""An ink printed on a plate, with three free numbers, as effects and diagnosis are tested on."""

TEXT = """
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
