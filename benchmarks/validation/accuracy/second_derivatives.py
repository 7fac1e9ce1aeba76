"""Second derivatives of the BSDF against differences of the first, by kind of layer and face.

python -m benchmarks.validation.accuracy.second_derivatives [KIND ...]
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxink import ClearLayer, Directions, ScatteringLayer, SolverConfig, Stack, diffuse_bsdf, plan_channels
from jaxink.numerics.compiling import jit_unoptimised
from jaxink.particles.mie import mie_coefficients
from jaxink.particles.mixture import SpherePopulation, mixture_coefficients
from jaxink.particles.phase_function import (
    HenyeyGreenstein,
    Rayleigh,
    TabulatedByAngle,
    TabulatedByMoments,
    TwoTermHenyeyGreenstein,
)
from jaxink.particles.size_distribution import log_normal, monodisperse
from jaxink.solver.lateral import LateralField
from jaxink.surfaces.slopes import DENSITIES, SlopeDensity, SlopeMixture, slope_density
from jaxink.surfaces.spectrum import GaussianSpectrum, KCorrelation, tabulated_spectrum
from jaxink.surfaces.wave_face import WaveFace

jax.config.update("jax_enable_x64", True)

RESULTS = Path(__file__).with_name("second_derivatives.json")
DIRECTIONS = Directions.from_degrees(
    [0.0, 30.0, 30.0, 60.0, 60.0],
    [20.0, 40.0, 10.0, 70.0, 5.0],
    [0.0, 180.0, 90.0, 35.0, 180.0],
    [False, True, False, True, False],
)
CONFIG = SolverConfig(6, 4, 12, 3)
# Step over the size of each variable, and the central difference, one of eighth order: Mie's resonances are
# narrow.
STEP, STEPS = 2e-4, np.array([-4, -3, -2, -1, 1, 2, 3, 4])
COEFFICIENTS = np.array([3, -32, 168, -672, 672, -168, 32, -3]) / 840
MODES = ("forward over forward", "forward over reverse", "reverse over forward", "reverse over reverse")


class Kind(NamedTuple):
    """Stacks of one kind.

    Parameters
    ----------
    stack
        From variables to a stack.
    point
        The variables.
    free
        Media whose refractive index varies, see `plan_channels`.
    sides
        For each variable, -1 or 1 where it may only decrease or increase, else 0.
    """

    stack: Callable[[jax.Array], Stack]
    point: tuple[float, ...]
    free: tuple[int, ...] = ()
    sides: tuple[int, ...] | None = None


def _plate(ink, **more) -> Stack:
    return Stack((ClearLayer(1.49, 0.02), ink), 1.0, 1.0, **more)


def _ink(x, phase=HenyeyGreenstein):
    """From albedo, logarithm of the optical thickness and asymmetry parameter; index 1.56."""
    return ScatteringLayer(1.56, jnp.exp(x[1]), x[0], phase(x[2]))


def _hg(albedo, thickness, asymmetry, sides=None) -> Kind:
    return Kind(lambda x: _plate(_ink(x)), (albedo, float(np.log(thickness)), asymmetry), sides=sides)


def _of_index(index) -> Kind:
    def stack(x):
        return _plate(ScatteringLayer(x[2], jnp.exp(x[1]), x[0], HenyeyGreenstein(0.6)))

    return Kind(stack, (0.95, float(np.log(3.0)), index), (2,))


class HeldFacets(SlopeDensity):
    """A density summed over facets that are placed for another one.

    The sum over facets has small steps where their places move with the density. Its
    derivatives are those at facets that stay where they are, and so are the differences.
    """

    own: SlopeDensity
    places: SlopeDensity

    def _scale(self):
        return self.places.scale

    def _largest_slope(self):
        return self.places.largest_slope

    def _shape(self, slope):
        return self.own.radial(slope)

    def radial(self, slope):
        """Of the density itself."""
        return self.own.radial(slope)


def _facets(density, point, first=True) -> Kind:
    return _faces(lambda x: HeldFacets(density(x), density(point)), point, first)


def _faces(face, point, first=True, **more) -> Kind:
    def stack(x):
        faces = (None, face(x[2:]), None) if first else (None, None, face(x[2:]))
        ink = ScatteringLayer(1.56, jnp.exp(x[1]), x[0], HenyeyGreenstein(0.6))
        return _plate(ink, faces=faces, **more)

    return Kind(stack, (0.95, float(np.log(3.0)), *point))


def _mie(x):
    phase, scattering, absorption = mie_coefficients(x[0], x[1] + 0.01j, x[2], 1.5, 550.0)
    return phase, scattering, absorption


def _log_normal(x):
    return mixture_coefficients(
        (SpherePopulation(log_normal(x[0], x[1], 25), 2.5 + 0.01j, x[2]),), 1.5, 550.0
    )


def _dense(x):
    return mixture_coefficients((SpherePopulation(monodisperse(x[0]), 2.5 + 0.01j, x[2]),), 1.5, 550.0, x[1])


def _two_pigments(x):
    sizes = (x[0], 2.5 + 0.01j, x[2]), (x[1], 1.6 + 0.2j, 0.5 * x[2])
    return mixture_coefficients(
        tuple(SpherePopulation(monodisperse(r), m, v) for r, m, v in sizes), 1.5, 550.0
    )


def _particles(coefficients, point) -> Kind:
    def stack(x):
        phase, scattering, absorption = coefficients(x)
        extinction = scattering + absorption
        return _plate(ScatteringLayer(1.5, 0.02 * extinction, scattering / extinction, phase))

    return Kind(stack, point)


def _of_table(phase) -> Kind:
    return Kind(lambda x: _plate(_ink((*x, 0.0), lambda _: phase)), (0.95, float(np.log(3.0))))


def _by_angle() -> TabulatedByAngle:
    cosine = np.cos(np.linspace(0, np.pi, 25))
    return TabulatedByAngle(cosine, np.asarray(HenyeyGreenstein(0.4).value(cosine)))


def _two_layers(x):
    upper = ScatteringLayer(x[2], 0.4, 0.9, HenyeyGreenstein(0.3))
    return Stack((upper, ScatteringLayer(1.6, jnp.exp(x[1]), x[0], HenyeyGreenstein(0.7))), 1.0, 1.0)


def _backed(x):
    return _plate(ScatteringLayer(1.56, jnp.exp(x[1]), x[0], HenyeyGreenstein(0.6)), backing=x[2])


def _narrow_field(x):
    field = LateralField(x[2], x[3], jnp.array([1.0, 0.0]))
    return _plate(ScatteringLayer(1.5, jnp.exp(x[1]), x[0], HenyeyGreenstein(0.6)), lateral=field)


def _absorbing_plate(x):
    ink = ScatteringLayer(1.5, 3.0, x[0], HenyeyGreenstein(x[1]))
    return Stack((ink, ClearLayer(1.49, x[2])), 1.0, 1.0)


def _wave(spectrum):
    return lambda x: WaveFace(spectrum(x), 550.0)


def _measured_spectrum(x):
    frequency = np.geomspace(0.01, 2.0, 12)
    return tabulated_spectrum(frequency, 0.02 / (1 + (3 * frequency) ** 2) ** 2, x[0])


KINDS = {
    "Henyey-Greenstein": _hg(0.95, 3.0, 0.6),
    "without absorption": _hg(1.0, 3.0, 0.6, (-1, 0, 0)),
    "black": _hg(0.0, 3.0, 0.6, (1, 0, 0)),
    "isotropic": _hg(0.9, 3.0, 0.0),
    "backward": _hg(0.9, 3.0, -0.7),
    "narrow forward peak": _hg(0.9, 3.0, 0.98),
    "thin": _hg(0.9, 1e-3, 0.6),
    "thick": _hg(0.99, 1e3, 0.6),
    "thick, without absorption": _hg(1.0, 30.0, 0.6, (-1, 0, 0)),
    "two-term Henyey-Greenstein": Kind(
        lambda x: _plate(ScatteringLayer(1.56, 3.0, x[0], TwoTermHenyeyGreenstein(x[1], x[2], x[3]))),
        (0.95, 0.7, -0.2, 0.3),
    ),
    "Rayleigh": Kind(lambda x: _plate(_ink((*x, 0.0), lambda _: Rayleigh())), (0.95, float(np.log(3.0)))),
    "table by angle": _of_table(_by_angle()),
    "table of moments": _of_table(TabulatedByMoments(0.4 ** np.arange(14))),
    "Mie": _particles(_mie, (150.0, 2.5, 0.1)),
    "Mie, log-normal radii": _particles(_log_normal, (150.0, 0.1, 0.1)),
    "Mie, dense": _particles(_dense, (150.0, 0.7, 0.3)),
    "Mie, two pigments": _particles(_two_pigments, (150.0, 90.0, 0.1)),
    "index above the plate's": _of_index(1.56),
    "index below the plate's": _of_index(1.45),
    "ink on ink of higher index": Kind(_two_layers, (0.95, float(np.log(3.0)), 1.5), (1,)),
    "ink on ink of lower index": Kind(_two_layers, (0.95, float(np.log(3.0)), 1.7), (1,)),
    "ink in air, without an index step": Kind(
        lambda x: Stack((ScatteringLayer(1.0, jnp.exp(x[1]), x[0], HenyeyGreenstein(x[2])),), 1.0, 1.0),
        (0.95, float(np.log(3.0)), 0.5),
    ),
    "absorbing plate": Kind(_absorbing_plate, (0.95, 0.6, 0.3)),
    "backing": Kind(_backed, (0.95, float(np.log(3.0)), 0.4)),
    "finite beam and field of view": Kind(_narrow_field, (0.95, float(np.log(3.0)), 1.0, 3.0)),
    **{f"facets: {law}": _facets(lambda x, law=law: slope_density(law, x[0]), (8.0,)) for law in DENSITIES},
    "facets, outer face": _facets(lambda x: slope_density("beckmann", x[0]), (8.0,), first=False),
    "facets: two densities": _facets(
        lambda x: SlopeMixture(slope_density("beckmann", x[0]), slope_density("ggx", 15.0), x[1]), (8.0, 0.3)
    ),
    "waves: Gaussian": _faces(_wave(lambda x: GaussianSpectrum(x[0], x[1])), (0.01, 2.0)),
    "waves: K-correlation": _faces(_wave(lambda x: KCorrelation(x[0], x[1], x[2])), (0.01, 8.0, 4.5)),
    "waves: measured spectrum": _faces(_wave(_measured_spectrum), (1.0,)),
}


def errors(kind: Kind) -> dict[str, float]:
    """Largest error of second derivatives along a seeded direction over their largest, for each of `MODES`.

    What is differentiated is a weighted sum of the BSDF at five points, over its value.
    """
    point = jnp.array(kind.point, float)
    plan = plan_channels(kind.stack(point), kind.free)
    random = np.random.default_rng(5)
    weights = jnp.asarray(random.uniform(0.5, 1.0, 5))
    along = random.uniform(0.5, 1.0, point.size)
    sides = np.array(kind.sides or [0] * point.size)
    # Variables of one side move to that side; all move in the same units.
    along = jnp.asarray(np.where(sides == 0, along, sides * along) * np.maximum(np.abs(kind.point), 0.1))
    scale = weights @ diffuse_bsdf(kind.stack(point), DIRECTIONS, CONFIG, plan)

    def value(x):
        return weights @ diffuse_bsdf(kind.stack(x), DIRECTIONS, CONFIG, plan) / scale

    reverse = jax.grad(value)

    @jit_unoptimised
    def all_modes(x):
        units = jnp.eye(x.size)
        slope = jax.vmap(lambda unit: jax.jvp(lambda y: jax.jvp(value, (y,), (unit,))[1], (x,), (along,))[1])
        return (
            slope(units),
            jax.jvp(reverse, (x,), (along,))[1],
            jax.grad(lambda y: jax.jvp(value, (y,), (along,))[1])(x),
            jax.grad(lambda y: reverse(y) @ along)(x),
        )

    first = jit_unoptimised(jax.jacfwd(value))
    steps, coefficients = STEPS, COEFFICIENTS
    if sides.any():
        # One-sided, of fourth order.
        steps, coefficients = np.arange(5), np.array([-25, 48, -36, 16, -3]) / 12
    step = STEP * (0.1 if sides.any() else 1.0)
    slopes = np.array([first(point + k * step * along) for k in steps])
    expected = coefficients @ slopes / step
    size = np.max(np.abs(expected))
    found = (np.asarray(one) for one in all_modes(point))
    return {
        mode: float(np.max(np.abs(one - expected)) / size) for mode, one in zip(MODES, found, strict=True)
    }


def main(names: list[str]) -> None:
    """Compute the errors of some kinds, or of all, and keep them."""
    kept = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in names or KINDS:
        kept[name] = errors(KINDS[name])
        print(name, *(f"{error:.1e}" for error in kept[name].values()), flush=True)
        RESULTS.write_text(json.dumps({kind: kept[kind] for kind in KINDS if kind in kept}, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
