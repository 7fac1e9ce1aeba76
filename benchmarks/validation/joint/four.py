"""One simulated Mie ink, printed thin and thick, each lit from both sides: alone, in pairs, and all four.

The measurements are those of an independent program. What a fit may know is in their declared files; the
truth is read only afterwards, to count standard errors.
"""

import dataclasses
import itertools
from collections.abc import Callable

import jaxink
from benchmarks.simulated_data import data_file, declared_text, truth_of
from jaxink.fitting import FitOptions, JointResult
from jaxink.projects import Measurement
from jaxink.sample import Sample

THIN, THICK = "joint_thin", "joint_thick"
SHEETS = {"thin, plate lit": (THIN, "plate"), "thin, ink lit": (THIN, "ink")}
SHEETS |= {"thick, plate lit": (THICK, "plate"), "thick, ink lit": (THICK, "ink")}
OPTIONS = FitOptions(accuracy=1e-3, profile="none")
# Key of the truth file by the name of a parameter.
_KEYS = {
    "ink.radius_nm": "radius_nm",
    "ink.volume_fraction": "pvc",
    "ink.particle_index": "n_re",
    "ink.particle_absorption_index": "n_im",
}


def combinations() -> list[tuple[str, ...]]:
    """Each alone, all pairs, all four."""
    return [chosen for n in (1, 2, 4) for chosen in itertools.combinations(SHEETS, n)]


def project(chosen: tuple[str, ...], is_thickness_free: bool) -> jaxink.Project:
    """Some of the measurements; with free thicknesses, one for thin and one for thick."""
    measurements = []
    for title in chosen:
        sheet, side = SHEETS[title]
        file = f"{sheet}_lit_{side}"
        sample = jaxink.parse_sample(declared_text(file), file)
        if is_thickness_free:
            sample = with_free_thickness(sample, "ink.thickness_um")
        sample = dataclasses.replace(sample, title="")
        owner = "thin" if sheet == THIN else "thick"
        names = {n: f"{owner}/{n}" if n == "ink.thickness_um" else n for n in sample.parameters}
        name = f"{owner}_{side}_lit"
        measurements.append(Measurement(name, jaxink.read(data_file(file)), sample, names))
    return jaxink.Project(tuple(measurements))


def fitted(chosen: tuple[str, ...], is_thickness_free: bool) -> dict:
    """What a fit finds of some of the measurements."""
    return told(jaxink.fit(project(chosen, is_thickness_free), options=OPTIONS), _truth)


def told(result: JointResult, truth: Callable[[str], float]) -> dict:
    """What a joint fit finds, with its distance from the truth in standard errors."""
    rows = {}
    for p in result.parameters.free:
        true, error = truth(p.name), p.standard_error
        rows[p.name] = {
            "value": p.value,
            "standard_error": error,
            "flag": p.flag,
            "errors_off": None if error is None else (p.value - true) / error,
            "relative_off": p.value / true - 1,
        }
    minima = result.minima
    return {
        "reduced_chi_square": result.reduced_chi_square,
        "probability_of_disagreement": result.agreement.probability if result.agreement else None,
        "parameters": rows,
        "comparable_minima": len(minima.comparable) if minima else None,
        "next_minimum": minima.found[1].rise if minima and len(minima.found) > 1 else None,
        "seconds": round(sum(s.run_seconds for s in result.searches), 1),
    }


def with_free_thickness(sample: Sample, name: str) -> Sample:
    """A thickness known no better than anyone would measure it; the start is not the declared value."""
    declared = sample.parameters[name].value
    ends = {"minimum": 0.6 * declared, "maximum": 1.6 * declared, "value": 0.8 * declared}
    table = sample.parameters.replace(name, free=True, **ends)
    return dataclasses.replace(sample, parameters=table)


def _truth(name: str) -> float:
    owner, _, plain = name.rpartition("/")
    ink = truth_of(f"{THICK if owner == 'thick' else THIN}_lit_plate")["ink"]
    return 1000 * ink["d_mm"] if plain == "ink.thickness_um" else ink["phase"][_KEYS[plain]]
