"""The problems: what is minimised, and what is known of the answer.

The seven published reconstructions come from `benchmarks.validation.published.problems`. All are computed at
a resolution for 1e-3, which shifts a minimum by less than its standard errors.
"""

import dataclasses
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import jaxink
from benchmarks.optimisers.both_faces import of_both_faces
from benchmarks.pages import REPOSITORY
from benchmarks.simulated_data import data_file
from benchmarks.validation.measured.diagnosis import SAMPLES
from benchmarks.validation.published.problems import EVERYTHING, NAMES, PROTOCOL, problem
from benchmarks.validation.simulated.fits import text_of
from jaxink.fitting import Objective, make_objective, prepare_data
from jaxink.sample import Sample
from jaxink.solver.config import SolverConfig

ACCURACY = 1e-3
_SIMULATED = ("plain_hg", "index_step_hg", "free_film_mie")
# File of the measurement, sample file and objective of the measured samples.
_MEASURED = {
    "ptfe": ("ptfe_nist_germer/brdf_regular.csv", "ptfe_nist_germer_n1.35.toml", "relative"),
    "paint": ("paint_z307_black/brdf_inplane.csv", "paint_z307_black.toml", "relative"),
}
# Root mean square residual and number of steps that the publications print, by problem.
PRINTED = {
    "white_ink_mie-mie-protocol": ("0.269 %", "within 30"),
    "white_ink_mie-hg-protocol": ("0.237 %", "within 30"),
    "white_ink_rough-mie-protocol": ("0.907 %", "30-40"),
    "white_ink_rough-hg-protocol": ("1.231 %", "30-40"),
    "coloured_ink-mie-protocol": ("13.7 %", ""),
    "coloured_ink-hg-protocol": ("12.1 %", ""),
    "sheet_2018-mie-protocol": ("4.5 %", "29 of 34"),
}


@dataclasses.dataclass(frozen=True)
class Posed:
    """A problem, ready to be minimised.

    Parameters
    ----------
    objective
        What is minimised.
    sample
        Its free parameters are the variables; its values are the first start.
    """

    objective: Objective
    sample: Sample

    @property
    def rugged(self) -> int | None:
        """Position of the parameter that a scan precedes; None without one."""
        found = [i for i, p in enumerate(self.sample.parameters.free) if p.multimodal]
        return found[0] if found else None


def _simulated(name: str) -> Posed:
    sample = jaxink.parse_sample(text_of(name), name)
    data = prepare_data(jaxink.read(data_file(name)), sample)
    return Posed(make_objective(data, sample, accuracy=ACCURACY), sample)


def _published(name: str, scans: str) -> Posed:
    one = problem(name, scans)

    def objective(config: SolverConfig | None) -> Objective:
        if len(one.measurements) > 1:
            return of_both_faces(one, config)
        return make_objective(one.data, one.sample, one.kind, config)

    return Posed(objective(objective(None).model.sizes({}, ACCURACY)), one.sample)


def _measured_folder() -> Path:
    root = Path(os.environ.get("JAXINK_DATA", REPOSITORY.parent / "shared" / "data"))
    return root / "measured"


def _measured(name: str) -> Posed:
    file, toml, kind = _MEASURED[name]
    sample = jaxink.load_sample(SAMPLES / toml)
    data = prepare_data(jaxink.read(_measured_folder() / file), sample)
    return Posed(make_objective(data, sample, kind, accuracy=ACCURACY), sample)


def problems() -> dict[str, Callable[[], Posed]]:
    """All problems by name; measured samples only where their data are."""
    found: dict[str, Callable[[], Posed]] = {name: partial(_simulated, name) for name in _SIMULATED}
    for name in NAMES:
        for scans in (EVERYTHING, PROTOCOL):
            found[f"{name}-{scans}"] = partial(_published, name, scans)
    for name, (file, _, _) in _MEASURED.items():
        if (_measured_folder() / file).exists():
            found[name] = partial(_measured, name)
        else:
            print(f"{name}: the measured data are absent ({_measured_folder() / file}); left out.")
    return found
