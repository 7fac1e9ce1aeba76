"""Light that comes out of a slab beside the port of a sphere, and what it does to the inferred absorption."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

import jaxink
from benchmarks import montecarlo
from benchmarks.montecarlo import Layer, Sample, simulate
from benchmarks.validation.totals.sphere import LOSSLESS, REFLECTANCES, Slab, Sphere
from jaxink.solver.lateral import LateralField

# Light that misses the sample port is followed with this many photons, twice each time.
N_PHOTONS, LOSS_ROUNDS = 30_000, 2
# How much thinner an ink is that has no room to walk in.
SQUEEZED = 1e3
LOSSES = NO_LOSS, IN_SLIDES, IN_ALL = "no loss", "in the slides", "in slides and ink"
# Error of a reflectance that the header states, to see what it does.
REFLECTANCE_ERROR = 0.01
# As the diagnosis has it: no more points than parameters.
NOT_TESTABLE = "not_testable"


def lost_in_slides(sphere: Sphere) -> Callable:
    """Shares of R and T beside the port by the library, which lets light walk in clear layers only."""
    slab = sphere.slab
    nodes, weights = np.polynomial.legendre.leggauss(24)
    cosine, weight = (nodes + 1) / 2, np.pi * (nodes + 1) / 2 * weights
    theta = np.tile(np.rad2deg(np.arccos(cosine)), 2)
    is_transmission = np.repeat([False, True], cosine.size)
    directions = jaxink.Directions.from_degrees(
        np.zeros(theta.size), theta, np.full(theta.size, 180.0), is_transmission
    )
    slide = slab.length("slide_thickness_mm")
    field = LateralField(*slab.radii_mm, [slide, 0.0, slide])

    @jax.jit
    def lost(x):
        whole, seen = (
            jaxink.diffuse_bsdf(slab.stack(x, lateral), directions, sphere.config)
            for lateral in (None, field)
        )
        return jnp.sum((whole - seen).reshape(2, -1) * weight, axis=1)

    return lambda x: (np.asarray(lost(jnp.asarray(x))) / sphere.totals(x)[0], LOSSLESS)


def lost_by_photons(slab: Slab, x, squeezed: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Shares of R and T beside the port by Monte Carlo, in slides and ink, and their standard errors.

    The same photons are counted twice, with the port and without, so that only those beside it make noise.
    An ink squeezed by a large factor has the same optical thickness and no room to walk in.
    """
    slide = Layer(slab.slide_index, slab.length("slide_thickness_mm"))
    scattering, absorption = squeezed * np.array([np.exp(x[0]) / (1 - slab.asymmetry), x[1]])
    phase = montecarlo.HenyeyGreenstein(slab.asymmetry)
    middle = Layer(slab.index, slab.thickness_mm / squeezed, scattering, absorption, phase)
    beam, port = slab.radii_mm
    counts = [
        simulate(Sample((slide, middle, slide), beam_radius_mm=beam, seen_radius_mm=radius), 0.0, N_PHOTONS)
        for radius in (None, port)
    ]
    whole, seen = (
        np.stack([c.powers[f"{side}_regular"] + c.powers[f"{side}_diffuse"] for side in "RT"]) for c in counts
    )
    share = (whole - seen) / whole.mean(axis=1, keepdims=True)
    return share.mean(axis=1), share.std(axis=1, ddof=1) / np.sqrt(share.shape[1])


@dataclass(frozen=True)
class Inferred:
    """One slab without loss, with that in the slides and with that in slides and ink, by these names.

    ``lost_squeezed``: by photons with a squeezed ink, and its standard error. ``by_reflectance``: absorption
    without loss if one of the stated reflectances is higher by `REFLECTANCE_ERROR`.
    """

    slab: Slab
    totals: np.ndarray
    lost: dict[str, np.ndarray]
    lost_error: np.ndarray
    lost_squeezed: tuple[np.ndarray, np.ndarray]
    parameters: dict[str, np.ndarray]
    misfits: dict[str, float]
    by_reflectance: dict[str, float]
    jacobian: np.ndarray

    def change(self, loss: str) -> float:
        """Of the absorption by a loss, in percent."""
        return self.changed_to(self.parameters[loss][1])

    def changed_to(self, absorption_per_mm: float) -> float:
        """Change of the absorption from that without loss, in percent."""
        return 100 * (absorption_per_mm / self.parameters[NO_LOSS][1] - 1)

    @property
    def rank(self) -> int:
        """Of the derivatives of both readings."""
        return int(np.linalg.matrix_rank(self.jacobian))

    @property
    def outside(self) -> float:
        """Share of the loss's derivative that scattering and absorption cannot imitate."""
        known, loss = self.jacobian[:, :2], self.jacobian[:, 2]
        left = loss - known @ np.linalg.lstsq(known, loss, rcond=None)[0]
        return float(np.linalg.norm(left) / np.linalg.norm(loss))

    @property
    def condition(self) -> float:
        """Of scattering and absorption, their columns scaled to unit length."""
        known = self.jacobian[:, :2]
        return float(np.linalg.cond(known / np.linalg.norm(known, axis=0)))

    @property
    def verdict(self) -> str:
        """Code and reason."""
        points, parameters = self.slab.readings.size, self.parameters[NO_LOSS].size
        if points > parameters:
            raise SystemExit("there are more readings than parameters: the loss has to be tested.")
        return (
            f"`{NOT_TESTABLE}`: {points} readings, {parameters} parameters without the loss, "
            f"{points - parameters} degrees of freedom"
        )


def losses_in_slides(slab: Slab, x) -> list[tuple[str, np.ndarray, tuple[np.ndarray, np.ndarray]]]:
    """The loss in the slides by the library and by photons in a squeezed ink, as the slab is made simpler."""
    isotropic = replace(slab, asymmetry=0.0)
    cases = {
        "as it is": slab,
        "g = 0": isotropic,
        "g = 0, slides of the index of the ink": replace(isotropic, slide_index=slab.index),
    }
    return [
        (name, lost_in_slides(Sphere(case))(x)[0], lost_by_photons(case, x, SQUEEZED))
        for name, case in cases.items()
    ]


def inferred(slab: Slab) -> Inferred:
    """Invert the readings of one slab; a loss depends on the solution, so both are found in rounds."""
    sphere = Sphere(slab)
    start, misfit = sphere.invert()
    parameters, misfits, lost = {NO_LOSS: start}, {NO_LOSS: misfit}, {NO_LOSS: LOSSLESS}
    in_slides = lost_in_slides(sphere)
    for name, loss in ((IN_SLIDES, in_slides), (IN_ALL, lambda x: lost_by_photons(slab, x))):
        found, error = start, None
        for _ in range(LOSS_ROUNDS):
            lost[name], error = loss(found)
            found, misfits[name] = sphere.invert(lost[name])
        parameters[name] = found
    squeezed = lost_by_photons(slab, parameters[IN_SLIDES], SQUEEZED)
    by_reflectance = {
        name: float(sphere.with_reflectance(name, REFLECTANCE_ERROR).invert()[0][1]) for name in REFLECTANCES
    }
    return Inferred(
        slab,
        sphere.totals(start)[0],
        lost,
        error,
        squeezed,
        parameters,
        misfits,
        by_reflectance,
        sphere.jacobian(start, lost[IN_ALL]),
    )
