"""Fits of noise draws whose noise nobody states: chi-square, probabilities and coverage of standard errors.

python -m benchmarks.validation.noise.coverage [NUMBER OF DRAWS]
"""

import json
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

import jaxink
from jaxink.data import SIMULATED_TRUTH, simulated_example
from jaxink.fitting.uncertainty import covariance
from jaxink.measurement import GonioData, noise_of
from jaxink.numerics.chi_square import residual_above
from jaxink.residual.points import ResidualPoints
from jaxink.sample import Noise

RESULTS = Path(__file__).with_name("coverage.json")
CONFIG = jaxink.SolverConfig(nodes_escaping=6, nodes_trapped=4, n_moments=12, n_orders=3)
RELATIVE, OF_SCANS = 0.005, 0.003
SAMPLE = jaxink.load_sample(simulated_example()[1]).replace(SIMULATED_TRUTH)


class Design(NamedTuple):
    """A measurement whose noise is drawn.

    Parameters
    ----------
    azimuths_deg
        Azimuths of the exit directions from 0 to 180, measured on both sides.
    step_deg
        Step of the polar angle.
    scan_relative
        Relative standard deviation of a factor of each scan.
    is_stated
        Whether the noise is stated, for comparison.
    """

    azimuths_deg: tuple[float, ...]
    step_deg: float
    scan_relative: float
    is_stated: bool


PLACES = {"in plane": ((0.0,), 2.5), "hemisphere": ((0.0, 30.0, 60.0, 90.0, 120.0, 150.0), 5.0)}
DESIGNS = {
    f"{place}, scan factors {scans:.1%}, {'stated' if stated else 'not stated'}": Design(
        *PLACES[place], scans, stated
    )
    for place in PLACES
    for scans in (0.0, OF_SCANS)
    for stated in (False, True)
}


def exact_measurement(design: Design) -> GonioData:
    """The measurement without noise."""
    polar = np.arange(-80.0, 80.0 + 1e-9, design.step_deg)
    incidence = (0.0, 15.0, 30.0, 45.0, 60.0)
    t_i, passes, phi, t_o = (
        x.ravel() for x in np.meshgrid(incidence, (False, True), design.azimuths_deg, polar, indexing="ij")
    )
    # The lamp hides the detector.
    seen = passes | (np.abs(t_o - t_i) > 4) | (phi != 0)
    # Each direction once: along the normal, all planes meet.
    seen &= (t_o != 0) | (phi == 0)
    t_i, passes, phi, t_o = t_i[seen], passes[seen], phi[seen], t_o[seen]
    data = GonioData(
        t_i,
        np.abs(t_o),
        np.where(t_o < 0, phi - 180, phi) + np.where((t_o < 0) & (phi == 0), 360, 0),
        np.full(t_i.size, 550.0),
        passes,
        np.ones(t_i.size),
    )
    return data.replace(bsdf_per_sr=jaxink.predict(SAMPLE, data, CONFIG))


def relative_slopes(exact: GonioData) -> np.ndarray:
    """Slopes of the logarithm of the BSDF by each parameter of `SIMULATED_TRUTH`."""
    columns = []
    for name, truth in SIMULATED_TRUTH.items():
        step = 1e-4 * truth
        ends = (SAMPLE.replace({name: truth + sign * step}) for sign in (1, -1))
        above, below = (jaxink.predict(end, exact, CONFIG) for end in ends)
        columns.append((above - below) / (2 * step) / exact.bsdf_per_sr)
    return np.stack(columns, axis=1)


def fits_of(design: Design, n_draws: int) -> list[dict[str, float]]:
    """What fits of so many draws say; the noise is small enough for the model to be linear."""
    exact = exact_measurement(design)
    slopes, declared = relative_slopes(exact), Noise(use_file_sigma=False)
    if design.is_stated:
        declared = Noise(relative=RELATIVE, scan_relative=design.scan_relative, use_file_sigma=False)
    rows = []
    for seed in range(n_draws):
        random = np.random.default_rng(seed)
        factor = (1 + design.scan_relative * random.normal(size=len(exact.scans)))[exact.scan_index]
        factor = factor * (1 + RELATIVE * random.normal(size=factor.size))
        data = exact.replace(bsdf_per_sr=exact.bsdf_per_sr * factor)
        noise = noise_of(data, declared)
        ones = np.ones(factor.size)
        points = ResidualPoints.of(
            data, exact.bsdf_per_sr, noise.sigma_per_sr, noise.scan_relative, ones, ones
        )
        jacobian, residual = points.whiten(slopes), points.whiten(points.relative[:, None])[:, 0]
        found, *_ = np.linalg.lstsq(jacobian, residual, rcond=None)
        square, freedom = np.sum((residual - jacobian @ found) ** 2), residual.size - found.size
        unit = covariance(np.linalg.qr(jacobian, mode="r"), np.full(found.size, 0.5), np.zeros(found.size))
        pulls = found / unit.for_noise_of(noise.degrees_of_freedom).deviation
        row = {
            "reduced": square / freedom,
            "probability": residual_above(square, freedom, noise.degrees_of_freedom),
            "scan_relative": noise.scan_relative,
            **dict(zip(SIMULATED_TRUTH, pulls, strict=True)),
        }
        if noise.level is not None:
            row |= {"relative": noise.level.relative, "freedom": noise.level.degrees_of_freedom}
        rows.append(row)
    return rows


def summary_of(rows: list[dict[str, float]]) -> dict[str, float]:
    """Means and shares over all draws."""
    column = {key: np.array([row[key] for row in rows], float) for key in rows[0]}
    found = {
        "draws": len(rows),
        "reduced_mean": column["reduced"].mean(),
        "reduced_std": column["reduced"].std(),
    }
    for limit in (0.001, 0.01, 0.05, 0.5, 0.95):
        found[f"probability_below_{limit}"] = np.mean(column["probability"] < limit)
    for name in SIMULATED_TRUTH:
        for sigmas in (1, 2):
            found[f"{name}_within_{sigmas}"] = np.mean(np.abs(column[name]) < sigmas)
    for name in ("relative", "freedom", "scan_relative"):
        if name in column:
            found[f"{name}_median"], found[f"{name}_std"] = np.median(column[name]), column[name].std()
    return {key: float(f"{value:.4g}") for key, value in found.items()}


def main(n_draws: int) -> None:
    """Fit all draws of all designs, and keep what they say."""
    kept = {}
    for name, design in DESIGNS.items():
        kept[name] = summary_of(fits_of(design, n_draws))
        print(name, json.dumps(kept[name], indent=1), flush=True)
        RESULTS.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
