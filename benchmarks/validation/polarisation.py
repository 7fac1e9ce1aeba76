"""What the scalar solver leaves out: all orders by Monte Carlo, and two orders as jaxink computes them.

python -m benchmarks.validation.polarisation [PHOTONS]    (default 200000; without new cases, the page only)

The Monte Carlo carries the polarisation of each photon beside its scalar weight, shares no code with jaxink,
and takes the amplitudes of the spheres from miepython. Writes docs/validation/polarisation.md.
"""

import json
import sys
from pathlib import Path

import numpy as np

from benchmarks.montecarlo.polarised import N_BATCHES, PolarisedLayer, Spheres, rayleigh, simulate
from benchmarks.pages import rms, table, write_page

KEPT = Path(__file__).with_suffix(".json")
WAVELENGTH_NM, BINDER, THETA_I_DEG = 550.0, 1.5, 30.0
SIGNED_DEG = np.array([-75.0, -60.0, -40.0, -20.0, -5.0, 15.0, 25.0, 40.0, 60.0, 75.0])
# In the plane of incidence, and perpendicular to it.
ACROSS_DEG = np.array([5.0, 20.0, 40.0, 60.0, 75.0])
THETA_O = np.tile([*np.abs(SIGNED_DEG), *ACROSS_DEG], 2)
PHI = np.tile([*np.where(SIGNED_DEG > 0, 180.0, 0.0), *np.full(ACROSS_DEG.size, 90.0)], 2)
IS_TRANSMISSION = np.arange(THETA_O.size) >= THETA_O.size // 2
# Radius in nm, index of the spheres, and the variance of the logarithm of the radius by volume.
INKS = {
    "white, 150 nm": (150.0, 2.7, 0.05),
    "white, 300 nm": (300.0, 2.7, 0.05),
    "white, 300 nm, equal spheres": (300.0, 2.7, 0.0),
}
CASES = [
    *(("Rayleigh", 1.0, thickness) for thickness in (0.1, 1.0, 3.0)),
    ("Rayleigh", BINDER, 1.0),
    *((name, BINDER, 1.0) for name in INKS),
    ("white, 150 nm", BINDER, 3.0),
]


def sizes(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Radii in nm and their shares of the volume: one, or 15 within three standard deviations."""
    radius, _, variance = INKS[name]
    deviation = np.linspace(-3, 3, 15) if variance else np.zeros(1)
    share = np.exp(-(deviation**2) / 2)
    return radius * np.exp(variance**0.5 * deviation), share / share.sum()


def spheres(name: str) -> Spheres:
    """Amplitudes by miepython."""
    if name == "Rayleigh":
        return rayleigh()
    import miepython

    index, cosines = INKS[name][1] / BINDER, np.cos(np.linspace(0, np.pi, 4001))
    radii, volume = sizes(name)
    x = 2 * np.pi * BINDER * radii / WAVELENGTH_NM
    amplitudes = [miepython.S1_S2(index, one, cosines, norm="4pi") for one in x]
    efficiency = np.array([miepython.efficiencies_mx(index, one)[1] for one in x])
    share = volume * efficiency / radii
    perpendicular, parallel = (np.array(part) for part in zip(*amplitudes, strict=True))
    return Spheres(perpendicular, parallel, share / share.sum())


def two_orders_of(name: str, index: float, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Vector minus scalar BSDF by jaxink, light scattered once and twice: with many nodes, and as it is."""
    import jax

    jax.config.update("jax_enable_x64", True)
    from jaxink.optics.directions import Directions
    from jaxink.optics.layers import ScatteringLayer
    from jaxink.particles.mixture import SpherePopulation, mixture_coefficients, mixture_matrix
    from jaxink.particles.phase_function import Rayleigh
    from jaxink.particles.size_distribution import SizeDistribution
    from jaxink.solver.stack import Stack
    from jaxink.solver.two_orders import two_orders

    if name == "Rayleigh":
        phase_function, matrix = Rayleigh(), Rayleigh().matrix()
    else:
        radii, volume = map(jax.numpy.asarray, sizes(name))
        each = SizeDistribution(radii, volume, radii[0], np.zeros(radii.size, bool))
        one = (SpherePopulation(each, INKS[name][1], 0.1),)
        largest = float(2 * np.pi * BINDER * radii[-1] / WAVELENGTH_NM) + 1
        phase_function = mixture_coefficients(one, BINDER, WAVELENGTH_NM, None, largest).phase_function
        matrix = mixture_matrix(one, BINDER, WAVELENGTH_NM, largest)
    stack = Stack((ScatteringLayer(index, thickness, 1.0, phase_function),), 1.0, 1.0)
    there = Directions.from_degrees(np.full(THETA_O.size, THETA_I_DEG), THETA_O, PHI, IS_TRANSMISSION)
    both = (two_orders(stack, 0, matrix, there, *nodes) for nodes in ((32, 64), ()))
    return tuple(np.asarray(jax.numpy.sum(vector - scalar, axis=0)) for vector, scalar in both)


def compared(case, n_photons: int) -> dict:
    """Both for one case."""
    name, index, thickness = case
    layer = PolarisedLayer(thickness, 1.0, index, spheres(name))
    found = simulate(layer, THETA_I_DEG, (THETA_O, PHI, IS_TRANSMISSION), n_photons, 20261125)
    vector, scalar = (part[2] for part in found)
    direct_vector, direct_scalar = (part[:2].sum(axis=0) for part in found)

    def mean_and_error(batches):
        return [batches.mean(-1).tolist(), (batches.std(-1, ddof=1) / N_BATCHES**0.5).tolist()]

    return {
        "bsdf": scalar.mean(-1).tolist(),
        "excess": mean_and_error(vector - scalar),
        "two_orders": mean_and_error(direct_vector - direct_scalar),
        "photons": n_photons,
    }


def row(case, kept: dict) -> list[str]:
    """One row of the page."""
    name, index, thickness = case
    bsdf, (exact, two) = np.array(kept["bsdf"]), two_orders_of(*case)
    excess, error = map(np.array, kept["excess"])
    seen, seen_error = map(np.array, kept["two_orders"])
    cells = [name, f"{index:g}", f"{thickness:g}"]
    for side in (~IS_TRANSMISSION, IS_TRANSMISSION):
        relative, noise = excess[side] / bsdf[side], rms(error[side] / bsdf[side])
        cells += [f"{100 * rms(relative):.2f} ({100 * noise:.2f})", f"{100 * np.max(np.abs(relative)):.1f}"]
        cells.append(f"{100 * rms(two[side] / bsdf[side]):.2f}")
    share = two @ excess / (two @ two)
    left = excess / bsdf - share * two / bsdf
    cells += [f"{share:.2f}", f"{100 * rms(left):.2f}"]
    cells += [f"{kept['photons'] / 1e6:g}"]
    cells.append(f"{rms((exact - seen) / np.maximum(seen_error, 1e-12)):.1f}")
    return cells


def main() -> None:
    """Compute what is missing, and write the page."""
    n_photons = int(sys.argv[1]) if len(sys.argv) > 1 else 200_000
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    missing = [case for case in CASES if " ".join(map(str, case)) not in kept]
    for case in missing:
        kept[" ".join(map(str, case))] = compared(case, n_photons)
        KEPT.write_text(json.dumps(kept) + "\n", encoding="utf-8")
        print(case, flush=True)
    header = ["scatterers", "n", "thickness", "R: rms % (noise)", "largest %", "two orders: rms %"]
    header += [
        "T: rms % (noise)",
        "largest %",
        "two orders: rms %",
        "share",
        "left: rms %",
        "10^6 photons",
        "s.e.",
    ]
    rows = [row(case, kept[" ".join(map(str, case))]) for case in CASES]
    text = Path(__file__).with_name("polarisation.md.in").read_text(encoding="utf-8")
    write_page("polarisation.md", text.format(table=table(header, rows)))


if __name__ == "__main__":
    main()
