"""The embedded examples: simulated measurements with their sample files; see the README beside them."""

from pathlib import Path

# True values of the simulation, by parameter name of the sample file.
SIMULATED_TRUTH = {
    "ink.scattering_per_mm": 95.0,
    "ink.absorption_per_mm": 1.1,
    "ink.asymmetry_parameter": 0.6,
}
# Those of the measurement with stray light, which its sample file does not declare.
STRAY_LIGHT_TRUTH = {
    "ink.scattering_per_mm": 120.0,
    "ink.absorption_per_mm": 1.0,
    "ink.asymmetry_parameter": 0.6,
    "stray_light.level_per_sr": 0.01,
}


def simulated_example() -> tuple[Path, Path]:
    """Paths of the CSV file and of the sample file of the embedded simulated measurement."""
    folder = Path(__file__).parent
    return folder / "simulated_plate_and_ink.csv", folder / "simulated_plate_and_ink.toml"


def stray_light_example() -> tuple[Path, Path]:
    """The same for a simulated measurement with an effect that its sample file does not declare."""
    folder = Path(__file__).parent
    return folder / "simulated_stray_light.csv", folder / "simulated_stray_light.toml"
