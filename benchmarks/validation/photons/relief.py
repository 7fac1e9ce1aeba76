"""Compare the relief of an opaque body with a Monte Carlo of a corrugated one; a part of relief.md.

python -m benchmarks.validation.photons.relief [--photons N]
"""

import argparse
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

import jaxink
from benchmarks.montecarlo import HenyeyGreenstein, Result
from benchmarks.montecarlo.relief import Body, reflected
from benchmarks.pages import filled, rms, table, write_section
from benchmarks.validation.photons.solving import with_error

KEPT = Path(__file__).with_name("relief.json")
MARK = "made by python -m benchmarks.validation.photons.relief"
ASYMMETRY = 0.5
# Directions within a bin, along each of its sides.
_N_NODES = 4
RING_EDGES = (0, 20, 35, 50, 60, 70, 80), (0, 30, 90, 150, 180)
INCIDENCES_DEG = (0.0, 60.0)
# Variance of slopes, correlation length in distances between two scatterings, index, albedo.
CASES = (
    (0.01, 200.0, 1.0, 0.99),
    (0.05, 200.0, 1.0, 0.99),
    (0.2, 200.0, 1.0, 0.99),
    (0.05, 200.0, 1.0, 0.8),
    (0.05, 200.0, 1.4, 0.99),
    (0.05, 40.0, 1.0, 0.99),
    (0.05, 10.0, 1.0, 0.99),
    (0.05, 2.0, 1.0, 0.99),
    (0.05, 0.4, 1.0, 0.99),
    (0.05, 10.0, 1.4, 0.99),
    (0.05, 0.4, 1.4, 0.99),
)
_SAMPLE = """
schema_version = 1
wavelength_nm = 550

[[layers]]
name = "body"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = {index}
thickness_um = "opaque"
single_scattering_albedo = {albedo}
asymmetry_parameter = {asymmetry}
"""
_ROUGH = '\n[layers.front_roughness]\ndensity = "beckmann"\nsigma_deg = {sigma_deg}\n'
_RELIEF = "\n[effects.relief]\nslope_variance = {{ free = true, value = {variance}, min = 0.0, max = 0.5 }}\n"
_MODELS = {"plane": "the plane body", "rough": "a rough face", "relief": "`relief`"}


def sample_text(
    albedo: float,
    index: float = 1.0,
    slope_variance: float | None = None,
    rough_variance: float | None = None,
) -> str:
    """Sample file of the body, with a relief, with a rough face, or plane."""
    text = _SAMPLE.format(index=index, albedo=albedo, asymmetry=ASYMMETRY)
    if rough_variance is not None:
        text += _ROUGH.format(sigma_deg=np.rad2deg(np.arctan(np.sqrt(rough_variance))))
    return text if slope_variance is None else text + _RELIEF.format(variance=slope_variance)


def solved(text: str, theta_deg: float, ring_edges=RING_EDGES) -> np.ndarray:
    """BSDF of a sample file averaged over bins by jaxink, in 1/sr."""
    nodes, weights = np.polynomial.legendre.leggauss(_N_NODES)
    polar, from_specular = (_within(edges, nodes, weights) for edges in ring_edges)
    directions = polar.places[:, None], 180 - from_specular.places
    sample = jaxink.parse_sample(text)
    found = jaxink.predict_at(sample, theta_deg, *directions, accuracy=1e-3).bsdf_per_sr
    # By area across the direction, sin(theta) cos(theta).
    share = polar.shares * np.sin(2 * np.deg2rad(polar.places))
    area = share[:, None] * from_specular.shares
    return _by_bin(np.asarray(found).reshape(area.shape) * area) / _by_bin(area)


class _Nodes(NamedTuple):
    places: np.ndarray
    shares: np.ndarray


def _within(edges, nodes, weights) -> _Nodes:
    """Nodes of all bins between some edges."""
    start, width = np.array(edges[:-1], float)[:, None], np.diff(edges)[:, None]
    return _Nodes((start + width * (nodes + 1) / 2).ravel(), (width * weights).ravel())


def _by_bin(values):
    rows, columns = values.shape
    return values.reshape(rows // _N_NODES, _N_NODES, columns // _N_NODES, _N_NODES).sum((1, 3))


def compared(case, theta_deg: float, n_photons: int, seed: int) -> dict:
    """The Monte Carlo of one case and incidence beside jaxink, with relief and without."""
    variance, correlation_length, index, albedo = case
    body = Body(HenyeyGreenstein(ASYMMETRY), albedo, variance, correlation_length, index)
    rings, power = reflected(body, theta_deg, n_photons, RING_EDGES, seed)
    value, error = Result.mean_and_error(rings)
    with_relief = solved(sample_text(albedo, index, slope_variance=variance), theta_deg)
    models = {"plane": sample_text(albedo, index)}
    if index > 1:
        models["rough"] = sample_text(albedo, index, rough_variance=variance)
    deviation = value / with_relief - 1
    worst = np.unravel_index(np.argmax(np.abs(deviation)), deviation.shape)
    return {
        "case": case,
        "theta_deg": theta_deg,
        "photons": n_photons,
        "power": list(map(float, Result.mean_and_error(power))),
        "error": rms(error / value),
        "relief": rms(deviation),
        **{name: rms(value / solved(text, theta_deg) - 1) for name, text in models.items()},
        "largest": float(deviation[worst]),
        "largest_at": [
            [float(e) for e in edges[k : k + 2]] for edges, k in zip(RING_EDGES, worst, strict=True)
        ],
    }


def write(kept: list[dict]) -> None:
    """The part of the page."""
    rows = []
    for one in kept:
        variance, length, index, albedo = one["case"]
        theta, phi = (f"{low:g} to {high:g}" for low, high in one["largest_at"])
        rows.append(
            [
                f"{variance:g}",
                f"{length * (1 - ASYMMETRY):g}",
                f"{index:g}",
                f"{albedo:g}",
                f"{one['theta_deg']:g}",
                with_error(*one["power"], 4),
                *(f"{100 * one[key]:.1f} %" if key in one else "" for key in ("error", *_MODELS)),
                f"{100 * one['largest']:+.1f} % ({theta}; {phi})",
            ]
        )
    header = [
        "slope variance",
        "correlation length, transport lengths",
        "index",
        "albedo",
        "incidence, degrees",
        "power reflected",
        "standard error, rms",
        *(f"from {name}, rms" for name in _MODELS.values()),
        "largest from `relief` (theta; azimuth from specular, degrees)",
    ]
    text = filled(
        Path(__file__).with_name("relief.md.in"),
        photons=f"{kept[0]['photons']:,}".replace(",", " "),
        asymmetry=ASYMMETRY,
        table=table(header, rows),
    )
    write_section("relief.md", MARK, text)


def main() -> None:
    """Run all cases, keep the results and write them."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--photons", type=int, default=1_000_000)
    n_photons = parser.parse_args().photons
    kept = []
    for number, case in enumerate(CASES):
        for theta_deg in INCIDENCES_DEG:
            kept.append(compared(case, theta_deg, n_photons, number))
            print(kept[-1], flush=True)
    KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    write(kept)


if __name__ == "__main__":
    main()
