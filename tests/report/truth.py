"""What the simulated measurement of these tests was made with."""

STRAY_PER_SR = 0.008
TRUTH = {"ink.scattering_per_mm": 120.0, "ink.absorption_per_mm": 1.0}
