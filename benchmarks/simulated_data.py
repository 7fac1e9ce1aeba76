"""The simulated measurements: their files, and sample files that say what their declared files say."""

import json
from pathlib import Path

from benchmarks.pages import data_folder

_NAMES = {
    "mus": "scattering_per_mm",
    "mua": "absorption_per_mm",
    "g": "asymmetry_parameter",
    "radius_nm": "radius_nm",
    "pvc": "volume_fraction",
    "n_re": "particle_index",
    "n_im": "particle_absorption_index",
}
_PHASES = {"hg": "henyey_greenstein", "mie": "mie"}
_PHASE_UNKNOWNS = {"hg": ("mus", "mua", "g"), "mie": ("radius_nm", "pvc", "n_re", "n_im")}
# Of an ink of spheres that is described by Henyey-Greenstein scattering instead: about as wide as declared
# for the simulated inks that scatter in this way.
_HG_RANGES = {"mus": [1, 2000], "mua": [0, 50], "g": [-0.9, 0.95]}


def names() -> list[str]:
    """Of all simulated measurements."""
    files = data_folder("simulated").glob("*.declared.json")
    return sorted(file.name.removesuffix(".declared.json") for file in files)


def data_file(name: str) -> Path:
    """The measurement itself."""
    return data_folder("simulated") / f"{name}.csv"


def declared_text(name: str, phase: str | None = None) -> str:
    """Sample file that says what the declared file of a measurement says.

    With ``phase`` "hg", the ink scatters by Henyey-Greenstein, whatever the file says, and nothing of its
    particles is known.
    """
    declared = _content(name, "declared")
    return _sample_toml(declared if phase is None else _with_phase(declared, phase))


def truth_of(name: str) -> dict:
    """What no fit may know of a measurement."""
    return _content(name, "truth")


def _content(name: str, kind: str) -> dict:
    return json.loads(data_file(name).with_name(f"{name}.{kind}.json").read_text(encoding="utf-8"))


def _with_phase(declared: dict, phase: str) -> dict:
    """A declared file with another phase function, all of whose numbers are unknown."""
    if phase != "hg":
        raise ValueError(f"the phase function is {phase!r}; it can be exchanged for 'hg' only.")
    layers = [
        layer if layer["layer"] == "substrate" else {**layer, "phase_model": {"type": phase}}
        for layer in declared["stack_from_illuminated_side"]
    ]
    return declared | {
        "stack_from_illuminated_side": layers,
        "unknown_parameters": list(_HG_RANGES),
        "parameter_ranges": _HG_RANGES,
        "per_wavelength": ["mus", "mua"],
    }


def _sample_toml(declared: dict) -> str:
    """What a declared file says: unknowns are free in their declared ranges and start in the middle."""
    wavelengths = declared["wavelength_nm"]
    lines = ["schema_version = 1", 'title = "simulated measurement"', f"wavelength_nm = {wavelengths}", ""]
    for layer in declared["stack_from_illuminated_side"]:
        lines += _layer(layer, declared, len(wavelengths) > 1)
    noise = declared["noise"]
    lines += [
        "[noise]",
        f"relative = {noise['rel']}",
        f"floor_per_sr = {noise['floor']}",
        *([f"scan_relative = {noise['scan_rel']}"] if "scan_rel" in noise else []),
        "",
        "# The rows near the regular peaks and near the source are absent from the file.",
        "[masks]",
        "specular_half_angle_deg = 0",
        "undeviated_half_angle_deg = 0",
        "retro_half_angle_deg = 0",
    ]
    if "detector" in declared:
        light = declared["detector"]["illumination"]
        nm, power = light["wavelength_nm"], light["power_per_nm"]
        lines += [
            "",
            "[instrument]",
            f'detector_mode = "{declared["detector"]["mode"]}"',
            f"illumination = {{ wavelength_nm = {nm}, power = {power} }}",
        ]
    return "\n".join(lines) + "\n"


def _layer(layer: dict, declared: dict, is_spectrum: bool) -> list[str]:
    lines = ["[[layers]]"]
    if layer["layer"] == "substrate":
        return [
            *lines,
            'name = "plate"',
            'kind = "clear"',
            f"refractive_index = {layer['n']}",
            f"thickness_mm = {layer['thickness_mm']}",
            f"absorption_per_mm = {layer['absorption_per_mm']}",
            "",
        ]
    model = layer["phase_model"]
    lines += [
        'name = "ink"',
        'kind = "scattering"',
        f'phase_function = "{_PHASES[model["type"]]}"',
        f"refractive_index = {layer['binder_n']}",
        f"thickness_um = {round(1000 * layer['thickness_mm'], 6)}",
    ]
    for key in _PHASE_UNKNOWNS[model["type"]]:
        if key in declared["unknown_parameters"]:
            low, high = declared["parameter_ranges"][key]
            # A dye absorbs differently at each wavelength; everything else is shared.
            separate = declared.get("per_wavelength", ["n_im"])
            each = ", per_wavelength = true" if is_spectrum and key in separate else ""
            lines.append(f"{_NAMES[key]} = {{ free = true, min = {low}, max = {high}{each} }}")
        else:
            lines.append(f"{_NAMES[key]} = {model[key]}")
    rough = declared["roughness"]
    if isinstance(rough, dict):
        face = rough["ink_air"]
        lines.append(f'back_roughness = {{ density = "{face["kind"]}", sigma_deg = {face["sigma_deg"]} }}')
    return [*lines, ""]
