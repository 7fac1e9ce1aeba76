"""Every effect of the catalogue declared in a sample file: fitted, written, read and fitted again.

python -m benchmarks.validation.declared_effects [NAME ...]

Data are simulated by jaxink itself, with noise; the samples are small and the resolution coarse, because
only the way through the file is examined. Writes docs/validation/declared-effects.md.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.pages import machine, table, write_page
from jaxink.effects import Case, ReadingEffect, Scene, declare, effects_for
from jaxink.measurement import GonioData
from jaxink.sample import parse_sample, sample_text
from jaxink.solver.config import SolverConfig

CONFIG = SolverConfig(4, 3, 8, 2)
KEPT = Path(__file__).with_suffix(".json")
# Two wavelengths, an instrument that sees fluorescence, and layers for as many effects as possible.
TWO_COLOURS = """
schema_version = 1
wavelength_nm = [450, 550]
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.49
thickness_mm = 2
absorption_per_mm = 0.001
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.55
thickness_um = 6
scattering_per_mm = { value = 90, free = true, min = 1, max = 400 }
absorption_per_mm = 1
asymmetry_parameter = 0.5
[instrument]
detector_mode = "spectrometer"
illumination = { wavelength_nm = [300, 700], power = [1, 1] }
"""
ROUGH = TWO_COLOURS.replace(
    "[instrument]", '[layers.back_roughness]\ndensity = "beckmann"\nsigma_deg = 5\n[instrument]'
)
MIE = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = 20
radius_nm = 150
volume_fraction = { value = 0.05, free = true, min = 0.01, max = 0.3 }
particle_index = 2.5
"""
OPAQUE = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.2
thickness_um = "opaque"
single_scattering_albedo = { value = 0.99, free = true, min = 0.9, max = 1 }
asymmetry_parameter = 0.3
"""
BASES = {"two colours": TWO_COLOURS, "rough": ROUGH, "Mie": MIE, "opaque": OPAQUE}


def sides_of(sample):
    """Whether the points of a side are in transmission: both sides unless the ink is opaque."""
    return [False] if sample.layers[-1].opaque else [False, True]


def scene_of(sample):
    """A few directions: columns, and the scene of an effect."""
    waves = np.array(sample.wavelengths_nm)
    signed = np.array([-50.0, -21.0, 5.0, 40.0])
    theta_i, side, wave, angle = (
        a.ravel() for a in np.meshgrid([20.0], sides_of(sample), waves, signed, indexing="ij")
    )
    columns = theta_i, np.abs(angle), np.where(angle > 0, 180.0, 0.0), wave, side
    return columns, Scene.of(*columns, row=np.arange(angle.size) + 2)


def forms_by_program():
    """Base and forms of effects that can be present at the same time: those of one program, or one alone."""
    found = {}
    for name, text in BASES.items():
        sample = parse_sample(text)
        _, scene = scene_of(sample)
        listed = effects_for(Case(sample, scene, 0.001, 0.1)).forms
        for form in listed:
            others = (forms for (other, _), forms in found.items() if other != name)
            seen = any(form.name in {f.name for f in forms} for forms in others)
            if not form.is_screened or seen or (form.carrier != form and form.carrier in listed):
                continue
            # Readings and values share a program; what changes the structure has its own.
            shared = isinstance(form, ReadingEffect) or form.program == "areas with other values"
            key = (name, "readings" if shared else str(form))
            found.setdefault(key, []).append(form)
    return found


def sample_for(base, forms):
    """The sample of a base, with one wavelength if that is enough for some effects."""
    several = {"dispersion", "wave_surface", "fluorescence"} & {form.name for form in forms}
    text = BASES[base]
    return parse_sample(text if several else text.replace("[450, 550]", "550"))


def strengths(forms):
    """Values of all terms: a fifth of the way to the end of the range, or its middle if they fall."""
    values = {}
    for form in forms:
        for term in form.carrier.terms:
            values[term.name] = term.value
        # What distinguishes the form from others that the same carrier computes.
        values |= form.settings[0]
        strength = form.carrier.strength
        low, high = strength.minimum, strength.maximum
        is_falling = form.neutral == high
        values[strength.name] = (
            np.sqrt(low * high) if is_falling else form.neutral + 0.2 * (high - form.neutral)
        )
    return values


def round_trip(base: str, form) -> list[str]:
    """Fit data with an effect, write the fitted sample, read it, predict, and fit again."""
    sample = sample_for(base, (form,))
    columns = directions(sample)
    values = strengths((form,))
    declared = declare(sample, (form,), values)
    data = GonioData(*columns, np.ones(columns[0].size))
    exact = jaxink.predict(declared, data, CONFIG)
    sigma = 0.01 * exact + 1e-5
    noise = np.random.default_rng(20261123).normal(size=exact.size)
    data = data.replace(bsdf_per_sr=exact + sigma * noise, sigma_per_sr=sigma)
    options = jaxink.FitOptions(config=CONFIG, profile="none", scan=False)
    first = jaxink.fit(data, declared, options)
    read = parse_sample(sample_text(first.sample))
    predicted = jaxink.predict(read, first.data, CONFIG)
    again = jaxink.fit(data, read, options)
    used = first.data.used
    strength = form.carrier.strength.name
    return [
        f"`{form.name}`",
        f"{largest_difference(predicted[used], first.predicted_per_sr):.1g}",
        f"{first.merit.chi_square:.3f}",
        f"{again.merit.chi_square - first.merit.chi_square:+.1g}",
        f"{values[strength]:.4g}",
        f"{again[strength].value:.4g}",
    ]


def largest_difference(found, expected):
    """Relative to the expected values; at a coarse resolution some are 0, where both must be."""
    with np.errstate(invalid="ignore"):
        return np.max(np.where(found == expected, 0.0, np.abs(found / expected - 1)))


def directions(sample):
    """Three incidences in the plane of incidence."""
    waves, signed = np.array(sample.wavelengths_nm), np.arange(-75.0, 76.0, 6.0)
    theta_i, side, wave, angle = (
        a.ravel() for a in np.meshgrid([0.0, 20.0, 50.0], sides_of(sample), waves, signed, indexing="ij")
    )
    return theta_i, np.abs(angle), np.where(angle > 0, 180.0, 0.0), wave, side


def main() -> None:
    """Examine what is asked for or missing, and write the page from all that is kept."""
    asked, kept = sys.argv[1:], json.loads(KEPT.read_text()) if KEPT.exists() else {}
    forms = {form.name: (base, form) for (base, _), found in forms_by_program().items() for form in found}
    for name, (base, form) in forms.items():
        if name in asked or (not asked and name not in kept):
            begin = time.monotonic()
            kept[name] = round_trip(base, form)
            KEPT.write_text(json.dumps(kept, indent=1) + "\n")
            print(name, f"{time.monotonic() - begin:.0f} s", kept[name][1:4], flush=True)
    rows = [kept[name] for name in forms if name in kept]
    header = ["effect", "prediction read / fitted - 1", "chi-square", "refit minus fit", "true", "refitted"]
    text = f"""# Effects through the sample file

Written by `python -m benchmarks.validation.declared_effects` ({machine()}).
Data **simulated** by jaxink itself, with an effect and noise, are fitted with the effect declared and free;
the fitted sample is written as a sample file, read, used for a prediction, and fitted again. The prediction
is to agree within 1e-9, chi-square within 0.01. Samples are small and the resolution is coarse, as only the
way through the file is examined; how well a strength is determined is another matter, in
[diagnosis](../manual/diagnosis.md).

{table(header, rows)}
"""
    write_page("declared-effects.md", text)


if __name__ == "__main__":
    main()
