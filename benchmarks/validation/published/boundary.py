"""The last step of 2018: the relief as the BSDF of a boundary between two clear media, joined to the volume.

The outer face of sample 2 is taken from its ink, tabulated between binder and air, and put back on the smooth
layer by the star product of `joined`. The whole is the layer with its relief in jaxink's stack, and the same
in the Monte Carlo, which follows light from facet to facet.

python -m benchmarks.validation.published.boundary
"""

import dataclasses
import json
import time
from collections.abc import Callable

import numpy as np

import jaxink
from benchmarks.montecarlo import Detectors, Layer, Result, Sample, simulate
from benchmarks.simulated_data import truth_of
from benchmarks.validation.photons.cases import PLATE, facets
from benchmarks.validation.photons.simulated import simulated_phase
from benchmarks.validation.published.fits import KEPT
from benchmarks.validation.published.joined import (
    Channels,
    Element,
    Last,
    Operator,
    series,
    smooth_face,
    summed,
)
from benchmarks.validation.published.judgement import true_sample
from benchmarks.validation.published.problems import ROUGH
from jaxink.ink.boundary import BoundaryOptions, facet_boundary
from jaxink.ink.hemispherical_totals import power_sent_out
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.numerics.precision import computing
from jaxink.sample import parse_sample
from jaxink.surfaces.slopes import slope_density

FILE = KEPT / f"{ROUGH}-boundary.json"
INCIDENCES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0)
SIGNED_DEG = np.arange(-75.0, 75.1, 2.5)
AZIMUTH_RAD = np.where(SIGNED_DEG < 0, np.pi, 0.0)
WAVELENGTH_NM, BINDER, AIR = 550.0, 1.5, 1.0
# What stands at the outer face.
WHOLE, SMOOTH, SMOOTH_STACK = "relief in the stack", "smooth face", "smooth face in the stack"
BOUNDARY = "table of `jaxink boundary`"
ENTRIES, LOBES = "ink table of an empty ink, interpolated", "ink table of an empty ink, lobes apart"
# The Monte Carlo: every second view, and some incidences.
PHOTONS_DEG, N_PHOTONS, SEED = (0.0, 30.0, 60.0), 160_000, 2018
# Azimuths from 0 to 180 degrees of the volume and of the boundary, and orders kept of the latter.
_N_PHI_VOLUME, _N_PHI_LOBES, _LOBE_ORDERS = 37, 121, 48
_N_CHUNKS = 8
_PLATE = f"""[[layers]]
name = "plate"
kind = "clear"
refractive_index = {BINDER}
thickness_mm = 1.0"""
# The table's power is looked at up to this incidence.
_LARGEST_THETA_DEG = 80.0
_EXACT = np.unique(np.sin(np.deg2rad(np.concatenate([INCIDENCES_DEG, np.abs(SIGNED_DEG)]))).round(12))
CHANNELS = Channels((AIR, BINDER), _EXACT, n_parts=3)


def _ink(behind: float, *, rough: bool = False, empty: bool = False, plate: bool = False) -> jaxink.Sample:
    """The layer alone, its own binder in front of it, or its plate; empty, it is only its back face."""
    values = true_sample(f"{ROUGH}-mie").parameters.values_with({})
    ink = {key.removeprefix("ink."): float(value) for key, value in values.items()}
    sigma = ink["back_roughness.sigma_deg"]
    return parse_sample(f"""schema_version = 1
wavelength_nm = {WAVELENGTH_NM}
[surroundings]
index_front = {AIR if plate else BINDER}
index_back = {behind}
{_PLATE if plate else ""}
[[layers]]
name = "ink"
kind = "scattering"
refractive_index = {BINDER}
phase_function = "mie"
thickness_um = {ink["thickness_um"]}
radius_nm = {ink["radius_nm"]}
volume_fraction = {0 if empty else ink["volume_fraction"]}
particle_index = {ink["particle_index"]}
particle_absorption_index = {ink["particle_absorption_index"]}
{f'back_roughness = {{ density = "cauchy", sigma_deg = {sigma} }}' if rough else ""}
""")


def table(boundary: str) -> jaxink.InkTable:
    """The relief between binder and air: that of `jaxink boundary`, or the ink table of an empty ink."""
    if boundary == BOUNDARY:
        (sigma,) = (p for p in true_sample(f"{ROUGH}-mie").parameters.values() if "sigma_deg" in p.name)
        options = BoundaryOptions(BINDER, AIR)
        return facet_boundary(slope_density("cauchy", sigma.value), [WAVELENGTH_NM], options)
    options = jaxink.TableOptions(inside="front")
    whole = jaxink.ink_table(_ink(AIR, rough=True, empty=True), options=options)
    return whole if boundary == LOBES else dataclasses.replace(whole, lobes=None)


def volume() -> Element:
    """The layer without its relief between half-spaces of its binder, by the solver."""
    sample, kappa = _ink(BINDER), CHANNELS.kappa
    theta, phi = np.rad2deg(np.arcsin(kappa / BINDER)), np.linspace(180.0, 0.0, _N_PHI_VOLUME)
    axes = np.meshgrid([False, True], phi, theta, theta, indexing="ij")
    far, phi, out, into = (column.ravel() for column in axes)
    model = ForwardModel(sample, into, out, phi, np.full(out.size, WAVELENGTH_NM), far)
    bsdf = evaluate(model).reshape(2, _N_PHI_VOLUME, len(kappa), len(kappa)) / BINDER**2
    with computing():
        stack = model.builder.stack(sample.parameters.values_with({}), WAVELENGTH_NM)
        _, straight = (np.asarray(power) for power in jaxink.regular_power(stack, kappa / BINDER))
    back = Operator(series(bsdf[0]), np.zeros_like(kappa), CHANNELS.weight)
    through = Operator(series(bsdf[1]), straight, CHANNELS.weight)
    return Element(back, through, back, through)


def of_table(found: jaxink.InkTable) -> Last:
    """A table of the boundary, lit from the binder."""
    kappa, share = CHANNELS.parts
    phi = np.linspace(180.0, 0.0, _N_PHI_LOBES)[:, None, None]
    n_exact = len(CHANNELS.exact)
    into = np.rad2deg(np.arcsin(kappa / BINDER))

    def operator(name: str, leaving: float) -> Operator:
        out = np.rad2deg(np.arcsin(np.minimum(kappa / leaving, 1.0)))[:, None]
        parts = [
            share @ np.where(kappa[:, None] < leaving, found.interpolated(name, into, out, some), 0) @ share.T
            for some in np.array_split(phi, _N_CHUNKS)
        ]
        values = np.concatenate(parts) / leaving**2
        # What the boundary sends straight from one direction to another is added in `bsdf`.
        values[:, -n_exact:, -n_exact:] = 0.0
        return Operator(series(values)[:_LOBE_ORDERS], np.zeros(len(share)), CHANNELS.weight)

    return Last(operator("R_II", BINDER), operator("T_IA", AIR))


def bsdf(covered: Element, boundary: Last, of_boundary: jaxink.InkTable | None) -> np.ndarray:
    """BSDF of plate, layer and boundary lit through the plate, shape ``(sides, incidences, angles)``.

    Parameters
    ----------
    covered
        Plate and layer.
    boundary
        What is below them.
    of_boundary
        Its table, for light that meets nothing else; None if it has none.
    """
    whole, kappa = covered.lit_on(boundary), CHANNELS.kappa
    seen = _positions(np.abs(SIGNED_DEG))
    found = np.zeros((2, len(INCIDENCES_DEG), len(SIGNED_DEG)))
    for n, into in enumerate(_positions(INCIDENCES_DEG)):
        for side, operator in enumerate((whole.above, whole.down)):
            found[side, n] = summed(operator.kernel[:, seen, into], AZIMUTH_RAD)
        if of_boundary is not None:
            arriving, within = covered.down.regular[into], np.rad2deg(np.arcsin(kappa / BINDER))
            phi = np.rad2deg(np.pi - AZIMUTH_RAD)
            back = of_boundary.interpolated("R_II", within[into], within[seen], phi) / BINDER**2
            through = of_boundary.interpolated("T_IA", within[into], np.abs(SIGNED_DEG), phi)
            found[:, n] += np.stack([covered.up.regular[seen] * back, through]) * arriving
    return found


def _positions(theta_deg) -> np.ndarray:
    """Channels of exact directions in air."""
    first = len(CHANNELS.kappa) - len(_EXACT)
    return first + np.searchsorted(_EXACT, np.sin(np.deg2rad(theta_deg)).round(12))


def of_stack(rough: bool) -> np.ndarray:
    """BSDF of the whole sample at the same directions, by jaxink's solver."""
    sample = _ink(AIR, rough=rough, plate=True)
    far, into, signed = np.meshgrid([False, True], INCIDENCES_DEG, SIGNED_DEG, indexing="ij")
    phi, wavelength = np.where(signed < 0, 0.0, 180.0), np.full(far.shape, WAVELENGTH_NM)
    columns = (c.ravel() for c in (into, np.abs(signed), phi, wavelength, far))
    return evaluate(ForwardModel(sample, *columns)).reshape(far.shape)


def by_photons() -> dict[str, list]:
    """BSDF and standard error by the Monte Carlo, ``(sides, incidences, angles)`` of every second view."""
    truth = truth_of(ROUGH)
    ink, optics = truth["ink"], truth["optics"][0]
    phase = simulated_phase(ink, WAVELENGTH_NM)
    layer = Layer(ink["n"], ink["d_mm"], optics["mus"], optics["mua"], phase)
    sample = Sample((PLATE, layer), faces=(None, None, facets(*truth["roughness"]["ink_air"])))
    far, signed = (a.ravel() for a in np.meshgrid([False, True], SIGNED_DEG[::2], indexing="ij"))
    seen = Detectors(np.abs(signed), np.where(signed < 0, 0.0, 180.0), far)
    found = [
        Result.mean_and_error(simulate(sample, theta, N_PHOTONS, SEED + int(theta), seen).bsdf)
        for theta in PHOTONS_DEG
    ]
    both = np.array(found).reshape(len(PHOTONS_DEG), 2, 2, -1)
    return {"bsdf": both[:, 0].swapaxes(0, 1).tolist(), "error": both[:, 1].swapaxes(0, 1).tolist()}


def make() -> dict:
    """BSDFs with everything at the outer face, kept as they are made, with the seconds of processor time."""
    found = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}

    def keep(name: str, compute: Callable[[], dict]) -> None:
        if name in found:
            return
        began = time.process_time()
        found[name] = compute() | {"seconds": round(time.process_time() - began, 1)}
        FILE.write_text(json.dumps(_short(found)) + "\n", encoding="utf-8")

    keep("photons", by_photons)
    keep(WHOLE, lambda: {"bsdf": of_stack(True).tolist()})
    keep(SMOOTH_STACK, lambda: {"bsdf": of_stack(False).tolist()})
    if {SMOOTH, BOUNDARY, ENTRIES, LOBES} - found.keys():
        covered = smooth_face(CHANNELS, AIR, BINDER).on(volume())
        keep(SMOOTH, lambda: {"bsdf": bsdf(covered, smooth_face(CHANNELS, BINDER, AIR), None).tolist()})
        for name in (BOUNDARY, ENTRIES, LOBES):
            keep(name, lambda name=name: _with_table(covered, table(name)))
    return found


def _with_table(covered: Element, of_boundary: jaxink.InkTable) -> dict:
    away = of_boundary.theta_deg <= _LARGEST_THETA_DEG
    power = power_sent_out(of_boundary)[0, 0, away]
    return {
        "bsdf": bsdf(covered, of_table(of_boundary), of_boundary).tolist(),
        "angles": len(of_boundary.theta_deg),
        "power": [float(power.min()), float(power.max())],
    }


def _short(value):
    """Numbers with five digits."""
    if isinstance(value, dict):
        return {key: _short(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_short(inner) for inner in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


if __name__ == "__main__":
    make()
