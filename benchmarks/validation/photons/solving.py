"""jaxink's answer for a sample of the Monte Carlo, and both beside each other."""

import numpy as np

import jaxink
from benchmarks import montecarlo
from benchmarks.montecarlo import Detectors, Facets, Layer, Result, Sample
from jaxink.optics.phase_function import PhaseFunction
from jaxink.particles.phase_function import HenyeyGreenstein, TwoTermHenyeyGreenstein
from jaxink.surfaces.slopes import slope_density

INCIDENCES_DEG = (20.0, 60.0)
THETA_DEG, PHI_DEG = (5.0, 25.0, 45.0, 65.0, 85.0), (0.0, 110.0, 180.0)


def stack_of(sample: Sample) -> jaxink.Stack:
    """The same sample for the solver."""
    layers = [_layer_of(layer) for layer in sample.layers]
    slopes = [_slopes_of(sample.rough(face)) for face in range(len(layers) + 1)]
    slopes = tuple(slopes) if any(density is not None for density in slopes) else ()
    return jaxink.Stack(tuple(layers), sample.index_front, sample.index_back, faces=slopes)


def _slopes_of(face: Facets | None):
    return None if face is None else slope_density(face.kind, np.rad2deg(np.arctan(face.scale)))


def _layer_of(layer: Layer):
    extinction = layer.scattering_per_mm + layer.absorption_per_mm
    thickness = min(extinction * layer.thickness_mm, jaxink.optics.layers.OPAQUE_OPTICAL_THICKNESS)
    if layer.phase is None:
        return jaxink.ClearLayer(layer.index, thickness)
    return jaxink.ScatteringLayer(
        layer.index, thickness, layer.scattering_per_mm / extinction, _phase_of(layer.phase)
    )


def _phase_of(phase: montecarlo.HenyeyGreenstein) -> PhaseFunction:
    if len(phase.asymmetries) == 1:
        return HenyeyGreenstein(phase.asymmetries[0])
    return TwoTermHenyeyGreenstein(*phase.asymmetries, phase.shares[1])


def directions(opaque: bool) -> Detectors:
    """Polar angles and azimuths, on both sides unless nothing is transmitted."""
    sides = (False,) if opaque else (False, True)
    grid = np.meshgrid(THETA_DEG, PHI_DEG, sides, indexing="ij")
    return Detectors(*(axis.ravel() for axis in grid))


def solve(sample: Sample, seen: Detectors) -> tuple[np.ndarray, np.ndarray]:
    """BSDF (incidences, directions) and powers (incidences, 5) by jaxink, one program for all incidences."""
    stack = stack_of(sample)
    n, n_seen = len(INCIDENCES_DEG), len(seen.theta_deg)
    columns = [np.tile(c, n) for c in (seen.theta_deg, seen.phi_deg, seen.is_transmission)]
    points = jaxink.Directions.from_degrees(np.repeat(INCIDENCES_DEG, n_seen), *columns)
    sines = np.sin(np.deg2rad(INCIDENCES_DEG))
    all_r, all_t = (np.asarray(x) for x in jaxink.hemispherical_power(stack, sines))
    regular_r, regular_t = (np.asarray(x) for x in jaxink.regular_power(stack, sines))
    powers = np.stack([regular_r, regular_t, all_r - regular_r, all_t - regular_t, 1 - all_r - all_t], axis=1)
    return np.asarray(jaxink.diffuse_bsdf(stack, points)).reshape(n, n_seen), powers


POWERS = ("R_regular", "T_regular", "R_diffuse", "T_diffuse", "absorbed")


def compare(result: Result, seen: Detectors, solved, powers) -> tuple[list[str], list[str], np.ndarray]:
    """Cells of the BSDF and of the totals of one incidence, and the deviations in standard errors."""
    value, error = Result.mean_and_error(result.bsdf)
    deviations = (value - solved) / error
    ratios = []
    for side in (~seen.is_transmission, seen.is_transmission):
        ratio = (result.bsdf[side] / solved[side, None]).mean(0) if side.any() else None
        ratios.append("" if ratio is None else with_error(*Result.mean_and_error(ratio), 4))
    cells = [
        str(value.size),
        f"{np.mean(error / value):.1e}",
        f"{np.mean(deviations**2):.2f}",
        f"{np.max(np.abs(deviations)):.1f}",
        *ratios,
    ]
    totals = [
        f"{solved_power:.4f} : {with_error(*Result.mean_and_error(_power(result, name)), 4)}"
        for name, solved_power in zip(POWERS, powers, strict=True)
    ]
    return cells, totals, deviations


def _power(result: Result, name: str) -> np.ndarray:
    """Batches of a power; what only facets have turned is diffuse for the solver."""
    side, _, kind = name.partition("_")
    only_facets = result.powers[f"{side}_surface"] if kind == "diffuse" else 0.0
    return result.powers[name] + only_facets


def kind_row(kind: str, cases: list[tuple[np.ndarray, np.ndarray]]) -> list[str]:
    """Row of all cases of a kind: deviations in standard errors, and relative where those are largest."""
    deviations, ratios = (np.concatenate(part) for part in zip(*cases, strict=True))
    worst = np.argmax(np.abs(deviations))
    return [
        kind,
        str(deviations.size),
        f"{np.mean(deviations**2):.2f}",
        f"{np.abs(deviations[worst]):.1f}",
        f"{100 * (ratios[worst] - 1):+.1f} %",
    ]


def with_error(value: float, error: float, digits: int) -> str:
    """Value and standard error."""
    return f"{value:.{digits}f} ± {error:.{digits}f}"
