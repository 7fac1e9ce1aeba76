"""Error of the BSDF against the number of streams, and at the sizes chosen for an accuracy: accuracy.md.

python -m benchmarks.validation.accuracy
"""

from pathlib import Path

import equinox as eqx
import jax
import numpy as np

from benchmarks.pages import filled, section_after, table, write_page
from benchmarks.validation.accuracy.disort_problems import (
    column,
    phase_moments,
    radiances,
    read_problems,
    stack_of,
)
from benchmarks.validation.accuracy.edges import MARK
from jaxink import Directions, ScatteringLayer, SolverConfig, Stack, choose_sizes, diffuse_bsdf
from jaxink.numerics.legendre import legendre_series
from jaxink.numerics.precision import computing
from jaxink.optics.phase_function import PhaseFunction
from jaxink.particles.phase_function import HenyeyGreenstein, TabulatedByMoments

jax.config.update("jax_enable_x64", True)

ASYMMETRIES = (0.0, 0.35, 0.5, 0.7, 0.8, 0.85, 0.9, 0.95)
NODES = (6, 8, 12, 16, 24, 32, 48)
ALBEDO = 0.99
INDICES = {"matched": 1.0, "film": 1.5}
REFERENCE = {"matched": SolverConfig(96, 12, 192, 96), "film": SolverConfig(48, 48, 192, 64)}
CLOUDS, CLOUD_REFERENCE = (1.0, 64.0), SolverConfig(230, 6, 299, 240)
ACCURACIES = (1e-3, 1e-4, 1e-6)
ASKED = [f"asked {accuracy:g}" for accuracy in ACCURACIES]
# Of light, in a problem of DISORT's, below which its share of the beam is not compared.
DARK = 1e-12
THICKNESSES = (0.1, 1.0, 5.0, 40.0)
POLAR, GRAZING = list(np.arange(0.0, 85.1, 5.0)), [87.5, 89.0]
STEEP, GRAZING_INCIDENCE = [0.0, 5.0, 30.0, 60.0, 75.0], 85.0


class SeriesOnly(PhaseFunction):
    """A phase function as delta-M leaves it: single scattering is then as coarse as the rest."""

    whole: PhaseFunction
    n_moments: int = eqx.field(static=True)

    def value(self, scattering_cosine):
        """Truncated series."""
        moments = self.whole.moments(self.n_moments + 1)
        return legendre_series(moments[:-1] - moments[-1], scattering_cosine)

    def moments(self, n_moments):
        """Those of the whole phase function."""
        return self.whole.moments(n_moments)


def directions() -> tuple[Directions, np.ndarray, np.ndarray]:
    """Both sides, five azimuths; which directions enter, and which leave, near grazing."""
    axes = [*STEEP, GRAZING_INCIDENCE], POLAR + GRAZING, [0.0, 45.0, 90.0, 135.0, 180.0], [0, 1]
    theta_i, theta_o, phi, side = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    return Directions.from_degrees(theta_i, theta_o, phi, side > 0), theta_i > STEEP[-1], theta_o > POLAR[-1]


DIRECTIONS, ENTERS_GRAZING, LEAVES_GRAZING = directions()


def stack(kind: str, phase_function: PhaseFunction, thickness: float) -> Stack:
    """One layer in air."""
    layer = ScatteringLayer(INDICES[kind], thickness, ALBEDO, phase_function)
    return Stack((layer,), 1.0, 1.0)


def bsdf(layers, config):
    """BSDF at all directions."""
    return diffuse_bsdf(layers, DIRECTIONS, config)


def errors(found, reference) -> tuple[float, float, float]:
    """Largest relative error to 85 degrees, at 87.5 and 89, and at grazing incidence."""
    error = np.abs(np.asarray(found) / reference - 1)
    steep = ~ENTERS_GRAZING
    parts = steep & ~LEAVES_GRAZING, steep & LEAVES_GRAZING, ENTERS_GRAZING
    return tuple(float(error[part].max()) for part in parts)


def sizes(config: SolverConfig) -> str:
    """Sizes as printed."""
    return f"{config.nodes_escaping} x {config.nodes_trapped} x {config.n_moments} x {config.n_orders}"


def against_streams(kind: str, exact_once: bool, references: dict) -> str:
    """Table of the error to 85 degrees of a layer of optical thickness 1."""
    rows = []
    for nodes in NODES:
        config = SolverConfig(nodes, nodes, 2 * nodes, 2 * nodes)
        row = [str(2 * nodes if kind == "matched" else 4 * nodes)]
        for g in ASYMMETRIES:
            phase = HenyeyGreenstein(g)
            used = phase if exact_once else SeriesOnly(phase, config.n_moments)
            found = bsdf(stack(kind, used, 1.0), config)
            row.append(f"{errors(found, references[kind, g, 1.0])[0]:.0e}")
        rows.append(row)
    return table(["streams", *(f"g = {g:g}" for g in ASYMMETRIES)], rows)


def at_chosen_sizes(kind: str, references: dict) -> str:
    """Table of sizes and errors of Henyey-Greenstein layers at each accuracy."""
    rows = [
        [f"{g:g}", f"{t:g}", *kept(stack(kind, HenyeyGreenstein(g), t), references[kind, g, t])]
        for g in ASYMMETRIES[:-1]
        for t in THICKNESSES
    ]
    return table(["g", "thickness", *ASKED], rows)


def of_a_cloud() -> str:
    """The same of cloud C.1, which has 299 moments."""
    cloud = TabulatedByMoments(phase_moments("cloud_c1"))
    layers = {thickness: stack("matched", cloud, thickness) for thickness in CLOUDS}
    rows = [[f"{t:g}", *kept(layer, np.asarray(bsdf(layer, CLOUD_REFERENCE)))] for t, layer in layers.items()]
    return table(["thickness", *ASKED], rows)


def kept(layers: Stack, reference: np.ndarray) -> list[str]:
    """Sizes and errors at each accuracy."""
    cells = []
    for accuracy in ACCURACIES:
        c = choose_sizes(layers, accuracy)
        found = errors(bsdf(layers, c), reference)
        cells.append(f"{sizes(c)}: {', '.join(f'{error:.0e}' for error in found)}")
    return cells


def disort_problems() -> str:
    """Table of sizes and errors of DISORT's test problems."""
    body = []
    for name, rows in read_problems().items():
        converged, grazing = column(rows, "converged"), column(rows, "mu") < np.cos(np.deg2rad(85.5))
        row = [name, rows[0]["phase"].replace("_", " "), rows[0]["optical_thickness"], rows[0]["albedo"]]
        for accuracy in (1e-4, 1e-6):
            c = choose_sizes(stack_of(rows), accuracy)
            error = np.where(converged > DARK, np.abs(radiances(rows, c) / converged - 1), 0.0)
            row.append(f"{sizes(c)}: {error[~grazing].max():.0e}, {error[grazing].max():.0e}")
        printed = np.array([float(r["published"] or "nan") for r in rows]) / column(rows, "irradiance")
        body.append([*row, f"{np.nanmax(np.abs(printed / converged - 1)):.0e}"])
    header = ["problem", "phase function", "thickness", "albedo", "asked 0.0001", "asked 1e-06", "as printed"]
    return table(header, body)


def main() -> None:
    """Write docs/validation/accuracy.md."""
    with computing():
        references = {
            (kind, g, t): np.asarray(bsdf(stack(kind, HenyeyGreenstein(g), t), REFERENCE[kind]))
            for kind in INDICES
            for g in ASYMMETRIES
            for t in THICKNESSES
        }
        parts = {kind: against_streams(kind, True, references) for kind in INDICES}
        parts |= {f"{kind}_delta_m": against_streams(kind, False, references) for kind in INDICES}
        parts |= {f"{kind}_chosen": at_chosen_sizes(kind, references) for kind in INDICES}
        parts |= {"cloud": of_a_cloud(), "problems": disort_problems()}
    parts |= {f"reference_{kind}": sizes(config) for kind, config in REFERENCE.items()}
    parts |= {"reference_cloud": sizes(CLOUD_REFERENCE), "albedo": ALBEDO, "dark": DARK}
    text = filled(Path(__file__).with_name("accuracy.md.in"), **parts)
    write_page("accuracy.md", text.rstrip() + section_after("accuracy.md", MARK))


if __name__ == "__main__":
    main()
