"""Fluorescent inks by our own Monte Carlo, and their measurements.

python -m benchmarks.validation.fluorescence.inks

Writes inks.json: the BSDF of two inks without fluorescence, and the light emitted for each pair of exciting
and emitted wavelengths with a quantum yield of one. All measurements are made of these numbers.
"""

import json
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.montecarlo import Absorbed, Detectors, HenyeyGreenstein, Layer, Sample, emitted, simulate

FILE = Path(__file__).with_name("inks.json")
WAVES_NM = (405.0, 450.0, 520.0, 580.0, 640.0)
INCIDENCES_DEG = (0.0, 40.0, 60.0)
N_PHOTONS = 400_000
THICKNESS_MM, INDEX, ASYMMETRY = 0.06, 1.5, 0.6
SCATTERING_PER_MM = (95.0, 85.0, 75.0, 68.0, 62.0)
# Of each ink: absorption at each wavelength, number of wavelengths that excite, and share of the emitted
# photons at each.
INKS = {
    "green": ((7.0, 5.0, 0.5, 0.3, 0.3), 2, (0.0, 0.0, 0.7, 0.3, 0.0)),
    "red": ((3.0, 4.0, 6.0, 0.6, 0.2), 3, (0.0, 0.0, 0.0, 0.6, 0.4)),
}
YIELDS = (0.3, 0.5, 0.8)
RELATIVE_NOISE, FLOOR_PER_SR, SCAN_NOISE = 0.005, 1e-4, 0.003
TWICE = np.tile(np.arange(-80.0, 81.0, 8.0), 2)
SIDES = np.repeat([False, True], TWICE.size // 2)
NEAR_DEG = 2.5
TEXT = """
schema_version = 1
title = "simulated measurement"
wavelength_nm = {waves}
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
absorption_per_mm = 0.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 60
scattering_per_mm = {{ per_wavelength = true, free = true, min = 5, max = 500 }}
absorption_per_mm = {{ per_wavelength = true, free = true, min = 0, max = 30 }}
asymmetry_parameter = {{ free = true, min = -0.5, max = 0.9 }}
[instrument]
detector_mode = "spectrometer"
illumination = {{ wavelength_nm = {waves}, power = {powers} }}
[noise]
relative = {relative}
floor_per_sr = {floor}
scan_relative = {scan}
[masks]
specular_half_angle_deg = 2.5
undeviated_half_angle_deg = 2.5
retro_half_angle_deg = 0
"""


def sample(ink: str, wave: int) -> Sample:
    """An ink on its plate at one of the wavelengths."""
    body = Layer(
        INDEX, THICKNESS_MM, SCATTERING_PER_MM[wave], INKS[ink][0][wave], HenyeyGreenstein(ASYMMETRY)
    )
    return Sample((Layer(INDEX, 1.0), body))


def detectors() -> Detectors:
    """Directions in the plane of incidence, in reflection and in transmission."""
    return Detectors(np.abs(TWICE), np.where(TWICE < 0, 0.0, 180.0), SIDES)


def simulated(ink: str) -> dict:
    """What is simulated of one ink: values and standard errors."""
    _, n_exciting, bands = INKS[ink]
    elastic, light = {}, {}

    def kept(result):
        mean, error = result.mean_and_error(result.bsdf)
        return {"bsdf": _short(mean), "error": _short(error)}

    for incidence in INCIDENCES_DEG:
        for wave, nm in enumerate(WAVES_NM):
            absorbed, seed = Absorbed(), int(1000 * incidence + wave)
            elastic[f"{incidence:g} {nm:g}"] = kept(
                simulate(sample(ink, wave), incidence, N_PHOTONS, seed, detectors(), absorbed=absorbed)
            )
            for to in np.flatnonzero(bands) if wave < n_exciting else ():
                found = emitted(sample(ink, to), absorbed, 2, N_PHOTONS, seed + 100 + int(to), detectors())
                light[f"{incidence:g} {nm:g} {WAVES_NM[to]:g}"] = kept(found)
            print(ink, incidence, nm, flush=True)
    return {"elastic": elastic, "emitted": light}


def exact(ink: str, quantum_yield: float, kept: dict) -> np.ndarray:
    """BSDF without noise, shape ``(incidences, wavelengths, directions)``; lamp of equal power at all."""
    bands, found = INKS[ink][2], np.empty((len(INCIDENCES_DEG), len(WAVES_NM), TWICE.size))
    for i, incidence in enumerate(INCIDENCES_DEG):
        for k, nm in enumerate(WAVES_NM):
            found[i, k] = kept["elastic"][f"{incidence:g} {nm:g}"]["bsdf"]
            for exciting in WAVES_NM:
                here = kept["emitted"].get(f"{incidence:g} {exciting:g} {nm:g}")
                if here is not None:
                    photons = exciting / nm * quantum_yield * bands[k]
                    found[i, k] += photons * np.array(here["bsdf"])
    return found


def measured(ink: str, quantum_yield: float) -> jaxink.GonioData:
    """A measurement with noise."""
    bsdf = exact(ink, quantum_yield, json.loads(FILE.read_text(encoding="utf-8"))[ink])
    incidence, nm, signed = (a.ravel() for a in np.meshgrid(INCIDENCES_DEG, WAVES_NM, TWICE, indexing="ij"))
    side = np.tile(SIDES, len(INCIDENCES_DEG) * len(WAVES_NM))
    bsdf = bsdf.ravel()
    rng = np.random.default_rng(int(1000 * quantum_yield) + len(ink))
    sigma = np.hypot(RELATIVE_NOISE * bsdf, FLOOR_PER_SR)
    columns = incidence, np.abs(signed), np.where(signed < 0, 0.0, 180.0), nm, side
    empty = jaxink.GonioData(*columns, bsdf, sigma)
    scan = SCAN_NOISE * rng.standard_normal(empty.scan_index.max() + 1)[empty.scan_index]
    drawn = bsdf * (1 + scan) + sigma * rng.standard_normal(bsdf.size)
    # The source hides what is sent back to it.
    near = ~side & (np.abs(signed + incidence) < NEAR_DEG)
    return jaxink.GonioData(*(c[~near] for c in (*columns, drawn, sigma)))


def declared() -> jaxink.Sample:
    """What the experimenter knows: nothing of fluorescence."""
    waves = list(WAVES_NM)
    noise = {"relative": RELATIVE_NOISE, "floor": FLOOR_PER_SR, "scan": SCAN_NOISE}
    return jaxink.parse_sample(TEXT.format(waves=waves, powers=[1.0] * len(waves), **noise))


def _short(numbers) -> list[float]:
    return [float(f"{x:.5g}") for x in numbers]


def main() -> None:
    """Simulate both inks."""
    found = {ink: simulated(ink) for ink in INKS}
    FILE.write_text(json.dumps(found) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
