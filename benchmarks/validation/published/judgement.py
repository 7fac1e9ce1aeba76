"""What is true of the stand-ins, and how a fit compares with it and with everything that was measured."""

import dataclasses
import json
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.simulated_data import truth_of
from benchmarks.validation.published.problems import SHEET, Problem, measured, problem
from jaxink.fitting.fit_objective import compile_objective
from jaxink.ink.comparison import TableComparison
from jaxink.ink.tabulate import TableOptions
from jaxink.numerics.precision import computing
from jaxink.sample import Sample
from jaxink.sample.turning import turned_over
from jaxink.solver.accuracy import DEFAULT_ACCURACY

_TABLE = TableOptions(n_theta=61, n_phi=13)


def with_values(sample: Sample, values: dict[str, float]) -> Sample:
    """The sample with other values of its free parameters."""
    table = sample.parameters
    for p in table.free:
        table = table.replace(p.name, value=values[p.name])
    return dataclasses.replace(sample, parameters=table)


def true_sample(name: str) -> Sample:
    """The stand-in as it was simulated."""
    return with_values(problem(f"{name.split('-')[0]}-mie").sample, truth_values(name))


def truth_values(name: str) -> dict[str, float]:
    """True values of the parameters of the spheres, by name; with a mean over the wavelengths."""
    ink = name.split("-")[0]
    if ink == SHEET:
        kept = json.loads((Path(__file__).parent / SHEET / "truth.json").read_text(encoding="utf-8"))
        return {f"ink.{key}": value for key, value in kept["ink"].items()}
    truth = truth_of(ink)
    phase = truth["ink"]["phase"]
    values = {
        "ink.radius_nm": phase["radius_nm"],
        "ink.volume_fraction": phase["pvc"],
        "ink.particle_index": phase["n_re"],
        "ink.particle_absorption_index": float(np.mean(phase["n_im"])),
    }
    if isinstance(phase["n_im"], list):
        for optics, k in zip(truth["optics"], phase["n_im"], strict=True):
            values[f"ink.particle_absorption_index@{optics['wavelength_nm']:g}"] = k
    if "ink_air" in truth["roughness"]:
        values["ink.back_roughness.sigma_deg"] = truth["roughness"]["ink_air"][1]
    return values


def predictions(name: str, sample: Sample) -> list[np.ndarray]:
    """BSDF at all rows that were measured, for each face that is lit."""
    data = measured(name.split("-")[0])
    samples = (sample, turned_over(sample))[: len(data)]
    return [jaxink.predict(one, rows) for one, rows in zip(samples, data, strict=True)]


def misfits(name: str, sample: Sample) -> list[dict]:
    """Relative rms of the prediction of each scan measured, and rms of pi times the difference."""
    rows = []
    for face, (data, predicted) in enumerate(
        zip(measured(name.split("-")[0]), predictions(name, sample), strict=True)
    ):
        for one in data.scans:
            here = data.scan_index == one.index
            f, m = predicted[here], data.bsdf_per_sr[here]
            rows.append(
                {
                    "face": face,
                    "side": one.side,
                    "theta_i_deg": one.theta_i_deg,
                    "wavelength_nm": one.wavelength_nm,
                    "relative_rms": float(np.sqrt(np.mean((f / m - 1) ** 2))),
                    "rms_of_pi_f": float(np.pi * np.sqrt(np.mean((f - m) ** 2))),
                }
            )
    return rows


def inside(name: str, sample: Sample) -> list[dict]:
    """Error of the ink's BSDF inside the plate, component by component."""
    true, found = (jaxink.ink_table(one, options=_TABLE) for one in (true_sample(name), sample))
    return [
        dataclasses.asdict(TableComparison(true, found).of(component, w))
        for component in ("R_II", "T_IA", "T_AI", "R_AA")
        for w in range(len(true.wavelength_nm))
    ]


def loss_at(one: Problem, sample: Sample) -> float:
    """What is minimised, RMSD or chi-square, at the values of a sample."""
    values = sample.parameters.values_with({})
    with computing():
        objective = one.objective()
        known = {name: values[name] for name in objective.free}
        objective = one.objective(objective.resolution_at(known, DEFAULT_ACCURACY, "fastest"))
        unit = objective.scale.to_unit(np.array(list(known.values())))
        loss = compile_objective(objective).residual(unit).loss
    return loss if one.kind == "chi_square" else loss**0.5
