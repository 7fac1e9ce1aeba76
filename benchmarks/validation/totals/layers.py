"""Layers and rows of samples that were measured as totals."""

import csv
from dataclasses import replace

import jaxink
from benchmarks.pages import data_folder
from jaxink.particles.phase_function import HenyeyGreenstein


def rows_of(folder: str, file: str) -> list[dict]:
    """Rows of a CSV file of a measured data set."""
    with open(data_folder("measured") / folder / file, encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def ink(index, reduced_per_mm, absorption_per_mm, asymmetry, thickness_mm) -> jaxink.ScatteringLayer:
    """A Henyey-Greenstein layer by its reduced scattering."""
    scattering = reduced_per_mm / (1 - asymmetry)
    extinction = scattering + absorption_per_mm
    phase = HenyeyGreenstein(asymmetry)
    return jaxink.ScatteringLayer(index, extinction * thickness_mm, scattering / extinction, phase)


def sizes_for_power(stack: jaxink.Stack) -> jaxink.SolverConfig:
    """Sizes for totals, which need the azimuthal mean only."""
    return replace(jaxink.choose_sizes(stack, 1e-5), n_orders=1)


def refusal(folder: str, file: str, sample: str | None = None) -> str:
    """What `jaxink diagnose` tells a user who gives it such a file."""
    path = data_folder("measured") / folder / file
    try:
        jaxink.read(path, sample=sample)
    except jaxink.InputRefusedError as error:
        return str(error).replace(str(path), path.name)
    raise SystemExit(f"{path.name} was read as a BSDF; this page has to be rewritten.")
