"""Diagnoses of simulated spectra of inks that are declared otherwise: pigment, fluorescence, fringes.

python -m benchmarks.validation.colour.named

The spectra are those of the forward model itself, with noise from a seed; the sample file of the diagnosis
lacks what was simulated, or names another pigment.
"""

import json
import time
from pathlib import Path

import numpy as np

import jaxink

RESULTS = Path(__file__).with_name("named.json")
WAVES = (450.0, 500.0, 550.0, 600.0, 650.0)
_INCIDENCES_DEG, _STEP_DEG, _LAST_DEG, _NEAR_DEG = (0.0, 40.0), 5.0, 80.0, 3.0
_PLATE = """schema_version = 1
wavelength_nm = [450, 500, 550, 600, 650]
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1
[[layers]]
name = "ink"
kind = "scattering"
"""
# With a film on the plate.
_COATED = _PLATE.replace(
    "[[layers]]",
    '[[layers]]\nname = "coat"\nkind = "clear"\nrefractive_index = 1.5\nthickness_um = 1.2\n[[layers]]',
    1,
)
_NOISE = "[noise]\nrelative = 0.005\nfloor_per_sr = 1e-4\n"
_PIGMENT = """phase_function = "mie"
refractive_index = 1.5
thickness_um = 20
radius_nm = { free = true, value = 150, min = 80, max = 400 }
volume_fraction = { free = true, value = 0.05, min = 0.002, max = 0.4 }
particle_index = { material = "NAME" }
particle_absorption_index = { material = "NAME" }
"""
_DYED = """phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 40
scattering_per_mm = { per_wavelength = true, free = true, value = [110, 100, 90, 82, 75], min = 9, max = 500 }
absorption_per_mm = { per_wavelength = true, free = true, value = [9, 6, 2, 0.6, 0.3], min = 0, max = 50 }
asymmetry_parameter = { free = true, value = 0.6, min = 0, max = 0.9 }
"""
_FLUORESCENCE = """[effects.fluorescence]
quantum_yield = 0.15
excitation = { per_wavelength = true, value = [1, 1, 0, 0, 0] }
emission = { per_wavelength = true, value = [0, 0, 0.5, 0.4, 0.1] }
"""
_WHITE_LIGHT = """[instrument]
illumination = { wavelength_nm = [450, 650], power = [1, 1] }
detector_mode = "spectrometer"
"""
_DISPERSION = "[effects.dispersion]\nb_um2 = 0.02\nmiddle_nm = 550\n"
_FRINGES = (
    "[effects.interference]\namplitude = 0.03\nphase_rad = 0.7\nthickness_um = 1.2\nrefractive_index = 1.5\n"
)


def _of(pigment: str) -> str:
    return _PLATE + _PIGMENT.replace("NAME", pigment) + _NOISE


# What was simulated, what is declared, and the name that is to be found.
CASES = {
    "rutile, declared anatase": (_of("rutile"), _of("anatase"), "particles_of_ink_are_rutile"),
    "anatase, declared rutile": (_of("anatase"), _of("rutile"), "particles_of_ink_are_anatase"),
    "fluorescence, quantum yield 0.15": (
        _PLATE + _DYED + _FLUORESCENCE + _WHITE_LIGHT + _NOISE,
        _PLATE + _DYED + _WHITE_LIGHT + _NOISE,
        "fluorescence",
    ),
    "dispersion of the binder": (
        _PLATE + _DYED + _DISPERSION + _NOISE,
        _PLATE + _DYED + _NOISE,
        "dispersion",
    ),
    "interference in a film that is not declared": (
        _PLATE + _DYED + _FRINGES + _NOISE,
        _PLATE + _DYED + _NOISE,
        "interference",
    ),
    "fluorescence, quantum yield 0.6": (
        _PLATE + _DYED + _FLUORESCENCE.replace("0.15", "0.6") + _WHITE_LIGHT + _NOISE,
        _PLATE + _DYED + _WHITE_LIGHT + _NOISE,
        "fluorescence",
    ),
    "interference in a declared film": (
        _COATED + _DYED + _FRINGES + _NOISE,
        _COATED + _DYED + _NOISE,
        "interference",
    ),
}


def simulated(text: str, seed: int) -> jaxink.GonioData:
    """A measurement in the plane of incidence, both sides, with noise."""
    rows = [
        (theta_i, abs(seen), 0.0 if seen < 0 else 180.0, nm, is_transmission)
        for theta_i in _INCIDENCES_DEG
        for nm in WAVES
        for is_transmission in (False, True)
        for seen in np.arange(-_LAST_DEG, _LAST_DEG + 1, _STEP_DEG)
        if abs(abs(seen) - theta_i) > _NEAR_DEG
    ]
    theta_i, theta_o, phi, nm, is_transmission = map(np.array, zip(*rows, strict=True))
    ones = np.ones(len(rows))
    blank = jaxink.GonioData(
        theta_i_deg=theta_i,
        theta_o_deg=theta_o,
        phi_deg=phi,
        wavelength_nm=nm,
        is_transmission=is_transmission,
        bsdf_per_sr=ones,
        sigma_per_sr=ones,
    )
    exact = np.asarray(jaxink.predict(jaxink.parse_sample(text), blank))
    sigma = np.hypot(0.005 * exact, 1e-4)
    noise = np.random.default_rng(seed).standard_normal(len(rows))
    return blank.replace(bsdf_per_sr=exact + sigma * noise, sigma_per_sr=sigma)


def diagnosed(name: str) -> dict:
    """What the diagnosis of a case says."""
    true, declared, expected = CASES[name]
    started = time.process_time()
    found = jaxink.diagnose(simulated(true, list(CASES).index(name)), jaxink.parse_sample(declared))
    mistakes = [mistake.name for mistake in found.declared.mistakes if mistake.is_named]
    return {
        "code": found.verdict.code,
        "named": [step.effect for step in found.steps] or mistakes,
        "expected": expected,
        "reduced_chi_square": [s.fitted.reduced_chi_square for s in (found.before, found.after)],
        "sentence": found.verdict.sentence,
        "processor_s": round(time.process_time() - started),
    }


def main() -> None:
    """Diagnose the cases that are missing."""
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    for name in CASES:
        if name not in kept:
            kept[name] = diagnosed(name)
            RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
            print(name, kept[name]["code"], kept[name]["named"], kept[name]["processor_s"], "s", flush=True)


if __name__ == "__main__":
    main()
