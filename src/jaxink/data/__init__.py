"""The embedded example: a simulated measurement with its sample file; see the README beside it."""

from pathlib import Path

# True values of the simulation, by parameter name of the sample file.
SIMULATED_TRUTH = {
    "ink.scattering_per_mm": 95.0,
    "ink.absorption_per_mm": 1.1,
    "ink.asymmetry_parameter": 0.6,
}


def simulated_example() -> tuple[Path, Path]:
    """Paths of the CSV file and of the sample file of the embedded simulated measurement."""
    folder = Path(__file__).parent
    return folder / "simulated_plate_and_ink.csv", folder / "simulated_plate_and_ink.toml"
